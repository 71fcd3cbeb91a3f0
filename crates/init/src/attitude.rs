//! Are positions and orientations of a body published in the same axes? Where it is on its link, its orientation there is one, but
//! only in axes in which both were measured.

use super::arm::Arm;
use super::evidence::Evidence;
use super::read::AllRead;
use armcal_core::robust::median;
use armcal_core::{axis_turns, in_axes};
use nalgebra::{Matrix3, UnitQuaternion};

/// Orientations that are off by more are in other axes; those that are off by less are in the same [rad].
const OTHER_RAD: f64 = 0.35;
const SAME_RAD: f64 = 0.1;
/// Fewer pauses say nothing, and a body further off its link, as a share of how far it moves, is on none.
const FEWEST: usize = 6;
const ON_LINK: f64 = 0.25;

/// The bodies whose orientation is in other axes than their position, by number, and what turns it into the same.
pub fn other_axes(arm: &Arm, read: &AllRead, evidence: &[Evidence]) -> Vec<(usize, Matrix3<f64>)> {
    let turn = |(body, own): (usize, &Evidence)| {
        let link = own.best_link().filter(|link| link.share < ON_LINK)?.link;
        let (recording, placed) = own.placed(link).next()?;
        let pauses = &own.recordings.get(recording)?.as_ref()?.pauses;
        let seen = pauses.iter().filter_map(|pause| {
            let joint_rad = &read.recordings[recording].dwells[pause.dwell].joint_rad;
            Some((placed.base.rotation * arm.poses(joint_rad)[link].rotation, pause.turned?))
        });
        let seen: Vec<(UnitQuaternion<f64>, UnitQuaternion<f64>)> = seen.collect();
        if seen.len() < FEWEST {
            return None;
        }
        let all: Vec<(f64, Matrix3<f64>)> =
            axis_turns().into_iter().map(|t| (off_rad(&seen, &t), t)).collect();
        let (least_rad, turn) = all.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))?;
        (all[0].0 > OTHER_RAD && least_rad < SAME_RAD).then_some((body, turn))
    };
    evidence.iter().enumerate().filter_map(turn).collect()
}

/// Half of the angles by which a body is turned on its link otherwise than in the first pause, where it is seen in turned axes [rad].
fn off_rad(seen: &[(UnitQuaternion<f64>, UnitQuaternion<f64>)], turn: &Matrix3<f64>) -> f64 {
    let on_link =
        |(link, seen): &(UnitQuaternion<f64>, UnitQuaternion<f64>)| link.inverse() * in_axes(turn, seen);
    let first = on_link(&seen[0]);
    median(&seen[1..].iter().map(|pair| on_link(pair).angle_to(&first)).collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orientation_in_other_axes_fits_only_in_those() {
        let link = |i: f64| UnitQuaternion::from_euler_angles(0.3 * i, (0.9 * i).sin(), 0.5 * i);
        let on_link = UnitQuaternion::from_euler_angles(0.2, -0.4, 1.0);
        let turns = axis_turns();
        assert_eq!((turns.len(), turns[0]), (24, Matrix3::identity()));
        for wrong in [0, 5, 17] {
            // What is published is turned back by the turn.
            let back = turns[wrong].transpose();
            let published = |i: f64| {
                let turned = back * (link(i) * on_link).to_rotation_matrix().matrix() * back.transpose();
                UnitQuaternion::from_matrix(&turned)
            };
            let seen: Vec<_> = (0..12).map(f64::from).map(|i| (link(i), published(i))).collect();
            let off: Vec<f64> = turns.iter().map(|turn| off_rad(&seen, turn)).collect();
            assert!(off[wrong] < 1e-6, "{wrong}: {off:?}");
            assert!(off.iter().enumerate().all(|(k, off)| k == wrong || *off > SAME_RAD), "{wrong}: {off:?}");
        }
    }
}
