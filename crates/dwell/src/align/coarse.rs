//! Coarse search: normalised cross-correlation of the two speed profiles over offset and drift.

use rayon::prelude::*;

use super::profile::SpeedProfile;

/// Most points of the sensor's profile that are compared.
const MAX_POINTS: usize = 8_000;

/// A maximum this close to the best one, and further from it than three half-widths, is a second answer.
const RIVAL_SHARE: f64 = 0.97;

/// The best alignment found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coarse {
    /// Offset, sensor minus robot [s].
    pub offset_s: f64,
    /// Drift about the reference time.
    pub drift: f64,
    /// Pearson's correlation there.
    pub correlation: f64,
    /// Another offset that is nearly as good [s] (periodic motion).
    pub rival_s: Option<f64>,
}

/// Searches offsets within `max_offset_s` in steps of half the half-width `h_s` of the kernel, and drifts
/// within `max_drift` so finely that the ends of the recording move by less than `h_s`. `None` when the
/// profiles do not overlap anywhere.
pub(crate) fn search(
    sensor: &SpeedProfile,
    robot: &SpeedProfile,
    reference_s: f64,
    h_s: f64,
    max_offset_s: f64,
    max_drift: f64,
) -> Option<Coarse> {
    let points = sensor.points(sensor.len().div_ceil(MAX_POINTS).max(2));
    let half_s = points.iter().map(|p| (p.0 - reference_s).abs()).fold(0.0, f64::max);
    let drifts = (max_drift * half_s / h_s).floor().min(100.0) as i64;
    let lags = (max_offset_s / (0.5 * h_s)).ceil() as i64;
    let drift_of = |k: i64| if drifts == 0 { 0.0 } else { k as f64 / drifts as f64 * max_drift };
    let lag_of = |k: i64| k as f64 / lags as f64 * max_offset_s;

    let curves: Vec<Vec<f64>> = (-drifts..=drifts)
        .into_par_iter()
        .map(|d| {
            (-lags..=lags).map(|l| correlation(&points, robot, reference_s, lag_of(l), drift_of(d))).collect()
        })
        .collect();
    let mut best: Option<(usize, usize, f64)> = None;
    for (d, curve) in curves.iter().enumerate() {
        for (l, &r) in curve.iter().enumerate() {
            if r.is_finite() && best.is_none_or(|b| r > b.2) {
                best = Some((d, l, r));
            }
        }
    }
    let (d, l, correlation) = best?;
    let lag = |index: usize| lag_of(index as i64 - lags);
    let curve = &curves[d];
    let rival_s = (1..curve.len() - 1)
        .filter(|&i| curve[i] >= curve[i - 1] && curve[i] >= curve[i + 1])
        .filter(|&i| curve[i] > RIVAL_SHARE * correlation && (lag(i) - lag(l)).abs() > 3.0 * h_s)
        .max_by(|&a, &b| curve[a].total_cmp(&curve[b]))
        .map(lag);
    Some(Coarse { offset_s: lag(l), drift: drift_of(d as i64 - drifts), correlation, rival_s })
}

/// Pearson's correlation of sensor points with the robot's profile under an alignment; NaN where fewer
/// than two fifths of the points have a counterpart.
pub(crate) fn correlation(
    points: &[(f64, f64)],
    robot: &SpeedProfile,
    reference_s: f64,
    offset_s: f64,
    drift: f64,
) -> f64 {
    let (mut n, mut x, mut y, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for &(t_s, measured) in points {
        if let Some((predicted, _)) = robot.at(t_s - offset_s - drift * (t_s - reference_s)) {
            n += 1.0;
            x += measured;
            y += predicted;
            xx += measured * measured;
            yy += predicted * predicted;
            xy += measured * predicted;
        }
    }
    if n < 0.4 * points.len() as f64 || n < 8.0 {
        return f64::NAN;
    }
    (xy - x * y / n) / ((xx - x * x / n) * (yy - y * y / n)).sqrt()
}
