//! Clauses 8.2 to 8.4: path accuracy AT and path repeatability RT.
//!
//! Both are taken on planes normal to the command path: `attained[i][j]` is the pose of cycle j on plane i,
//! `commanded[i]` the command there.

use crate::IsoError;
use crate::pose::{pose_accuracy, pose_repeatability};
use crate::stats::largest;
use crate::tip_pose::TipPose;
use nalgebra::Vector3;

/// A path characteristic: the largest over all planes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OverPath {
    /// Of the position: `AT_P` or `RT_P` [m].
    pub position_m: f64,
    /// Of the angles: `AT_a, AT_b, AT_c` or `RT_a, RT_b, RT_c` [rad].
    pub angles_rad: Option<Vector3<f64>>,
}

/// Path accuracy: `AT_P = max_i |mean_j x_ij - x_ci|` and `AT_a = max_i |mean_j a_ij - a_ci|` (ISO 9283:1998, 8.2;
/// its position part, on a path along which the orientation changes, is 8.4).
///
/// Fails without a plane, with a plane without cycles, or where a pose is not finite.
pub fn path_accuracy(commanded: &[TipPose], attained: &[Vec<TipPose>]) -> Result<OverPath, IsoError> {
    const WHAT: &str = "path accuracy";
    if commanded.len() != attained.len() {
        return Err(IsoError::Uneven {
            what: "commanded and attained planes",
            left: commanded.len(),
            right: attained.len(),
        });
    }
    let planes: Result<Vec<_>, _> =
        commanded.iter().zip(attained).map(|(command, poses)| pose_accuracy(command, poses)).collect();
    over(WHAT, &planes?.iter().map(|ap| (ap.position_m, ap.angles_rad)).collect::<Vec<_>>())
}

/// Path repeatability: `RT_P = max_i (l_mean_i + 3 S_li)` and `RT_a = max_i 3 S_ai` (ISO 9283:1998, 8.3).
///
/// Fails without a plane, with a plane of fewer than two cycles, or where a pose is not finite.
pub fn path_repeatability(attained: &[Vec<TipPose>]) -> Result<OverPath, IsoError> {
    const WHAT: &str = "path repeatability";
    let planes: Result<Vec<_>, _> = attained.iter().map(|poses| pose_repeatability(poses)).collect();
    over(WHAT, &planes?.iter().map(|rp| (rp.radius_m, rp.angles_rad)).collect::<Vec<_>>())
}

fn over(what: &'static str, planes: &[(f64, Option<Vector3<f64>>)]) -> Result<OverPath, IsoError> {
    if planes.is_empty() {
        return Err(IsoError::TooFew { what, of: "measuring planes", needed: 1, given: 0 });
    }
    let turns_rad: Option<Vec<Vector3<f64>>> = planes.iter().map(|plane| plane.1).collect();
    Ok(OverPath {
        position_m: largest(planes.iter().map(|plane| plane.0)),
        angles_rad: turns_rad
            .map(|turns| Vector3::from_fn(|axis, _| largest(turns.iter().map(|t| t[axis].abs())))),
    })
}
