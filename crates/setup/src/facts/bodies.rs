//! Base, table and tip: do they move and turn as what they are said to be?

use super::{mistake_finding, possible_finding};
use crate::beyond::pose_distance;
use armcal_core::{Code, Dwell, SetupFinding};
use armcal_dwell::MeanPose;
use armcal_stages::still::still_tip;
use armcal_stages::{Inputs, RecordingData};

/// The tip's path is long against this where an arm moves [m].
const MOVES_M: f64 = 0.05;
/// Two bodies nearer to each other than this are one [m], [rad].
const SAME_M: f64 = 1e-3;
const SAME_RAD: f64 = 5e-3;

/// Orientations that are exactly the identity in every recording: where the position beside them was measured, the field was
/// never filled in. A base or table that is published as a constant may stand so.
pub fn no_quaternion(inputs: &Inputs) -> Vec<SetupFinding> {
    let unturned = |angle_rad: f64| angle_rad < 1e-12;
    let body = |of: fn(&RecordingData) -> &Option<MeanPose>| {
        let mut poses = inputs.seen.iter().filter_map(|s| of(s).as_ref()).peekable();
        poses.peek().is_some() && poses.all(|p| p.has_orientation && unturned(p.pose.rotation.angle()))
    };
    let mut turns = inputs.dwells().filter_map(|d| d.tip.as_ref()?.orientation).peekable();
    let of_tip = inputs.pipeline.fit.use_orientation && turns.peek().is_some();
    let tip = of_tip && turns.all(|q| unturned(q.angle()));
    let measured = |role: &str| {
        let travels_m = inputs.seen.iter().flat_map(|s| &s.travels_m);
        role == "tip" || travels_m.into_iter().any(|(of, travel_m)| *of == role && *travel_m > 0.0)
    };
    let bodies = [("base", body(|s| &s.base)), ("table", body(|s| &s.table)), ("tip", tip)];
    let missing = bodies.into_iter().filter(|(_, missing)| *missing);
    missing
        .map(|(role, _)| {
            let seen = format!("the orientation of the {role} is exactly the identity in every recording");
            let subject = format!("the {role}");
            match measured(role) {
                true => mistake_finding(
                    Code::QuaternionMissing,
                    subject,
                    format!("{seen}: its quaternion is not filled in; mend what publishes [streams.{role}]"),
                ),
                false => possible_finding(
                    Code::QuaternionMissing,
                    subject,
                    format!(
                        "{seen}, and its position never varies: it stands so, or what publishes [streams.{role}] does not \
                         fill in its quaternion"
                    ),
                ),
            }
        })
        .collect()
}

/// Streams whose motion is not that of what they are said to be.
pub fn swapped_streams(inputs: &Inputs) -> Vec<SetupFinding> {
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
        if let Some(message) = still_tip(tip_m, turned_rad).filter(|_| tips.len() > 2) {
            all.push(mistake_finding(Code::StreamsSwapped, format!("recording `{}`", seen.name), message));
        }
        for (role, travel_m) in &seen.travels_m {
            if *travel_m > MOVES_M {
                all.push(mistake_finding(
                    Code::StreamsSwapped,
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
pub fn same_body(inputs: &Inputs) -> Option<SetupFinding> {
    let of = |s: &RecordingData| Some(pose_distance(&s.base.as_ref()?.pose, &s.table.as_ref()?.pose));
    let all: Option<Vec<(f64, f64)>> = inputs.seen.iter().map(of).collect();
    let all =
        all.filter(|all| !all.is_empty() && all.iter().all(|(m, rad)| *m < SAME_M && *rad < SAME_RAD))?;
    let apart_mm = all.iter().map(|(m, _)| m * 1e3).fold(0.0, f64::max);
    Some(mistake_finding(
        Code::StreamsEqual,
        "base and table".to_owned(),
        format!(
            "the bodies read as base and as table are the same body: their poses differ by {apart_mm:.3} mm at most; mend \
             [streams.base] or [streams.table]"
        ),
    ))
}
