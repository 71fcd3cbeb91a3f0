//! Clause 11: weaving deviations. The tip swings from side to side of a centre line, as a welding torch does; WS is
//! the error of the stroke, WF that of the frequency.

use crate::IsoError;
use crate::command::CommandPath;
use crate::error::at_least;
use crate::settling::{between_ns, check_run, elapsed_s};
use crate::stats::mean;
use crate::tip_pose::TimedPose;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// A weave: how far and how often from side to side.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Weave {
    /// From one side to the other [m].
    pub stroke_m: f64,
    /// Swings to and fro per second [Hz].
    pub frequency_hz: f64,
}

/// Weaving stroke error `WS = (S_a - S_c) / S_c` as a ratio, `S_a` the mean over the cycles (ISO 9283:1998, 11).
pub fn stroke_error(commanded: &Weave, attained: &[Weave]) -> Result<f64, IsoError> {
    relative("weaving stroke error", commanded.stroke_m, attained.iter().map(|weave| weave.stroke_m))
}

/// Weaving frequency error `WF = (F_a - F_c) / F_c` as a ratio, `F_a` the mean over the cycles (ISO 9283:1998, 11).
pub fn frequency_error(commanded: &Weave, attained: &[Weave]) -> Result<f64, IsoError> {
    relative(
        "weaving frequency error",
        commanded.frequency_hz,
        attained.iter().map(|weave| weave.frequency_hz),
    )
}

fn relative(
    what: &'static str,
    commanded: f64,
    attained: impl Iterator<Item = f64>,
) -> Result<f64, IsoError> {
    if !(commanded.is_finite() && commanded > 0.0) {
        return Err(IsoError::NotPositive { what: format!("the command of {what}"), value: commanded });
    }
    let attained: Vec<f64> = attained.collect();
    at_least(1, "cycles", attained.len(), what)?;
    Ok((mean(&attained) - commanded) / commanded)
}

/// The weave in a motion along a straight centre line. Sides are told apart along the direction in which the tip
/// strays most from the line; a side counts once the tip is an eighth of `stroke_m` [m], the commanded stroke,
/// beyond the middle, so that noise makes no swings.
///
/// Fails where samples are not finite or not in order, or where the tip does not reach a side four times.
pub fn weave_of(centre: &CommandPath, run: &[TimedPose], stroke_m: f64) -> Result<Weave, IsoError> {
    check_run("samples of a weaving path", run)?;
    let aside_m = aside_m(centre, run);
    let swings = swings(&aside_m, stroke_m / 8.0);
    let turns_m: Vec<f64> = swings.windows(2).map(|pair| (pair[1].0 - pair[0].0).abs()).collect();
    // Begun and unfinished swings at the ends of the recording do not reach their turning points.
    let whole_m = turns_m.get(1..turns_m.len().saturating_sub(1)).unwrap_or_default();
    let (Some(first), Some(last), false) = (swings.get(1), swings.last(), whole_m.is_empty()) else {
        return Err(IsoError::NoWeave { stroke_mm: stroke_m * 1e3 });
    };
    let crossing_ns = |piece: usize| {
        let s = aside_m[piece] / (aside_m[piece] - aside_m[piece + 1]);
        between_ns(run[piece].time_ns, run[piece + 1].time_ns, s)
    };
    let half_swings = (swings.len() - 2) as f64;
    let duration_s = elapsed_s(crossing_ns(first.1), crossing_ns(last.1));
    Ok(Weave { stroke_m: mean(whole_m), frequency_hz: half_swings / 2.0 / duration_s })
}

/// Signed distances from the centre line [m], about their mean, along the direction of the largest.
fn aside_m(centre: &CommandPath, run: &[TimedPose]) -> Vec<f64> {
    let line = centre.planes(1)[0];
    let strays_m: Vec<Vector3<f64>> = run
        .iter()
        .map(|s| s.pose.position_m - line.pose.position_m)
        .map(|p| p - line.normal.into_inner() * line.normal.dot(&p))
        .collect();
    let middle_m = strays_m.iter().sum::<Vector3<f64>>() / strays_m.len().max(1) as f64;
    let scatter_m2: Matrix3<f64> = strays_m.iter().map(|p| (p - middle_m) * (p - middle_m).transpose()).sum();
    let eigen = scatter_m2.symmetric_eigen();
    let side = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    strays_m.iter().map(|p| side.dot(&(p - middle_m))).collect()
}

/// Turning point [m] of every swing to a side beyond `least_m`, and the piece of the path in which the swing
/// crossed the middle.
fn swings(aside_m: &[f64], least_m: f64) -> Vec<(f64, usize)> {
    let (mut swings, mut crossed): (Vec<(f64, usize)>, usize) = (Vec::new(), 0);
    for (index, &at_m) in aside_m.iter().enumerate() {
        if index > 0 && at_m.signum() != aside_m[index - 1].signum() {
            crossed = index - 1;
        }
        if at_m.abs() < least_m {
            continue;
        }
        match swings.last_mut() {
            Some(swing) if swing.0.signum() == at_m.signum() => {
                if at_m.abs() > swing.0.abs() {
                    swing.0 = at_m;
                }
            }
            _ => swings.push((at_m, crossed)),
        }
    }
    swings
}
