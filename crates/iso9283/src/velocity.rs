//! Clause 8.6: path velocity accuracy AV, repeatability RV and fluctuation FV.
//!
//! `runs[j][i]` is the speed [m/s] of cycle j at measuring point i, in the part of the path in which the arm runs
//! at constant speed.

use crate::IsoError;
use crate::error::at_least;
use crate::stats::{largest, mean, standard_deviation};

/// Path velocity accuracy `AV = (v_mean - v_c) / v_c` as a ratio, `v_mean` the mean over cycles of their mean speeds
/// (ISO 9283:1998, 8.6).
///
/// Fails without a cycle, with a cycle without a speed, where one is not finite, or unless `commanded_m_s` is
/// positive.
pub fn velocity_accuracy(commanded_m_s: f64, runs: &[Vec<f64>]) -> Result<f64, IsoError> {
    check_speeds("path velocity accuracy", commanded_m_s, runs, 1)?;
    Ok((mean(&means_m_s(runs)) - commanded_m_s) / commanded_m_s)
}

/// Path velocity repeatability `RV = +-3 S_v / v_c` as a ratio, the positive side, `S_v` the standard deviation of
/// the cycles' mean speeds (ISO 9283:1998, 8.6).
///
/// Fails like [`velocity_accuracy`], and with fewer than two cycles.
pub fn velocity_repeatability(commanded_m_s: f64, runs: &[Vec<f64>]) -> Result<f64, IsoError> {
    check_speeds("path velocity repeatability", commanded_m_s, runs, 2)?;
    Ok(3.0 * standard_deviation(&means_m_s(runs)) / commanded_m_s)
}

/// Path velocity fluctuation `FV = max_j (max_i v_ij - min_i v_ij)` [m/s] (ISO 9283:1998, 8.6).
///
/// Fails without a cycle, with a cycle without a speed, or where one is not finite.
pub fn velocity_fluctuation_m_s(runs: &[Vec<f64>]) -> Result<f64, IsoError> {
    check_speeds("path velocity fluctuation", 1.0, runs, 1)?;
    let span = |run: &Vec<f64>| {
        let ends = run.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
        ends.1 - ends.0
    };
    Ok(largest(runs.iter().map(span)))
}

fn means_m_s(runs: &[Vec<f64>]) -> Vec<f64> {
    runs.iter().map(|run| mean(run)).collect()
}

fn check_speeds(
    what: &'static str,
    commanded_m_s: f64,
    runs: &[Vec<f64>],
    least: usize,
) -> Result<(), IsoError> {
    if !(commanded_m_s.is_finite() && commanded_m_s > 0.0) {
        return Err(IsoError::NotPositive { what: "the commanded speed [m/s]".into(), value: commanded_m_s });
    }
    at_least(least, "cycles", runs.len(), what)?;
    if let Some(index) = runs.iter().position(|run| run.is_empty() || run.iter().any(|v| !v.is_finite())) {
        return Err(IsoError::NotFinite { what: format!("speeds of {what}"), index });
    }
    Ok(())
}
