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
/// Two bodies nearer to each other than this are one [m], [rad].
const SAME_M: f64 = 1e-3;
const SAME_RAD: f64 = 5e-3;
/// Share of the dwells that is nearly all of them.
const NEARLY_ALL: f64 = 0.9;
/// Readings nearer to each other than this are one [rad].
const EXACT_RAD: f64 = 1e-9;
/// The steps of an encoder are at most so many times finer than the nearest two readings.
const FINEST: u32 = 12;
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
    let mut all = Vec::new();
    // Poses that are fitted to errors say nothing of tilts and frames.
    let sound = fitted.calibration.times_floor() <= SOUND;
    if alone && sound {
        all.extend(tilts(inputs, fitted));
        all.extend(declared_frames(fitted));
    }
    if !sound {
        all.extend(stuck(inputs));
        all.extend(no_quaternion(inputs));
        all.extend(set_points(inputs));
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
    let mut all: Vec<SetupFinding> = same_body(inputs).into_iter().collect();
    all.extend(speeds(inputs));
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

/// Base and table that are one body in every recording.
fn same_body(inputs: &Inputs) -> Option<SetupFinding> {
    let apart = |s: &Seen| {
        let by = s.base.as_ref()?.pose.inverse() * s.table.as_ref()?.pose;
        Some((by.translation.vector.norm(), by.rotation.angle()))
    };
    let all: Option<Vec<(f64, f64)>> = inputs.seen.iter().map(apart).collect();
    let all =
        all.filter(|all| !all.is_empty() && all.iter().all(|(m, rad)| *m < SAME_M && *rad < SAME_RAD))?;
    let apart_mm = all.iter().map(|(m, _)| m * 1e3).fold(0.0, f64::max);
    Some(mistake(
        "streams-equal",
        "base and table".to_owned(),
        format!(
            "the bodies read as base and as table are the same body: their poses differ by {apart_mm:.3} mm at most; mend \
             [streams.base] or [streams.table]"
        ),
    ))
}

/// Joints that read nearly zero most of the time: speeds do, angles do not.
fn speeds(inputs: &Inputs) -> Option<SetupFinding> {
    let all = !inputs.seen.is_empty() && inputs.seen.iter().all(|s| s.readings.mostly_zero);
    all.then(|| {
        let message = "every joint reads nearly zero most of the time, and not always: these are speeds, or another field than \
                       the angles; mend [streams.joints]";
        mistake("wrong-field", "the joints".to_owned(), message.to_owned())
    })
}

/// Readings without any scatter in nearly all dwells, not on the steps of an encoder: what was asked for, not what was read.
fn set_points(inputs: &Inputs) -> Option<SetupFinding> {
    let exact: Vec<&Vec<f64>> = inputs.seen.iter().flat_map(|s| &s.readings.exact_rad).collect();
    let dwells = inputs.dwells().count();
    if exact.len() < MANY_STILL || (exact.len() as f64) < NEARLY_ALL * dwells as f64 {
        return None;
    }
    let on_steps = (0..inputs.chain.joint_names().len()).any(|j| {
        let mut read: Vec<f64> = exact.iter().map(|q| q[j]).collect();
        read.sort_by(f64::total_cmp);
        read.dedup_by(|a, b| (*a - *b).abs() < EXACT_RAD);
        read.len() < 2 || steps_of(&read)
    });
    let finding = mistake(
        "setpoints-recorded",
        "the joints".to_owned(),
        format!(
            "no joint's reading scatters in {} of {dwells} dwells, nor lies on the steps of an encoder, and the errors are above the \
             floor: these look like set-points, not readings; look at the topic in [streams.joints]",
            exact.len()
        ),
    );
    (!on_steps).then_some(SetupFinding { certainty: Certainty::Possible, ..finding })
}

/// Whether sorted readings lie on steps of one size, up to [`FINEST`] times finer than the least distance between two.
fn steps_of(sorted: &[f64]) -> bool {
    let gaps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).collect();
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    (1..=FINEST).map(|n| least / f64::from(n)).any(|step| {
        gaps.iter().all(|gap| {
            let steps = gap / step;
            (steps - steps.round()).abs() < 0.05
        })
    })
}

/// Joints that did not move while others did.
pub fn stuck(inputs: &Inputs) -> Vec<SetupFinding> {
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
                "joint {} ({name}) reads the same in {still} dwells in a row of `{}` (of {}) while others move: its reading is stuck, or read from the wrong field; mend the stream of the \
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
