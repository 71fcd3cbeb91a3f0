//! On a path, a joint that turns back is given time to cross its gap.
//!
//! Solved point by point, its set-point leaps by the width of the gap from one point to the next, and a servo swings
//! beyond a leap by part of it, which the link keeps. But a link hardly moves where it turns back: so the leap is spread
//! over a while around that moment, as a minimum-jerk move (Flash and Hogan 1985). The link then stops and starts by
//! `a T^2 / 8` off its way, `a` its acceleration, `T` the time to cross.

use crate::set_point::SetPoint;

/// A set-point that leaps by this much more than the nominal one crosses a gap [rad] (sliding: [m]).
const LEAP_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// By how much a joint moves more than the nominal one from one point of a path to the next [rad], where that is a leap.
pub(crate) fn leap_rad(last: [f64; 2], next: [f64; 2]) -> Option<f64> {
    let [(nominal, joint), (next_nominal, next_joint)] = [(last[0], last[1]), (next[0], next[1])];
    let more = (next_joint - joint) - (next_nominal - nominal);
    (more.abs() > LEAP_RAD).then_some(more)
}

/// Spreads every leap between points with times over `crossing_s`, and marks the points inside. Returns whether there was any.
pub(crate) fn spread_leaps(points: &mut [SetPoint], crossing_s: f64) -> bool {
    let leaps = find_leaps(points);
    let first_s = points.first().and_then(|p| p.target.time_s).unwrap_or(0.0);
    for (index, joint, size) in &leaps {
        let time = |i: usize| points[i].target.time_s.unwrap_or(0.0);
        let turn_s = (time(index - 1) + time(*index)) / 2.0;
        let from_s = (turn_s - crossing_s / 2.0).max(first_s);
        for (i, point) in points.iter_mut().enumerate() {
            let Some(time_s) = point.target.time_s else { continue };
            let leapt = if i < *index { 0.0 } else { *size };
            let share = (time_s - from_s) / crossing_s;
            point.joint_rad[*joint] += size * minimum_jerk(share) - leapt;
            if share > 0.0 && share < 1.0 && !point.in_gap.contains(joint) {
                point.in_gap.push(*joint);
            }
        }
    }
    !leaps.is_empty()
}

/// Point, joint, size [rad] of every leap.
fn find_leaps(points: &[SetPoint]) -> Vec<(usize, usize, f64)> {
    let mut all = Vec::new();
    for (i, pair) in points.windows(2).enumerate() {
        if pair[0].target.time_s.is_none() || pair[1].target.time_s.is_none() {
            continue;
        }
        let at = |p: &SetPoint, j: usize| [p.nominal_rad[j], p.joint_rad[j]];
        let joints = 0..pair[0].joint_rad.len();
        all.extend(joints.filter_map(|j| Some((i + 1, j, leap_rad(at(&pair[0], j), at(&pair[1], j))?))));
    }
    all
}

fn minimum_jerk(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}
