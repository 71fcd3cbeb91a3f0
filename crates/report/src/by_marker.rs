//! Errors by what was measured of the arm: its tip, each of its markers, and points that are joined.

use crate::run::Run;
use crate::two_arms::about;
use armcal_core::Observation;
use serde::Serialize;

/// Errors of the tip, of one marker or of joined points, on the side by which the calibration is judged.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct MarkerErrors<'a> {
    /// Its name; of joined points both.
    pub marker: String,
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

/// The errors of each; nothing where all are of one kind: of an arm without markers, of tips that are joined only.
pub(crate) fn by_marker(run: &Run) -> Vec<MarkerErrors<'_>> {
    if run.model.markers().next().is_none() || run.observations.iter().all(Observation::is_joined) {
        return Vec::new();
    }
    let link = |id| run.model.markers().find(|(marker, ..)| *marker == id).map(|(_, _, link)| link);
    let of = |marker, link, is_own: &dyn Fn(&Observation) -> bool| {
        let own = || run.calibration.judged_pairs(&run.observations).filter(|(_, o)| is_own(o));
        let n = own().count();
        let mean_mm = |sum_m: f64| sum_m / n as f64 * 1e3;
        (n > 0).then(|| MarkerErrors {
            marker,
            link,
            n,
            nominal_mm: mean_mm(own().map(|(r, _)| r.nominal_m.norm()).sum()),
            fitted_mm: mean_mm(own().map(|(r, _)| r.fitted_m.norm()).sum()),
            floor_mm: mean_mm(own().map(|(r, _)| r.expected_norm_m).sum()),
        })
    };
    let features = run
        .model
        .features()
        .filter_map(|(id, name)| of(name.to_owned(), link(id), &|o| o.feature == id && !o.is_joined()));
    let joined = about(run).and_then(|points| of(points, None, &Observation::is_joined));
    features.chain(joined).collect()
}
