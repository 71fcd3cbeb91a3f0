//! What two arms whose tips are joined must do so that each calibrates the other: move, in enough poses, far enough apart.

use super::joined::check_moves;
use super::pipeline::{ClosedChainSection, ClosureKind};
use crate::error::Error;
use armcal_core::{FeatureId, Observation, Parameter, Role};
use armcal_model::Model;
use nalgebra::Vector3;

/// An arm none of whose joints moves by as much is not led through poses [rad]: 1 deg.
const LEAST_MOTION_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// Tips that are spread over less than this share of their distance from the base are not led through poses: whatever is wrong with
/// the arms, they close.
const LEAST_SPREAD: f64 = 0.03;

/// Refuses an arm that never moves. A single arm is none of these.
pub fn both_move(geometry: &Model, dwells: &[Observation]) -> Result<(), Error> {
    let of = |joints: std::ops::Range<usize>| dwells.iter().map(move |o| &o.joint_rad[joints.clone()]);
    let mut arms = geometry.chain().arms().iter();
    arms.try_for_each(|arm| check_moves(&arm.name, of(arm.joints.clone()), LEAST_MOTION_RAD))
}

/// Three points place a base, six distances do; twice as many also show which dwells do not belong. A pose held twice
/// counts once. `dwells` is how many there are in all.
pub fn enough(closure: &ClosedChainSection, joined: &[Observation], dwells: usize) -> Result<(), Error> {
    let least = match closure.kind {
        ClosureKind::SamePoint => 6,
        ClosureKind::RigidLink => 12,
    };
    let poses = different_poses(joined);
    if poses >= least {
        return Ok(());
    }
    let problem = format!(
        "{} of {dwells} dwells of both arms have their tips within {:.0} mm of closing, in {poses} different poses; {least} are \
         the least that place one arm against the other and show which dwells do not belong: record more poses with the \
         tips joined, or check joint names, signs and units, arms.base, closed_chain.length_mm and closed_chain.max_gap_mm",
        joined.len(),
        closure.max_gap_mm
    );
    Err(Error::TwoArms { problem })
}

/// Refuses arms whose tips hardly move: readings in another unit close as well as any.
pub fn spread(geometry: &Model, joined: &[Observation]) -> Result<(), Error> {
    let p = geometry.nominal();
    for (at, arm) in geometry.chain().arms().iter().enumerate() {
        let tip_m =
            |o: &Observation| geometry.feature_in_base(&p, FeatureId(at), &o.joint_rad).translation.vector;
        let tips_m: Vec<Vector3<f64>> = joined.iter().map(tip_m).collect();
        let mean_m = tips_m.iter().sum::<Vector3<f64>>() / tips_m.len() as f64;
        let square = tips_m.iter().map(|m| (m - mean_m).norm_squared()).sum::<f64>() / tips_m.len() as f64;
        let reach_m = tips_m.iter().map(|m| m.norm()).fold(0.0, f64::max);
        if square.sqrt() < LEAST_SPREAD * reach_m {
            let problem = format!(
                "the tip of the {} arm is within {:.1} mm of one point in all joined dwells, {:.0} mm from its base: lead both arms \
                 through poses that differ more, or check the unit of its readings",
                arm.name,
                square.sqrt() * 1e3,
                reach_m * 1e3
            );
            return Err(Error::TwoArms { problem });
        }
    }
    Ok(())
}

/// Lets every estimated base start where it was aligned.
pub fn place_bases(geometry: &mut Model, aligned: &[f64]) {
    let names: Vec<String> =
        geometry.chain().arms().iter().map(|arm| format!("{}.base.", arm.name)).collect();
    for (arm, name) in names.iter().enumerate() {
        let estimated = |p: &Parameter| p.free && p.role == Role::EstimatedFrame && p.name.starts_with(name);
        if geometry.parameters().iter().any(estimated) {
            let base = geometry.arm_base_in_world(aligned, arm);
            geometry.set_arm_base_start(arm, base);
        }
    }
}

/// Poses that differ from all earlier ones by [`LEAST_MOTION_RAD`] in some joint.
fn different_poses(joined: &[Observation]) -> usize {
    let mut poses: Vec<&[f64]> = Vec::new();
    for q in joined.iter().map(|o| o.joint_rad.as_slice()) {
        let same = |pose: &&[f64]| pose.iter().zip(q).all(|(a, b)| (a - b).abs() < LEAST_MOTION_RAD);
        if !poses.iter().any(same) {
            poses.push(q);
        }
    }
    poses.len()
}
