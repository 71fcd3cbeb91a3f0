//! Errors by what was measured of the arm: its tip, and each of its markers.

use crate::run::Run;
use serde::Serialize;

/// Errors of the tip or of one marker, on the side by which the calibration is judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct MarkerErrors<'a> {
    /// Its name.
    pub marker: &'a str,
    /// The link it is on; none of the tip.
    pub link: Option<&'a str>,
    /// Observations of it.
    pub n: usize,
    /// Mean error with nominal robot parameters, estimated frames fitted [mm].
    pub nominal_mm: f64,
    /// Mean error with the fitted parameters [mm].
    pub fitted_mm: f64,
    /// Mean error that the declared noise alone gives [mm].
    pub floor_mm: f64,
}

/// The errors of each; nothing of an arm without markers, whose errors are those of its tip.
pub(crate) fn by_marker(run: &Run) -> Vec<MarkerErrors<'_>> {
    if run.model.markers().next().is_none() {
        return Vec::new();
    }
    let link = |id| run.model.markers().find(|(marker, ..)| *marker == id).map(|(_, _, link)| link);
    let of = |(id, marker)| {
        let own = || run.calibration.judged_pairs(&run.observations).filter(move |(_, o)| o.feature == id);
        let n = own().count();
        let mean_mm = |sum_m: f64| sum_m / n as f64 * 1e3;
        (n > 0).then(|| MarkerErrors {
            marker,
            link: link(id),
            n,
            nominal_mm: mean_mm(own().map(|(r, _)| r.nominal_m.norm()).sum()),
            fitted_mm: mean_mm(own().map(|(r, _)| r.fitted_m.norm()).sum()),
            floor_mm: mean_mm(own().map(|(r, _)| r.expected_norm_m).sum()),
        })
    };
    run.model.features().filter_map(of).collect()
}
