//! Clauses 7.6 and 7.7: how poses change with time (dAP, dRP), and from robot to robot (E).

use crate::IsoError;
use crate::pose::{pose_accuracy, pose_repeatability};
use crate::stats::largest;
use crate::tip_pose::{TipPose, barycentre, check};
use nalgebra::Vector3;

/// A drift: the largest change from the first block of cycles to any later one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Of the position [m].
    pub position_m: f64,
    /// Of the angles about x, y, z [rad].
    pub angles_rad: Option<Vector3<f64>>,
}

/// Drift of pose accuracy `dAP = max_T |AP(t = 0) - AP(t = T)|`, for the position and each angle (ISO 9283:1998,
/// 7.6). `blocks[k]` are the poses attained about time k, ten cycles each in the standard.
///
/// Fails with fewer than two blocks, with an empty block, or where a pose is not finite.
pub fn accuracy_drift(commanded: &TipPose, blocks: &[Vec<TipPose>]) -> Result<Drift, IsoError> {
    let values = blocks.iter().map(|block| pose_accuracy(commanded, block)).collect::<Result<Vec<_>, _>>()?;
    let values: Vec<_> = values.iter().map(|ap| (ap.position_m, ap.angles_rad)).collect();
    largest_change("drift of pose accuracy", &values)
}

/// Drift of pose repeatability `dRP = max_T |RP(t = 0) - RP(t = T)|`, for the position and each angle (ISO
/// 9283:1998, 7.6).
///
/// Fails with fewer than two blocks, with a block of fewer than two poses, or where a pose is not finite.
pub fn repeatability_drift(blocks: &[Vec<TipPose>]) -> Result<Drift, IsoError> {
    let values = blocks.iter().map(|block| pose_repeatability(block)).collect::<Result<Vec<_>, _>>()?;
    let values: Vec<_> = values.iter().map(|rp| (rp.radius_m, rp.angles_rad)).collect();
    largest_change("drift of pose repeatability", &values)
}

fn largest_change(what: &'static str, values: &[(f64, Option<Vector3<f64>>)]) -> Result<Drift, IsoError> {
    let [first, later @ ..] = values else {
        return Err(IsoError::TooFew { what, of: "blocks of cycles", needed: 2, given: 0 });
    };
    if later.is_empty() {
        return Err(IsoError::TooFew { what, of: "blocks of cycles", needed: 2, given: 1 });
    }
    let turns_rad = first.1.zip(later.iter().map(|value| value.1).collect::<Option<Vec<_>>>());
    Ok(Drift {
        position_m: largest(later.iter().map(|value| (value.0 - first.0).abs())),
        angles_rad: turns_rad.map(|(first, later)| {
            Vector3::from_fn(|axis, _| largest(later.iter().map(|value| (value[axis] - first[axis]).abs())))
        }),
    })
}

/// Exchangeability E [m]: the largest distance between the barycentres that two robots of one kind attain for the
/// same command in the same programme (ISO 9283:1998, 7.7; it asks for five robots). `robots[h]` are the poses that
/// robot h attained.
///
/// Fails with fewer than two robots, with a robot without poses, or where a pose is not finite.
pub fn exchangeability_m(robots: &[Vec<TipPose>]) -> Result<f64, IsoError> {
    const WHAT: &str = "exchangeability";
    if robots.len() < 2 {
        return Err(IsoError::TooFew {
            what: WHAT,
            of: "robots of one kind",
            needed: 2,
            given: robots.len(),
        });
    }
    robots.iter().try_for_each(|poses| check(WHAT, poses, 1))?;
    let centres_m: Vec<Vector3<f64>> = robots.iter().map(|poses| barycentre(poses).position_m).collect();
    let pairs = centres_m.iter().enumerate().flat_map(|(h, a)| centres_m[..h].iter().map(move |b| (a, b)));
    Ok(largest(pairs.map(|(a, b)| (a - b).norm())))
}
