//! What was measured of a tip.

use crate::rigid::Rigid;
use armcal_core::Observation;
use nalgebra::Vector3;

/// Where the tip was, in the world [m]: as a sensor saw it, or the cavity of the board; NaN where there is no such board.
pub(super) fn measured_m(
    o: &Observation,
    board: Option<&Rigid<f64>>,
    in_board_m: &Vector3<f64>,
) -> Vector3<f64> {
    let in_board = || board.map_or(Vector3::repeat(f64::NAN), |board| board.point(in_board_m));
    o.seen_m().copied().unwrap_or_else(in_board)
}

/// The seated point as the board's file gives it [m]; zero for one that is not seated.
pub(super) fn seated_m(o: &Observation) -> Vector3<f64> {
    o.in_board_m().copied().unwrap_or_else(Vector3::zeros)
}
