//! What the joints' readings look like by themselves, before any model: leaps, zeros, readings without scatter.

use armcal_core::robust::median;
use armcal_core::{Code, Dwell, JointSamples, Severity, Stage, Warning};

/// No joint turns by this much from one reading to the next [rad].
pub const LEAP_RAD: f64 = 0.3;
/// Readings further apart in time say nothing of leaps [ns].
const NEXT_NS: i64 = 200_000_000;
/// A step so many times as large as the smaller of its neighbours is none of a joint that speeds up and slows down.
const BEYOND_NEIGHBOURS: f64 = 3.0;
/// Readings that repeat the one before them at least so often and so long [ns], and then step by more than this [rad], are
/// not read anew; so many times are no accident.
const HELD: usize = 5;
const HELD_NS: i64 = 200_000_000;
const STEP_RAD: f64 = 0.1;
const TIMES: usize = 5;
/// Stamps of which most follow each other so many times as close as even ones would come in bursts; faster than any robot
/// sends its joints [ns], they are no clock's. A recorder that is switched on for each pose makes bursts of the usual rate.
const BURST: f64 = 20.0;
const TOO_FAST_NS: f64 = 1e5;
/// Readings a dwell from which on their scatter says something.
const MANY: usize = 10;
/// A dwell whose joints read one value in this share of its readings does not scatter.
const SAME_SHARE: f64 = 0.8;
/// Speeds of an arm at rest are below this, those of one that moves above that [rad/s].
const RESTING: f64 = 0.02;
const MOVING: f64 = 0.1;

/// What a stream of joint readings looks like.
#[derive(Debug, Clone, Default)]
pub struct Readings {
    /// The reading of each joint in the dwells in which it does not scatter at all [rad].
    pub exact_rad: Vec<Vec<f64>>,
    /// Whether every joint reads nearly zero most of the time, and not always: speeds do.
    pub mostly_zero: bool,
    /// What is wrong with the stamps, in a sentence without its full stop, where something is.
    pub stamps: Option<String>,
}

impl Readings {
    /// Looks at a stream and its dwells; of its rows, `repeated` were dropped because they had the stamp of the one before.
    pub fn of(joints: &JointSamples, repeated: u64, dwells: &[Dwell]) -> Readings {
        let at_rest = |column: &Vec<f64>| {
            let sizes: Vec<f64> = column.iter().map(|q| q.abs()).collect();
            median(&sizes) < RESTING && sizes.iter().copied().fold(0.0, f64::max) > MOVING
        };
        Readings {
            exact_rad: dwells.iter().filter_map(|d| constant_reading_rad(joints, d)).collect(),
            mostly_zero: !joints.is_empty() && joints.joint_rad.iter().all(at_rest),
            stamps: stamp_problem(&joints.time_ns, repeated),
        }
    }
}

/// Stamps that repeat, or come in bursts: rounded, or of another unit than nanoseconds.
fn stamp_problem(time_ns: &[i64], repeated: u64) -> Option<String> {
    let rows = time_ns.len();
    if repeated > rows as u64 {
        return Some(format!(
            "{repeated} of {} joint messages repeat the stamp of the one before and were dropped: the stamps are rounded",
            rows as u64 + repeated
        ));
    }
    let between_ns: Vec<f64> = time_ns.windows(2).map(|w| (w[1] - w[0]) as f64).collect();
    let (middle, mean) = (median(&between_ns), between_ns.iter().sum::<f64>() / between_ns.len() as f64);
    (rows > MANY && middle < mean / BURST && middle < TOO_FAST_NS).then(|| {
        format!(
            "the stamps of the joints come in bursts, {:.3} ms apart where {:.0} ms would be even: they are of another time unit \
             or rounded",
            middle * 1e-6,
            mean * 1e-6
        )
    })
}

/// The one value that each joint reads in most of a dwell, to the last bit.
fn constant_reading_rad(joints: &JointSamples, dwell: &Dwell) -> Option<Vec<f64>> {
    let from = joints.time_ns.partition_point(|t| *t < dwell.start_ns);
    let to = joints.time_ns.partition_point(|t| *t <= dwell.end_ns);
    if to < from + MANY {
        return None;
    }
    let one = |column: &Vec<f64>| {
        let middle = column[(from + to) / 2];
        let same = column[from..to].iter().filter(|q| **q == middle).count();
        (same as f64 >= SAME_SHARE * (to - from) as f64).then_some(middle)
    };
    joints.joint_rad.iter().map(one).collect()
}

/// Joints that leap from one reading to the next. A joint that only turns fast comes to its speed, and leaves it, in steps.
pub fn leap_warnings(joints: &JointSamples, recording: &str) -> Vec<Warning> {
    let near: Vec<bool> = joints.time_ns.windows(2).map(|w| w[1] - w[0] <= NEXT_NS).collect();
    let leap = |column: &Vec<f64>| -> Vec<f64> {
        let steps: Vec<f64> = column.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        let step = |i: usize| steps.get(i).copied().unwrap_or(0.0);
        let is_leap = |i: &usize| {
            let beside = step(i.wrapping_sub(1)).min(step(i + 1));
            near[*i] && step(*i) > LEAP_RAD && step(*i) > BEYOND_NEIGHBOURS * beside
        };
        (0..steps.len()).filter(is_leap).map(step).collect()
    };
    let columns = joints.joint_rad.iter().enumerate().map(|(j, column)| (j, leap(column)));
    columns
        .filter(|(_, leaps)| !leaps.is_empty())
        .map(|(j, leaps)| {
            let name = joints.names.get(j).map_or("", String::as_str);
            let largest_deg = leaps.iter().copied().fold(0.0, f64::max).to_degrees();
            let message = format!(
                "joint {} ({name}) leaps {} times from one reading to the next, by up to {largest_deg:.1} deg: its encoder wraps, was \
                 reset, or lost readings; mend the driver, or leave out what follows",
                j + 1,
                leaps.len()
            );
            let subject = format!("recording `{recording}`");
            Warning::new(Severity::Notice, Stage::Recording, Code::JointJump, subject, message)
        })
        .collect()
}

/// Readings that are repeated while the arm moves: all joints stand still, and step to where they have come meanwhile.
pub fn stale_warning(joints: &JointSamples, recording: &str) -> Option<Warning> {
    let n = joints.time_ns.len();
    let step = |i: usize| {
        joints.joint_rad.iter().map(|column| (column[i] - column[i - 1]).abs()).fold(0.0, f64::max)
    };
    let (mut times, mut longest_ns, mut largest, mut since) = (0, 0, 0.0, 0);
    for i in 1..n {
        let by = step(i);
        if by == 0.0 {
            continue;
        }
        let held_ns = joints.time_ns[i - 1] - joints.time_ns[since];
        if i - since > HELD
            && held_ns >= HELD_NS
            && by > STEP_RAD
            && joints.time_ns[i] - joints.time_ns[i - 1] <= NEXT_NS
        {
            times += 1;
            longest_ns = longest_ns.max(held_ns);
            largest = by.max(largest);
        }
        since = i;
    }
    (times >= TIMES).then(|| {
        let message = format!(
            "{times} times all joints repeat one reading, for up to {:.1} s, and then leap by up to {:.1} deg: the readings are \
             stale, repeated and not read anew; mend the driver, or record the topic it reads from",
            longest_ns as f64 * 1e-9,
            largest.to_degrees()
        );
        let subject = format!("recording `{recording}`");
        Warning::new(Severity::Notice, Stage::Recording, Code::StaleReadings, subject, message)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(columns: Vec<Vec<f64>>) -> JointSamples {
        JointSamples {
            time_ns: (0..columns[0].len() as i64).map(|i| i * 10_000_000).collect(),
            names: columns.iter().enumerate().map(|(j, _)| format!("j{j}")).collect(),
            joint_rad: columns,
            ..JointSamples::default()
        }
    }

    #[test]
    fn leaps_are_told_by_joint_and_size() {
        let smooth: Vec<f64> = (0..100).map(|i| 0.01 * f64::from(i)).collect();
        let wraps = smooth.iter().map(|q| q.rem_euclid(0.4)).collect();
        let found = leap_warnings(&stream(vec![smooth, wraps]), "a");
        assert_eq!(found.len(), 1);
        assert!(
            found[0].message.starts_with("joint 2 (j1) leaps 2 times")
                && found[0].message.contains("22.3 deg")
        );
        // A spike is two leaps, there and back.
        let spike = (0..100).map(|i| if i == 50 { 1.0 } else { 0.0 }).collect();
        assert!(leap_warnings(&stream(vec![spike]), "a")[0].message.contains("leaps 2 times"));
    }

    #[test]
    fn a_joint_that_only_turns_fast_does_not_leap() {
        // Half a turn in ten readings, with a sine as speed: 0.49 rad at most from one to the next.
        let turn =
            |i: i32| 0.5 * std::f64::consts::PI * (1.0 - (f64::from(i) * 0.1 * std::f64::consts::PI).cos());
        let fast = (0..60).map(|i: i32| turn((i - 20).clamp(0, 10))).collect();
        assert!(leap_warnings(&stream(vec![fast]), "a").is_empty());
    }

    #[test]
    fn readings_that_are_held_and_leap_are_stale_and_a_rest_before_a_move_is_not() {
        let moving: Vec<f64> = (0..3000).map(|i| (0.02 * f64::from(i)).sin()).collect();
        let held: Vec<f64> = (0..3000).map(|i| moving[i / 100 * 100]).collect();
        let found = stale_warning(&stream(vec![held]), "a").expect("it is stale");
        assert_eq!(found.code, Code::StaleReadings);
        assert!(stale_warning(&stream(vec![moving]), "a").is_none());
        // Rests of 1 s between moves of 1 s, a step of 0.03 rad from reading to reading.
        let rests = (0..3000).map(|i: i32| 0.03 * f64::from(i / 200 * 100 + (i % 200).min(100))).collect();
        assert!(stale_warning(&stream(vec![rests]), "a").is_none());
    }

    #[test]
    fn stamps_that_repeat_or_come_in_bursts_are_told() {
        let even: Vec<i64> = (0..1000).map(|i| i * 10_000_000).collect();
        assert_eq!(stamp_problem(&even, 1000), None);
        assert!(
            stamp_problem(&even, 1001).is_some_and(|why| why.contains("1001 of 2001 joint messages repeat"))
        );
        // Microseconds where nanoseconds belong: a hundred messages in a thousandth of a second, every second.
        let microseconds: Vec<i64> =
            even.iter().map(|t| t / 1_000_000_000 * 1_000_000_000 + t % 1_000_000_000 / 1000).collect();
        assert!(stamp_problem(&microseconds, 0).is_some_and(|why| why.contains("0.010 ms apart where 9 ms")));
        // A recorder that is switched on for a second at each pose, a minute apart.
        let paused: Vec<i64> =
            even.iter().map(|t| t / 1_000_000_000 * 60_000_000_000 + t % 1_000_000_000).collect();
        assert_eq!(stamp_problem(&paused, 0), None);
    }

    #[test]
    fn speeds_are_mostly_zero_and_angles_are_not() {
        let of = |column: Vec<f64>| Readings::of(&stream(vec![column]), 0, &[]).mostly_zero;
        assert!(of((0..100).map(|i| if i % 10 < 3 { 0.5 } else { 0.001 }).collect()));
        assert!(!of((0..100).map(|i| if i < 30 { 0.5 } else { 0.3 }).collect()));
        assert!(!of(vec![0.0; 100]), "a joint that never moves is another matter");
    }
}
