//! Clauses 7.4 and 7.5: position stabilization time t and position overshoot OV, and clause 9: minimum posing time.

use crate::IsoError;
use crate::error::at_least;
use crate::stats::{largest, mean};
use crate::tip_pose::TimedPose;
use nalgebra::Vector3;

/// How one approach came to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settling {
    /// When the tip first crossed into the limit band [ns].
    pub crossed_ns: i64,
    /// When it entered the band for good [ns].
    pub settled_ns: i64,
    /// Largest distance from the attained position after the first crossing [m]; 0 when it stayed within the band.
    pub overshoot_m: f64,
}

impl Settling {
    /// Time from the first crossing until the tip stays within the band [s].
    pub fn time_s(&self) -> f64 {
        elapsed_s(self.crossed_ns, self.settled_ns)
    }
}

/// Follows one approach until rest. The limit band is a sphere of radius `limit_band_m` [m] about the position that
/// is finally attained: the pose repeatability, or what the maker states. Between samples the tip moves on a
/// straight line.
///
/// Fails when the samples begin inside the band, end outside it, are not in order of time, or are not finite.
pub fn measure_settling(
    run: &[TimedPose],
    attained_m: &Vector3<f64>,
    limit_band_m: f64,
) -> Result<Settling, IsoError> {
    check_run("samples around the stop", run)?;
    if !(limit_band_m.is_finite() && limit_band_m > 0.0) {
        return Err(IsoError::NotPositive { what: "the limit band [m]".into(), value: limit_band_m });
    }
    let band_mm = limit_band_m * 1e3;
    let distance_m = |sample: &TimedPose| (sample.pose.position_m - attained_m).norm();
    if run.first().is_none_or(|first| distance_m(first) <= limit_band_m) {
        return Err(IsoError::CrossingNotSeen { band_mm });
    }
    let entries_ns = run.windows(2).filter_map(|pair| entry_ns(pair, attained_m, limit_band_m));
    // The last sample outside the band starts the last entry.
    let entries_ns: Vec<i64> = entries_ns.collect();
    let rests = run.last().is_some_and(|last| distance_m(last) <= limit_band_m);
    let (Some(&crossed_ns), Some(&settled_ns), true) = (entries_ns.first(), entries_ns.last(), rests) else {
        return Err(IsoError::NeverSettles { band_mm });
    };
    let furthest_m = largest(run.iter().filter(|s| s.time_ns >= crossed_ns).map(distance_m));
    let overshoot_m = if furthest_m > limit_band_m { furthest_m } else { 0.0 };
    Ok(Settling { crossed_ns, settled_ns, overshoot_m })
}

/// When the straight line between two samples, the first outside, enters the band.
fn entry_ns(pair: &[TimedPose], centre_m: &Vector3<f64>, band_m: f64) -> Option<i64> {
    let from_m = pair[0].pose.position_m - centre_m;
    let step_m = pair[1].pose.position_m - pair[0].pose.position_m;
    // |from + s step|^2 = band^2; the smaller root is the entry.
    let (a, half_b, c) =
        (step_m.norm_squared(), from_m.dot(&step_m), from_m.norm_squared() - band_m * band_m);
    if c <= 0.0 || a == 0.0 {
        return None;
    }
    let s = (-half_b - (half_b * half_b - a * c).sqrt()) / a;
    (0.0..=1.0).contains(&s).then(|| between_ns(pair[0].time_ns, pair[1].time_ns, s))
}

/// Seconds from one time to another [ns]; wild times of a damaged file saturate.
pub(crate) fn elapsed_s(from_ns: i64, to_ns: i64) -> f64 {
    to_ns.saturating_sub(from_ns) as f64 * 1e-9
}

/// The time a fraction `s` of the way between two times [ns].
pub(crate) fn between_ns(from_ns: i64, to_ns: i64, s: f64) -> i64 {
    from_ns.saturating_add((to_ns.saturating_sub(from_ns) as f64 * s).round() as i64)
}

/// Position stabilization time t [s]: the mean over the cycles (ISO 9283:1998, 7.4; it asks for three).
pub fn stabilization_time_s(cycles: &[Settling]) -> Result<f64, IsoError> {
    at_least(1, "cycles", cycles.len(), "position stabilization time")?;
    Ok(mean(&cycles.iter().map(Settling::time_s).collect::<Vec<_>>()))
}

/// Position overshoot OV [m]: the largest of the cycles (ISO 9283:1998, 7.5; it asks for three).
pub fn overshoot_m(cycles: &[Settling]) -> Result<f64, IsoError> {
    at_least(1, "cycles", cycles.len(), "position overshoot")?;
    Ok(largest(cycles.iter().map(|cycle| cycle.overshoot_m)))
}

/// Minimum posing time [s]: from the departure from rest until the tip is settled at the next pose, the
/// stabilization time included; the mean over the cycles (ISO 9283:1998, 9; it asks for three). Each cycle is
/// departure and arrival [ns].
pub fn posing_time_s(cycles: &[[i64; 2]]) -> Result<f64, IsoError> {
    at_least(1, "cycles", cycles.len(), "minimum posing time")?;
    Ok(mean(
        &cycles
            .iter()
            .map(|[departed_ns, settled_ns]| elapsed_s(*departed_ns, *settled_ns))
            .collect::<Vec<_>>(),
    ))
}

/// Fails unless samples are finite and in strict order of time.
pub(crate) fn check_run(what: &str, run: &[TimedPose]) -> Result<(), IsoError> {
    if let Some(index) = run.iter().position(|s| !s.pose.is_finite()) {
        return Err(IsoError::NotFinite { what: what.to_owned(), index });
    }
    match run.windows(2).position(|pair| pair[1].time_ns <= pair[0].time_ns) {
        Some(before) => Err(IsoError::TimeNotIncreasing { what: what.to_owned(), index: before + 1 }),
        None => Ok(()),
    }
}
