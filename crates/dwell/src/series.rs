//! Small verbs on time columns: differences, median period, unbroken stretches.

use crate::DwellError;
use armcal_core::robust::{median, percentile};
use armcal_core::{JointSamples, PoseSamples};
use std::ops::Range;

/// `to - from` [s], without overflow.
pub(crate) fn seconds_between(from_ns: i64, to_ns: i64) -> f64 {
    // Arithmetic of 128 bits is slow, and only stamps centuries apart need it.
    let exact = || (i128::from(to_ns) - i128::from(from_ns)) as f64;
    to_ns.checked_sub(from_ns).map_or_else(exact, |ns| ns as f64) * 1e-9
}

/// Median time between rows [s]; NaN for fewer than two rows.
pub(crate) fn median_period_s(time_ns: &[i64]) -> f64 {
    let periods: Vec<f64> = time_ns.windows(2).map(|w| seconds_between(w[0], w[1])).collect();
    median(&periods)
}

/// Time between rows that nine in ten do not exceed [s]: of a stream of which rows were lost at random, the median tells
/// nothing.
pub(crate) fn typical_period_s(time_ns: &[i64]) -> f64 {
    let periods: Vec<f64> = time_ns.windows(2).map(|w| seconds_between(w[0], w[1])).collect();
    percentile(&periods, 0.9)
}

/// The gap that breaks a stream of a typical period: as configured, but at least 3.5 periods, so that jitter of a slow stream
/// and lost rows do not.
pub(crate) fn breaking_gap_s(configured_s: f64, period_s: f64) -> f64 {
    configured_s.max(3.5 * period_s)
}

/// Maximal runs of usable rows without a gap longer than `max_gap_s`.
pub(crate) fn unbroken_runs(
    time_ns: &[i64],
    max_gap_s: f64,
    usable: impl Fn(usize) -> bool,
) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = None;
    for i in 0..time_ns.len() {
        let broken = i > 0 && seconds_between(time_ns[i - 1], time_ns[i]) > max_gap_s;
        if (broken || !usable(i))
            && let Some(s) = start.take()
        {
            runs.push(s..i);
        }
        if start.is_none() && usable(i) {
            start = Some(i);
        }
    }
    if let Some(s) = start {
        runs.push(s..time_ns.len());
    }
    runs
}

/// Columns as long as the stamps, stamps increasing, at least one row.
pub(crate) fn check_joints(joints: &JointSamples, doing: &'static str) -> Result<(), DwellError> {
    let stream = "joint";
    if joints.is_empty() || joints.joint_rad.is_empty() {
        return Err(DwellError::NoSamples { doing, stream });
    }
    let n = joints.len();
    let positions = joints.joint_rad.iter().enumerate().map(|(j, c)| (format!("joint {j}"), c.len()));
    let efforts = joints.effort_nm.iter().flatten().enumerate();
    for (what, rows) in positions.chain(efforts.map(|(j, c)| (format!("effort {j}"), c.len()))) {
        if rows != n {
            return Err(DwellError::Shape { doing, stream, time_rows: n, what, rows });
        }
    }
    check_order(&joints.time_ns, doing, stream)
}

/// Columns as long as the stamps, stamps increasing. An empty stream passes.
pub(crate) fn check_poses(
    poses: &PoseSamples,
    doing: &'static str,
    stream: &'static str,
) -> Result<(), DwellError> {
    let n = poses.len();
    let orientations = poses.orientation.as_ref().map_or(n, Vec::len);
    for (what, rows) in [("position", poses.position_m.len()), ("orientation", orientations)] {
        if rows != n {
            return Err(DwellError::Shape { doing, stream, time_rows: n, what: what.to_string(), rows });
        }
    }
    check_order(&poses.time_ns, doing, stream)
}

/// Stamps increase strictly.
pub(crate) fn check_order(
    time_ns: &[i64],
    doing: &'static str,
    stream: &'static str,
) -> Result<(), DwellError> {
    match time_ns.windows(2).position(|w| w[1] <= w[0]) {
        Some(row) => Err(DwellError::Unordered { doing, stream, row: row + 1 }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_and_unusable_rows_break_a_stream() {
        let t = [0, 10, 20, 500, 510, 520, 530].map(|ms: i64| ms * 1_000_000);
        assert_eq!(unbroken_runs(&t, 0.1, |_| true), vec![0..3, 3..7]);
        assert_eq!(unbroken_runs(&t, 0.1, |i| i != 4), vec![0..3, 3..4, 5..7]);
        assert_eq!(unbroken_runs(&t, 1.0, |i| i > 0 && i < 6), vec![1..6]);
        assert!(unbroken_runs(&[], 1.0, |_| true).is_empty());
    }

    #[test]
    fn differences_do_not_overflow() {
        assert!((seconds_between(i64::MIN, i64::MAX) - 18_446_744_073.709_55).abs() < 1e-4);
    }
}
