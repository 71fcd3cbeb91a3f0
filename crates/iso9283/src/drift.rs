//! Clause 7.6: how poses change with time (dAP, dRP).

use crate::IsoError;
use crate::error::at_least;
use crate::pose::{Deviation, pose_accuracy, pose_repeatability};
use crate::tip_pose::TipPose;

/// Drift of pose accuracy `dAP = max_T |AP(t = 0) - AP(t = T)|`, for the position and each angle (ISO 9283:1998,
/// 7.6). `blocks[k]` are the poses attained about time k, ten cycles each in the standard.
///
/// Fails with fewer than two blocks, with an empty block, or where a pose is not finite.
pub fn accuracy_drift(commanded: &TipPose, blocks: &[Vec<TipPose>]) -> Result<Deviation, IsoError> {
    let accuracies = blocks.iter().map(|block| Ok(pose_accuracy(commanded, block)?.deviation()));
    largest_change("drift of pose accuracy", &accuracies.collect::<Result<Vec<_>, _>>()?)
}

/// Drift of pose repeatability `dRP = max_T |RP(t = 0) - RP(t = T)|`, for the position and each angle (ISO
/// 9283:1998, 7.6).
///
/// Fails with fewer than two blocks, with a block of fewer than two poses, or where a pose is not finite.
pub fn repeatability_drift(blocks: &[Vec<TipPose>]) -> Result<Deviation, IsoError> {
    let repeatabilities = blocks.iter().map(|block| Ok(pose_repeatability(block)?.deviation()));
    largest_change("drift of pose repeatability", &repeatabilities.collect::<Result<Vec<_>, _>>()?)
}

/// From the first block of cycles to any later one.
fn largest_change(what: &'static str, blocks: &[Deviation]) -> Result<Deviation, IsoError> {
    at_least(2, "blocks of cycles", blocks.len(), what)?;
    let change = |block: &Deviation| Deviation {
        position_m: (block.position_m - blocks[0].position_m).abs(),
        angles_rad: block.angles_rad.zip(blocks[0].angles_rad).map(|(angles, first)| angles - first),
    };
    Ok(Deviation::largest(&blocks[1..].iter().map(change).collect::<Vec<_>>()))
}
