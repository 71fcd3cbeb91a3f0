//! Coarse search: normalised cross-correlation of the two speed profiles over offset and drift.

use super::lags::{self, Lags, Sums};
use super::profile::SpeedProfile;

/// A maximum this close to the best one, and further from it than three half-widths, is a second answer.
const RIVAL_SHARE: f64 = 0.97;

/// Most drifts to either side.
const MOST_DRIFTS: f64 = 100.0;

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

/// Searches offsets within `max_offset_s` in steps of a part of the half-width `h_s` of the kernel, and drifts within
/// `max_drift` so finely that the ends of the recording move by less than `h_s`. `None` when the profiles do not overlap
/// anywhere.
///
/// A run of points that no drift moves by more than a step is looked at once, for all drifts: under each it has another lag.
pub(crate) fn search(
    sensor: &SpeedProfile,
    robot: &SpeedProfile,
    reference_s: f64,
    h_s: f64,
    max_offset_s: f64,
    max_drift: f64,
) -> Option<Coarse> {
    let points = lags::points(sensor);
    let half_s = points.iter().map(|p| (p.0 - reference_s).abs()).fold(0.0, f64::max);
    let drifts = (max_drift * half_s / h_s).floor().min(MOST_DRIFTS) as i64;
    let drift_of = |k: i64| if drifts == 0 { 0.0 } else { k as f64 / drifts as f64 * max_drift };
    let own = Lags::within(sensor, max_offset_s);
    let all = own.further(drift_of(drifts) * half_s);
    let longest_s = if drifts == 0 { f64::INFINITY } else { all.step_s / max_drift };
    let runs: Vec<(f64, Vec<Sums>)> = split_runs(&points, longest_s)
        .map(|run| (0.5 * (run[0].0 + run[run.len() - 1].0), lags::sums(run, robot, |t_s| t_s, all)))
        .collect();
    let curve = |d: i64| -> Vec<f64> {
        let mut curve = vec![Sums::default(); 2 * own.most as usize + 1];
        for (middle_s, sums) in &runs {
            let later = (drift_of(d) * (middle_s - reference_s) / all.step_s).round() as i64;
            let from = (all.most - own.most + later) as usize;
            curve.iter_mut().zip(&sums[from..]).for_each(|(all, own)| all.add(own));
        }
        curve.iter().map(|sums| sums.correlation(points.len())).collect()
    };
    let curves: Vec<Vec<f64>> = (-drifts..=drifts).map(curve).collect();
    let mut best: Option<(usize, usize, f64)> = None;
    for (d, curve) in curves.iter().enumerate() {
        for (l, &r) in curve.iter().enumerate() {
            if r.is_finite() && best.is_none_or(|b| r > b.2) {
                best = Some((d, l, r));
            }
        }
    }
    let (d, l, highest) = best?;
    let lag_s = |index: usize| (index as i64 - own.most) as f64 * own.step_s;
    let curve = &curves[d];
    let rival_s = (1..curve.len() - 1)
        .filter(|&i| curve[i] >= curve[i - 1] && curve[i] >= curve[i + 1])
        .filter(|&i| curve[i] > RIVAL_SHARE * highest && (lag_s(i) - lag_s(l)).abs() > 3.0 * h_s)
        .max_by(|&a, &b| curve[a].total_cmp(&curve[b]))
        .map(lag_s);
    let (offset_s, drift) = (lag_s(l), drift_of(d as i64 - drifts));
    let correlation = correlation(&points, robot, reference_s, offset_s, drift);
    Some(Coarse { offset_s, drift, correlation, rival_s })
}

/// Points in runs no longer than so many seconds.
fn split_runs(points: &[(f64, f64)], longest_s: f64) -> impl Iterator<Item = &[(f64, f64)]> {
    let mut began_s = points.first().map_or(0.0, |p| p.0);
    points.chunk_by(move |_, next| {
        let same = next.0 - began_s <= longest_s;
        if !same {
            began_s = next.0;
        }
        same
    })
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
    let mut sums = Sums::default();
    for &(t_s, measured) in points {
        if let Some((predicted, _)) = robot.at(t_s - offset_s - drift * (t_s - reference_s)) {
            sums.push(measured, predicted);
        }
    }
    sums.correlation(points.len())
}
