//! Clause 8.5: cornering deviations. The round-off error CR says by how much the attained path cuts a corner, the
//! overshoot CO by how much it runs beyond the second leg.

use crate::IsoError;
use crate::command::Corner;
use crate::error::at_least;
use crate::stats::{largest, mean};
use nalgebra::Vector3;

/// Cornering round-off error CR [m]: the smallest distance between the corner and the attained path, the mean over
/// the cycles (ISO 9283:1998, 8.5). `runs[j]` are the positions [m] of cycle j, straight between samples.
///
/// Fails without a cycle, or where one has fewer than two samples.
pub fn round_off_m(corner: &Corner, runs: &[Vec<Vector3<f64>>]) -> Result<f64, IsoError> {
    check_cycles("cornering round-off error", runs)?;
    Ok(mean(&runs.iter().map(|run| closest_piece(&corner.position_m, run).1).collect::<Vec<_>>()))
}

/// Cornering overshoot CO [m]: the largest distance from the second leg after the corner, on the side towards which
/// the first leg points, and 0 where the path stays on the other side; the mean over the cycles (ISO 9283:1998,
/// 8.5).
///
/// Fails without a cycle, or where one has fewer than two samples.
pub fn overshoot_m(corner: &Corner, runs: &[Vec<Vector3<f64>>]) -> Result<f64, IsoError> {
    check_cycles("cornering overshoot", runs)?;
    Ok(mean(&runs.iter().map(|run| run_overshoot_m(corner, run)).collect::<Vec<_>>()))
}

fn run_overshoot_m(corner: &Corner, run: &[Vector3<f64>]) -> f64 {
    let leaving = corner.leaving.into_inner();
    let outward = corner.arriving.into_inner() - leaving * corner.arriving.dot(&leaving);
    let after = &run[closest_piece(&corner.position_m, run).0..];
    let on_leg =
        after.iter().map(|p| p - corner.position_m).take_while(|p| p.dot(&leaving) <= corner.straight_m);
    let outside = on_leg.filter(|p| p.dot(&outward) > 0.0);
    largest(outside.map(|p| (p - leaving * p.dot(&leaving)).norm()))
}

/// Index of the sample that ends the piece of a polyline closest to a point, and its distance [m]; the first of
/// equals.
fn closest_piece(point_m: &Vector3<f64>, run: &[Vector3<f64>]) -> (usize, f64) {
    let pieces = run.windows(2).enumerate().map(|(k, ends)| (k + 1, distance_m(point_m, &ends[0], &ends[1])));
    pieces.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN))
}

/// Distance of a point from a straight piece [m].
fn distance_m(point_m: &Vector3<f64>, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
    let (step_m, reach_m) = (to_m - from_m, point_m - from_m);
    let squared_m2 = step_m.norm_squared();
    let s = if squared_m2 > 0.0 { (reach_m.dot(&step_m) / squared_m2).clamp(0.0, 1.0) } else { 0.0 };
    (reach_m - step_m * s).norm()
}

fn check_cycles(what: &'static str, runs: &[Vec<Vector3<f64>>]) -> Result<(), IsoError> {
    at_least(1, "cycles", runs.len(), what)?;
    for run in runs {
        at_least(2, "samples in each cycle", run.len(), what)?;
        if let Some(index) = run.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
            return Err(IsoError::NotFinite { what: format!("positions of {what}"), index });
        }
    }
    Ok(())
}
