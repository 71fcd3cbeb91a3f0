//! Errors of the dwells, in the axes of the calibrated base.

use armcal_core::Observation;
use armcal_stages::Placed;
use armcal_verify::PointError;

/// Measured minus predicted of every observation, by the nominal and by the calibrated arm.
pub fn errors(placed: &Placed, observations: &[Observation]) -> Vec<PointError> {
    let base = placed.model.base_in_world(&placed.calibrated).rotation.inverse();
    let error = |p: &[f64], o: &Observation| base * placed.model.residual(p, o).position_m;
    observations
        .iter()
        .map(|o| PointError {
            dwell: o.dwell,
            cavity: o.cavity().map(str::to_owned),
            joined: o.is_joined(),
            arrival: o.arrival.clone(),
            before_m: error(&placed.nominal, o),
            after_m: error(&placed.calibrated, o),
        })
        .collect()
}
