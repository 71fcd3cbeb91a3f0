//! A pose as the standard sees it: a position, and an orientation where it was tracked.
//!
//! The standard writes orientations as angles a, b, c about x, y, z. Differences of such angles depend on the order
//! of the turns and jump at +-180 deg, so armcal takes for (a, b, c) the rotation vector of the turn between two
//! orientations, expressed in the frame of the positions. For the small turns between commanded and attained
//! orientations the two agree to first order.

use crate::IsoError;
use crate::error::at_least;
use armcal_core::Pose;
use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;

/// A commanded or attained pose of the tip, in the frame in which it is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TipPose {
    /// Position [m].
    pub position_m: Vector3<f64>,
    /// Orientation of the tip, where it is commanded and tracked.
    pub orientation: Option<UnitQuaternion<f64>>,
}

/// A pose with its time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TimedPose {
    /// Time [ns].
    pub time_ns: i64,
    /// The pose.
    pub pose: TipPose,
}

impl TipPose {
    /// A pose of which only the position [m] is known.
    pub fn at(position_m: Vector3<f64>) -> TipPose {
        TipPose { position_m, orientation: None }
    }

    /// Angles a, b, c [rad] about x, y, z by which this pose is turned from `reference`.
    pub fn turn_from_rad(&self, reference: &TipPose) -> Option<Vector3<f64>> {
        Some((self.orientation? * reference.orientation?.inverse()).scaled_axis())
    }

    /// The pose seen after a rigid motion `by` of the world.
    pub fn moved(&self, by: &Pose) -> TipPose {
        TipPose {
            position_m: by.rotation * self.position_m + by.translation.vector,
            orientation: self.orientation.map(|q| by.rotation * q),
        }
    }

    /// The pose a fraction `s` (0 to 1) of the way to `to`: on the straight line, by the shortest turn.
    pub fn towards(&self, to: &TipPose, s: f64) -> TipPose {
        TipPose {
            position_m: self.position_m.lerp(&to.position_m, s),
            orientation: to
                .turn_from_rad(self)
                .zip(self.orientation)
                .map(|(turn_rad, from)| UnitQuaternion::from_scaled_axis(turn_rad * s) * from),
        }
    }

    pub(crate) fn is_finite(&self) -> bool {
        let turned = self.orientation.is_none_or(|q| q.coords.iter().all(|v| v.is_finite()));
        turned && self.position_m.iter().all(|v| v.is_finite())
    }
}

/// Barycentre of a cluster of poses: mean position, and the orientation from which the turns to all of them add up
/// to zero where every pose has one. The cluster must not be empty.
pub fn barycentre(poses: &[TipPose]) -> TipPose {
    let sum_m: Vector3<f64> = poses.iter().map(|p| p.position_m).sum();
    TipPose { position_m: sum_m / poses.len() as f64, orientation: mean_orientation(poses) }
}

/// Iterated mean of turns (Manton, *A globally convergent numerical algorithm for computing the centre of mass on
/// compact Lie groups*, 2004). Converges quadratically for the clusters an arm makes; ten steps leave nothing.
fn mean_orientation(poses: &[TipPose]) -> Option<UnitQuaternion<f64>> {
    let mut centre = poses.first().copied()?;
    centre.orientation?;
    for _ in 0..10 {
        let turns_rad = poses.iter().map(|p| p.turn_from_rad(&centre)).collect::<Option<Vec<_>>>()?;
        let turn_rad = turns_rad.iter().sum::<Vector3<f64>>() / poses.len() as f64;
        centre.orientation = centre.orientation.map(|q| UnitQuaternion::from_scaled_axis(turn_rad) * q);
    }
    centre.orientation
}

/// Fails unless there are at least `least` poses for the criterion `what`, all finite.
pub(crate) fn check_poses(what: &'static str, poses: &[TipPose], least: usize) -> Result<(), IsoError> {
    at_least(least, "cycles", poses.len(), what)?;
    match poses.iter().position(|p| !p.is_finite()) {
        Some(index) => Err(IsoError::NotFinite { what: format!("poses of {what}"), index }),
        None => Ok(()),
    }
}
