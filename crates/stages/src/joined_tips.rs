//! What joined tips must do so that each calibrates the other: move, in enough poses, far enough apart.

use crate::RunError;
use armcal_config::{ClosedChainSection, ClosureKind};
use armcal_core::{FeatureId, Observation, Role};
use armcal_model::Model;
use nalgebra::Vector3;

/// An arm none of whose joints moves by as much is not led through poses [rad]: 1 deg.
const LEAST_MOTION_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// Tips that are spread over less than this share of their distance from the base are not led through poses: whatever is wrong with
/// the arms, they close.
const LEAST_SPREAD: f64 = 0.03;

/// What is at one of the points: an arm, or a branch.
fn end_name(model: &Model, joins: [FeatureId; 2], end: usize) -> String {
    let arm = model.chain().arms().get(end).map(|arm| format!("the {} arm", arm.name));
    arm.unwrap_or_else(|| format!("what carries {}", model.feature_name(joins[end])))
}

/// Refuses joints at one end that are held in one pose throughout: nothing can be learnt of them.
pub fn both_move(model: &Model, joins: [FeatureId; 2], dwells: &[Observation]) -> Result<(), RunError> {
    for end in 0..2 {
        let [own, other] = [end, 1 - end].map(|k| model.joints_to(joins[k]));
        let range = |joint: &usize| {
            let of = dwells.iter().map(|o| o.joint_rad[*joint]);
            of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
        };
        let own = own.iter().filter(|joint| !other.contains(joint));
        let widest_rad = own.map(range).fold(0.0, f64::max);
        if dwells.len() < 2 || widest_rad >= LEAST_MOTION_RAD {
            continue;
        }
        let problem = format!(
            "{} never moves: over {} dwells none of its joints changes by more than {:.3} deg; lead both through many poses, or \
             check its topic and joint names",
            end_name(model, joins, end),
            dwells.len(),
            widest_rad.to_degrees()
        );
        return Err(RunError::TwoArms { problem });
    }
    Ok(())
}

/// Refuses tips that hardly move: readings in another unit close as well as any.
pub fn check_spread(model: &Model, joins: [FeatureId; 2], joined: &[Observation]) -> Result<(), RunError> {
    let p = model.nominal();
    for end in 0..2 {
        let tip_m = |o: &Observation| model.feature_in_base(&p, joins[end], &o.joint_rad).translation.vector;
        let tips_m: Vec<Vector3<f64>> = joined.iter().map(tip_m).collect();
        let mean_m = tips_m.iter().sum::<Vector3<f64>>() / tips_m.len() as f64;
        let square = tips_m.iter().map(|m| (m - mean_m).norm_squared()).sum::<f64>() / tips_m.len() as f64;
        let reach_m = tips_m.iter().map(|m| m.norm()).fold(0.0, f64::max);
        if square.sqrt() < LEAST_SPREAD * reach_m {
            let problem = format!(
                "the tip of {} is within {:.1} mm of one point in all joined dwells, {:.0} mm from its base: lead both through \
                 poses that differ more, or check the unit of its readings",
                end_name(model, joins, end),
                square.sqrt() * 1e3,
                reach_m * 1e3
            );
            return Err(RunError::TwoArms { problem });
        }
    }
    Ok(())
}

/// Three points place a base, six distances do; twice as many also show which dwells do not belong. A pose held twice
/// counts once. `dwells` is how many there are in all; `base` says whether each arm has its own.
pub fn check_pose_count(
    closure: &ClosedChainSection,
    joined: &[Observation],
    (dwells, bases): (usize, bool),
) -> Result<(), RunError> {
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
         tips joined, or check joint names, signs and units, {}closed_chain.length_mm and closed_chain.max_gap_mm",
        joined.len(),
        closure.max_gap_mm,
        if bases { "arms.base, " } else { "" },
    );
    Err(RunError::TwoArms { problem })
}

/// Lets every estimated base start where it was aligned.
pub fn place_bases(geometry: &mut Model, aligned: &[f64]) {
    for arm in 0..geometry.chain().bases() {
        let own = &geometry.parameters()[geometry.base_parameters(arm)];
        if own.iter().any(|p| p.free && p.role == Role::EstimatedFrame) {
            let base = geometry.arm_base_in_world(aligned, arm);
            geometry.set_base_start(arm, base);
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
