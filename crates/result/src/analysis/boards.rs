//! Errors on each board, in its own frame: a map that a person can hold against the table.

use crate::points::{Point, extent};
use crate::proto::BoardErrors;
use crate::proto::saturating_u32;
use crate::run::Run;
use armcal_core::Pose;
use armcal_core::robust::percentile;
use nalgebra::Vector3;

/// Distances between neighbouring cavities that a large error vector may cover: shorter ones cannot be seen in a panel that
/// shows all boards.
const REACH: f64 = 1.5;
/// Or this share of the board, where cavities are so close that arrows would be dots beside it.
const ACROSS: f64 = 0.2;

/// One entry a recording with a board that was visited.
pub fn board_errors(run: &Run, points: &[Point], in_time: &[usize]) -> Vec<BoardErrors> {
    let magnification = magnification(run, points);
    let fitted = run.calibration.fit.values();
    let of_recording = |index: usize| {
        let board = run.model.board_in_world(&fitted, index)?;
        let own: Vec<&Point> = in_time
            .iter()
            .map(|&i| &points[i])
            .filter(|p| p.observation.dwell.recording == index && is_drawable(p))
            .collect();
        (!own.is_empty()).then(|| recording_board_errors(run, index, &own, &board, magnification))
    };
    (0..run.recordings.len()).filter_map(of_recording).collect()
}

/// A seated tip whose residuals are numbers.
fn is_drawable(p: &Point) -> bool {
    let numbers =
        p.steps_m.iter().chain([&p.residual.nominal_m, &p.residual.fitted_m]).flat_map(Vector3::iter);
    p.observation.cavity().is_some() && numbers.copied().all(f64::is_finite)
}

fn recording_board_errors(
    run: &Run,
    index: usize,
    own: &[&Point],
    board: &Pose,
    magnification: f64,
) -> BoardErrors {
    let mut m = BoardErrors {
        recording: run.recordings[index].name.clone(),
        recording_index: saturating_u32(index),
        magnification,
        ..Default::default()
    };
    for p in own {
        let Some((cavity, in_board_m)) = p.observation.cavity().zip(p.observation.in_board_m()) else {
            continue;
        };
        m.cavity.push(cavity.to_owned());
        m.dwell.push(saturating_u32(p.observation.dwell.dwell));
        m.x_mm.push(in_board_m.x * 1e3);
        m.y_mm.push(in_board_m.y * 1e3);
        let in_board_mm = |world_m: &Vector3<f64>| board.rotation.inverse() * world_m * 1e3;
        let nominal = in_board_mm(&p.residual.nominal_m);
        m.nominal_x_mm.push(nominal.x);
        m.nominal_y_mm.push(nominal.y);
        m.nominal_z_mm.push(nominal.z);
        let fitted = in_board_mm(&p.residual.fitted_m);
        m.fitted_x_mm.push(fitted.x);
        m.fitted_y_mm.push(fitted.y);
        m.fitted_z_mm.push(fitted.z);
        if let Some(after) = p.steps_m.last().map(in_board_mm) {
            m.after_x_mm.push(after.x);
            m.after_y_mm.push(after.y);
            m.after_z_mm.push(after.z);
        }
    }
    m
}

/// The largest round factor at which the 95th percentile of the calibrated errors along the board, which is what is drawn,
/// stays within [`REACH`] of the distance between neighbouring cavities or [`ACROSS`] of the board.
fn magnification(run: &Run, points: &[Point]) -> f64 {
    let fitted = run.calibration.fit.values();
    let along_m = |p: &Point| {
        let board = run.model.board_in_world(&fitted, p.observation.dwell.recording)?;
        Some((board.rotation.inverse() * p.residual.fitted_m).xy().norm())
    };
    let errors_m: Vec<f64> = points.iter().filter(|p| is_drawable(p)).filter_map(along_m).collect();
    let cavities = run.board.iter().flat_map(|b| &b.cavities);
    let places: Vec<Vector3<f64>> = cavities.map(|c| c.in_board_m).collect();
    let nearest = |i: usize| {
        let others = places.iter().enumerate().filter(|(k, _)| *k != i);
        others.map(|(_, p)| (p - places[i]).norm()).fold(f64::INFINITY, f64::min)
    };
    let apart: Vec<f64> = (0..places.len()).map(nearest).collect();
    let size_m = extent(places.iter().copied()).map_or(0.0, |(low, high)| (high - low).max());
    let reach_m = (REACH * percentile(&apart, 0.5)).max(ACROSS * size_m);
    let large_m = percentile(&errors_m, 0.95);
    round_factor(reach_m / large_m)
}

/// The largest of 1, 2, 5, 10, ... 10000 not above this; 1 for what is not a number.
pub fn round_factor(at_most: f64) -> f64 {
    const LADDER: [f64; 13] = [10e3, 5e3, 2e3, 1e3, 500.0, 200.0, 100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0];
    LADDER.into_iter().find(|factor| *factor <= at_most).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_round_and_fit() {
        assert_eq!([0.3, 1.0, 199.9, 1e9].map(round_factor), [1.0, 1.0, 100.0, 10e3]);
        assert_eq!(round_factor(f64::NAN), 1.0);
    }
}
