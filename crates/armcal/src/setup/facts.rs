//! What contradicts itself without any refit: bodies that move or stand still where they should not, a joint that never
//! moves, tilts that are not the declared ones, frames far from their declaration, set-points read as readings.

use super::trial::Inputs;
use crate::story::Fitted;
use armcal_core::{Certainty, Pose, Role, SetupFinding};
use armcal_table::Tilt;

/// The tip's path is long against this where an arm moves, and short where something else was tracked [m].
const MOVES_M: f64 = 0.05;
const STANDS_M: f64 = 0.005;
/// A joint that moved less than this over all dwells did not move [rad].
const STUCK_RAD: f64 = 2e-4;
/// Tilts differ from their declaration by less than this, with the mechanism as it is [rad].
const TILT_RAD: f64 = 0.05;
/// A frame this many standard errors from where it was measured to be contradicts its declaration, if it is off by as
/// much as this too [m], [rad].
const SIGMAS: f64 = 8.0;
const OFF: f64 = 5e-3;
/// Errors below this many times the floor say that nothing of importance is wrong.
const SOUND: f64 = 2.0;

/// Everything that can be looked at directly; tilts and frames only where no other mistake was found.
pub fn facts(inputs: &Inputs, fitted: &Fitted, alone: bool) -> Vec<SetupFinding> {
    let mut all = streams(inputs);
    if alone {
        all.extend(tilts(inputs, fitted));
        all.extend(declared_frames(fitted));
    }
    if fitted.calibration.times_floor() > SOUND {
        all.extend(stuck(inputs));
    }
    all
}

/// Streams whose motion is not that of what they are said to be.
pub fn streams(inputs: &Inputs) -> Vec<SetupFinding> {
    let mut all = Vec::new();
    for seen in &inputs.seen {
        let tips: Vec<_> = seen.dwells.iter().filter_map(|d| d.tip.as_ref().map(|t| t.position_m)).collect();
        let Some(first) = tips.first() else { continue };
        let tip_m = tips.iter().map(|t| (t - first).norm()).fold(0.0, f64::max);
        let moved = |d: &armcal_core::Dwell| {
            let joints = d.joint_rad.iter().zip(&seen.dwells[0].joint_rad);
            joints.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let turned_rad = seen.dwells.iter().map(moved).fold(0.0, f64::max);
        if tips.len() > 2 && tip_m < STANDS_M && turned_rad > 0.1 {
            all.push(mistake(
                "streams-swapped",
                format!("recording `{}`", seen.name),
                format!(
                    "the body read as the tip stood still (within {:.2} mm) while the joints turned by {:.0} deg: it is \
                     another body; mend [streams.tip]",
                    tip_m * 1e3,
                    turned_rad.to_degrees()
                ),
            ));
        }
        for (role, travel_m) in &seen.travels_m {
            if *travel_m > MOVES_M {
                all.push(mistake(
                    "streams-swapped",
                    format!("recording `{}`", seen.name),
                    format!(
                        "the body read as the {role} moved by {:.0} mm while the arm moved: a {role} stands still, so it \
                         is another body, or it was carried; mend [streams.{role}]",
                        travel_m * 1e3
                    ),
                ));
            }
        }
    }
    all
}

/// Joints that did not move while others did.
fn stuck(inputs: &Inputs) -> Vec<SetupFinding> {
    let names = inputs.chain.joint_names();
    let range = |j: usize| {
        let all = inputs.dwells().map(|d| d.joint_rad[j]);
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), q| (l.min(q), h.max(q)));
        high - low
    };
    let ranges: Vec<f64> = (0..names.len()).map(range).collect();
    let others_move = ranges.iter().any(|r| *r > 0.1);
    let stuck = (0..names.len()).filter(|&j| others_move && ranges[j] < STUCK_RAD);
    stuck
        .map(|j| {
            mistake(
                "joint-stuck",
                format!("joint {} ({})", j + 1, names[j]),
                format!(
                    "joint {} ({}) reads the same in all {} dwells (within {:.4} deg) while others move, and the errors \
                     are far above the floor: its reading is stuck, or read from the wrong field; mend [streams.joints] or \
                     the driver",
                    j + 1,
                    names[j],
                    inputs.dwells().count(),
                    ranges[j].to_degrees()
                ),
            )
        })
        .collect()
}

/// Declared tilts against the board's poses: between two recordings the board turns as its tilts say.
fn tilts(inputs: &Inputs, fitted: &Fitted) -> Vec<SetupFinding> {
    let Some(board) = &inputs.board else { return Vec::new() };
    let values = fitted.calibration.fit.values();
    let pose = |r: usize| -> Option<(Pose, Pose)> {
        let dwells = fitted.observations.iter().filter(|o| o.dwell.recording == r && o.cavity().is_some());
        if dwells.count() < 4 {
            return None;
        }
        let tilt: Tilt = inputs.pipeline.recordings[r].tilt;
        Some((board.tilted(tilt).ok()?, fitted.model.board_in_world(&values, r)?))
    };
    let poses: Vec<Option<(Pose, Pose)>> = (0..inputs.seen.len()).map(pose).collect();
    let mut all = Vec::new();
    for (r, later) in poses.iter().enumerate().skip(1) {
        let (Some((declared_a, found_a)), Some((declared_b, found_b))) = (poses[0], *later) else { continue };
        // The later normal as the earlier board sees it: free of where the board stands, and of turns about its normal.
        let normal = |a: &Pose, b: &Pose| a.rotation.inverse() * b.rotation * nalgebra::Vector3::z();
        let (declared, found) = (normal(&declared_a, &declared_b), normal(&found_a, &found_b));
        let from_upright = |n: &nalgebra::Vector3<f64>| n.angle(&nalgebra::Vector3::z());
        let (declared_rad, found_rad) = (from_upright(&declared), from_upright(&found));
        let apart_rad = declared.angle(&found);
        if apart_rad > TILT_RAD {
            let (a, b) = (&inputs.seen[0].name, &inputs.seen[r].name);
            all.push(mistake(
                "tilt-declared",
                format!("recording `{b}`"),
                format!(
                    "between `{a}` and `{b}` the board's normal turned by {:.1} deg where the declared tilts say {:.1} deg, and \
                     ended {:.1} deg from where they say; mend `tilt` of these recordings (its angles, signs, or which is \
                     roll and which is pitch)",
                    found_rad.to_degrees(),
                    declared_rad.to_degrees(),
                    apart_rad.to_degrees()
                ),
            ));
        }
    }
    all
}

/// Measured frames that the fit has moved far from their measurement.
fn declared_frames(fitted: &Fitted) -> Vec<SetupFinding> {
    let mut all = Vec::new();
    for e in &fitted.calibration.fit.estimates {
        let (Role::KnownFrame, Some(sigma)) = (e.parameter.role, e.parameter.prior_sigma) else { continue };
        let off = e.value - e.parameter.nominal;
        if off.abs() > SIGMAS * sigma && off.abs() > OFF && e.parameter.free {
            let unit = e.parameter.unit;
            all.push(SetupFinding {
                certainty: Certainty::Possible,
                ..mistake(
                    "frame-declared",
                    e.parameter.name.clone(),
                    format!(
                        "{} ends {:.2} {} from where it was measured, {:.0} times the declared standard error; measure it \
                         again, declare its true standard error, or look for what moved",
                        e.parameter.name,
                        unit.to_display(off),
                        unit.display_symbol(),
                        off.abs() / sigma
                    ),
                )
            });
        }
    }
    all
}

fn mistake(code: &'static str, subject: String, message: String) -> SetupFinding {
    let certainty = Certainty::Mistake;
    SetupFinding {
        code,
        subject,
        message,
        certainty,
        before_mm: None,
        after_mm: None,
        alternatives: Vec::new(),
    }
}
