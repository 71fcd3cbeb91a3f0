//! What contradicts itself without any refit: bodies that move or stand still where they should not, a joint that never
//! moves, tilts that are not the declared ones, frames far from their declaration, set-points read as readings.

use super::trial::Inputs;
use crate::stages::perceive::Seen;
use crate::story::Fitted;
use armcal_core::{Certainty, Dwell, Pose, Role, SetupFinding};
use armcal_dwell::MeanPose;
use armcal_table::Tilt;

/// The tip's path is long against this where an arm moves, and short where something else was tracked [m].
const MOVES_M: f64 = 0.05;
const STANDS_M: f64 = 0.005;
/// A joint that moved less than this over all dwells did not move [rad].
const STUCK_RAD: f64 = 2e-4;
/// Fewest dwells in a row that make a joint stuck.
const MANY_STILL: usize = 8;
/// A joint that turned by this much did move [rad].
const TURNS_RAD: f64 = 0.1;
/// Tilts differ from their declaration by less than this, with the mechanism as it is [rad].
const TILT_RAD: f64 = 0.07;
/// A frame this many standard errors from where it was measured to be contradicts its declaration, if it is off by as
/// much as this too [m], [rad].
const SIGMAS: f64 = 8.0;
const OFF: f64 = 5e-3;
/// Errors below this many times the floor say that nothing of importance is wrong.
const SOUND: f64 = 1.5;

/// Everything that can be looked at directly; tilts and frames only where no other mistake was found.
pub fn facts(inputs: &Inputs, fitted: &Fitted, alone: bool) -> Vec<SetupFinding> {
    let mut all = streams(inputs);
    // Poses that are fitted to errors say nothing of tilts and frames.
    let sound = fitted.calibration.times_floor() <= SOUND;
    if alone && sound {
        all.extend(tilts(inputs, fitted));
        all.extend(declared_frames(fitted));
    }
    if !sound {
        all.extend(stuck(inputs));
        all.extend(no_quaternion(inputs));
    }
    all
}

/// Orientations that are exactly the identity in every recording: the field was never filled in.
fn no_quaternion(inputs: &Inputs) -> Vec<SetupFinding> {
    let unturned = |angle_rad: f64| angle_rad < 1e-12;
    let body = |of: fn(&Seen) -> &Option<MeanPose>| {
        let mut poses = inputs.seen.iter().filter_map(|s| of(s).as_ref()).peekable();
        poses.peek().is_some() && poses.all(|p| unturned(p.pose.rotation.angle()))
    };
    let mut turns = inputs.dwells().filter_map(|d| d.tip.as_ref()?.orientation).peekable();
    let of_tip = inputs.pipeline.fit.use_orientation && turns.peek().is_some();
    let tip = of_tip && turns.all(|q| unturned(q.angle()));
    let bodies = [("base", body(|s| &s.base)), ("table", body(|s| &s.table)), ("tip", tip)];
    bodies
        .into_iter()
        .filter(|(_, missing)| *missing)
        .map(|(role, _)| {
            mistake(
                "quaternion-missing",
                format!("the {role}"),
                format!(
                    "the orientation of the {role} is exactly the identity in every recording: its quaternion is not filled \
                     in; mend what publishes [streams.{role}]"
                ),
            )
        })
        .collect()
}

/// Streams whose motion is not that of what they are said to be.
pub fn streams(inputs: &Inputs) -> Vec<SetupFinding> {
    let mut all = Vec::new();
    for seen in &inputs.seen {
        let tips: Vec<_> = seen.dwells.iter().filter_map(|d| d.tip.as_ref().map(|t| t.position_m)).collect();
        let Some(first) = tips.first() else { continue };
        let tip_m = tips.iter().map(|t| (t - first).norm()).fold(0.0, f64::max);
        let moved = |d: &Dwell| {
            let joints = d.joint_rad.iter().zip(&seen.dwells[0].joint_rad);
            joints.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let turned_rad = seen.dwells.iter().map(moved).fold(0.0, f64::max);
        if tips.len() > 2 && tip_m < STANDS_M && turned_rad > TURNS_RAD {
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
    let others_move = ranges.iter().any(|r| *r > TURNS_RAD);
    let mut all = Vec::new();
    for (j, name) in names.iter().enumerate().filter(|_| others_move) {
        let still = inputs.seen.iter().map(|s| (s, longest_still(&s.dwells, j)));
        let Some((recording, still)) = still.max_by_key(|(_, n)| *n) else { continue };
        if still < MANY_STILL.max(recording.dwells.len() / 4) {
            continue;
        }
        all.push(mistake(
            "joint-stuck",
            format!("joint {} ({name})", j + 1),
            format!(
                "joint {} ({name}) reads the same in {still} dwells in a row of `{}` (of {}) while others move, and the \
                 errors are above the floor: its reading is stuck, or read from the wrong field; mend the stream of the \
                 joints or the driver",
                j + 1,
                recording.name,
                recording.dwells.len()
            ),
        ));
    }
    all
}

/// The most dwells in a row in which a joint reads the same while another one turns.
fn longest_still(dwells: &[Dwell], joint: usize) -> usize {
    let (mut longest, mut from) = (0, 0);
    for i in 1..=dwells.len() {
        let first = &dwells[from];
        let same = |d: &Dwell| (d.joint_rad[joint] - first.joint_rad[joint]).abs() < STUCK_RAD;
        if dwells.get(i).is_some_and(same) {
            continue;
        }
        let turned = |d: &Dwell| {
            let pairs = d.joint_rad.iter().zip(&first.joint_rad);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        if dwells[from..i].iter().map(turned).fold(0.0, f64::max) > TURNS_RAD {
            longest = longest.max(i - from);
        }
        from = i;
    }
    longest
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
