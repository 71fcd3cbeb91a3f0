//! How well an arm and its sensor repeat, from poses that were visited more than once.
//!
//! ```text
//! s^2 = sum_g sum_i |e_i - mean_g|^2 / (3 sum_g (n_g - 1)),   E|e| = s sqrt(8/pi)
//! ```
//!
//! over visits to one pose (of a seated tip in one cavity) that came the same way in one recording (ISO 9283 asks for one direction of
//! approach): whatever a model does not know is the same in all of these.

use crate::objective::alike::AlikePoses;
use crate::objective::poses::SAME_POSE_RAD;
use crate::outcome::Calibration;
use armcal_core::{Arrival, FeatureId, Observation};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Fewest visits beyond the first one of each place.
const FEWEST: usize = 8;

/// Mean error that repeatability alone gives, as the residuals of a calibration have it [m]; none where too little was revisited.
pub fn repeatability_m(calibration: &Calibration, observations: &[Observation]) -> Option<f64> {
    of_errors(observations, calibration.residuals.iter().map(|r| r.fitted_m))
}

/// The same of errors in the world [m], one an observation.
fn of_errors(observations: &[Observation], errors_m: impl Iterator<Item = Vector3<f64>>) -> Option<f64> {
    let mut visits: BTreeMap<(usize, usize, FeatureId, String), Vec<Vector3<f64>>> = BTreeMap::new();
    let mut poses = AlikePoses::within(SAME_POSE_RAD);
    let pose = |o: &Observation| poses.group_of(&o.joint_rad);
    let each = observations.iter().map(pose).zip(observations).zip(errors_m);
    for ((pose, o), error_m) in each.filter(|((_, o), _)| o.position_rows() == 3) {
        let came = o.arrival.iter().map(Arrival::symbol).chain(o.cavity().unwrap_or_default().chars());
        visits.entry((o.dwell.recording, pose, o.feature, came.collect())).or_default().push(error_m);
    }
    let (mut square_m2, mut more) = (0.0, 0);
    for errors_m in visits.values() {
        let mean_m = errors_m.iter().sum::<Vector3<f64>>() / errors_m.len() as f64;
        square_m2 += errors_m.iter().map(|e| (e - mean_m).norm_squared()).sum::<f64>();
        more += errors_m.len() - 1;
    }
    (more >= FEWEST).then(|| (square_m2 / (3 * more) as f64).sqrt() * (8.0 / PI).sqrt())
}

#[cfg(test)]
#[path = "../tests/repeatability.rs"]
mod tests;
