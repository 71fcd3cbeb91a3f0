//! Errors by what was measured: the tip and each of its markers, by a sensor or against fixed places.

use crate::run::Run;
use armcal_core::Observation;
use armcal_core::units::format_mm;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// Errors of the tip, of one marker or of joined points, on the side by which the calibration is judged.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MarkerErrors<'a> {
    /// Its name; of what was measured against a fixed place that too (`tip from post`).
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

impl MarkerErrors<'_> {
    /// Mean errors as tables show them [mm]: nominal, fitted, floor.
    pub fn shown(&self) -> [String; 3] {
        [self.nominal_mm, self.fitted_mm, self.floor_mm].map(|mm| format_mm(mm * 1e-3))
    }
}

/// Whether more than the tip was measured, or against more than sensor and table; not where all are tips that are joined.
pub fn is_told(run: &Run) -> bool {
    let more = run.model.markers().next().is_some() || run.model.places().next().is_some();
    more && !run.observations.iter().all(Observation::is_joined)
}

/// The name of what an observation is of.
pub fn marker_name(run: &Run, o: &Observation) -> String {
    run.model.measured_name(o).unwrap_or_else(|| run.model.feature_name(o.feature).to_owned())
}

/// The errors of each; nothing of an arm without markers and places, whose errors are those of its tip.
pub fn by_marker(run: &Run) -> Vec<MarkerErrors<'_>> {
    let model = &run.model;
    if !is_told(run) {
        return Vec::new();
    }
    let mut groups: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for pair in run.calibration.judged_pairs(&run.observations) {
        groups.entry(pair.1.what()).or_default().push(pair);
    }
    let link = |id| model.markers().find(|(marker, ..)| *marker == id).map(|(_, _, link)| link);
    let errors = |own: Vec<(&armcal_calibrate::Residual, &Observation)>| {
        let o = own.first()?.1;
        let mean_mm = |sum_m: f64| sum_m / own.len() as f64 * 1e3;
        Some(MarkerErrors {
            marker: marker_name(run, o),
            link: link(o.feature),
            n: own.len(),
            nominal_mm: mean_mm(own.iter().map(|(r, _)| r.nominal_m.norm()).sum()),
            fitted_mm: mean_mm(own.iter().map(|(r, _)| r.fitted_m.norm()).sum()),
            floor_mm: mean_mm(own.iter().map(|(r, _)| r.expected_norm_m).sum()),
        })
    };
    groups.into_values().filter_map(errors).collect()
}
