//! Tests by question: are the formulas the standard's, do they hold under rigid motions, is an assessment complete
//! and honest, and does an independent implementation agree?

mod assessment;
mod motion;
mod oracle;
mod paths;
mod poses;
mod symmetry;

use crate::{TimedPose, TipPose};
use nalgebra::{UnitQuaternion, Vector3};

/// A position given in millimetres.
fn mm(x: f64, y: f64, z: f64) -> TipPose {
    TipPose::at(Vector3::new(x, y, z) * 1e-3)
}

/// The same, turned by a rotation vector [rad].
fn turned(position: TipPose, about: [f64; 3]) -> TipPose {
    TipPose { orientation: Some(UnitQuaternion::from_scaled_axis(Vector3::from(about))), ..position }
}

/// A motion sampled every `step_s` [s] from 0 to `end_s` [s].
fn sampled(step_s: f64, end_s: f64, at: impl Fn(f64) -> TipPose) -> Vec<TimedPose> {
    let count = (end_s / step_s).round() as i64;
    (0..=count)
        .map(|i| TimedPose { time_ns: (i as f64 * step_s * 1e9).round() as i64, pose: at(i as f64 * step_s) })
        .collect()
}

#[track_caller]
fn close(got: f64, want: f64, tolerance: f64) {
    assert!((got - want).abs() <= tolerance, "{got} is not {want} within {tolerance}");
}

/// Number of criteria, every part of every characteristic counted.
fn parts_of_the_standard() -> usize {
    crate::catalogue::CHARACTERISTICS.iter().map(|what| what.components.len()).sum()
}
