//! Clauses 8.2 to 8.4: path accuracy AT and path repeatability RT.
//!
//! Both are taken on planes normal to the command path: `attained[i][j]` is the pose of cycle j on plane i,
//! `commanded[i]` the command there.

use crate::IsoError;
use crate::error::at_least;
use crate::pose::{Deviation, pose_accuracy, pose_repeatability};
use crate::tip_pose::TipPose;

/// Path accuracy: `AT_P = max_i |mean_j x_ij - x_ci|` and `AT_a = max_i |mean_j a_ij - a_ci|` (ISO 9283:1998, 8.2;
/// its position part, on a path along which the orientation changes, is 8.4).
///
/// Fails without a plane, with a plane without cycles, or where a pose is not finite.
pub fn path_accuracy(commanded: &[TipPose], attained: &[Vec<TipPose>]) -> Result<Deviation, IsoError> {
    if commanded.len() != attained.len() {
        return Err(IsoError::Uneven {
            what: "commanded and attained planes",
            left: commanded.len(),
            right: attained.len(),
        });
    }
    let planes = commanded.iter().zip(attained).map(|(command, poses)| pose_accuracy(command, poses));
    largest_over_planes("path accuracy", planes.map(|ap| Ok(ap?.deviation())).collect::<Result<_, _>>()?)
}

/// Path repeatability: `RT_P = max_i (l_mean_i + 3 S_li)` and `RT_a = max_i 3 S_ai` (ISO 9283:1998, 8.3).
///
/// Fails without a plane, with a plane of fewer than two cycles, or where a pose is not finite.
pub fn path_repeatability(attained: &[Vec<TipPose>]) -> Result<Deviation, IsoError> {
    let planes = attained.iter().map(|poses| Ok(pose_repeatability(poses)?.deviation()));
    largest_over_planes("path repeatability", planes.collect::<Result<_, _>>()?)
}

/// The largest over all planes.
fn largest_over_planes(what: &'static str, planes: Vec<Deviation>) -> Result<Deviation, IsoError> {
    at_least(1, "measuring planes", planes.len(), what)?;
    Ok(Deviation::largest(&planes))
}
