//! What the errors of a run look like by joint, on the board, over time and over what drives them.
//!
//! Arrays in one message are parallel, ready for a scatter plot.

mod boards;
mod course;
mod curves;
mod joints;
mod quality;
mod steps;

pub use boards::{board_errors, round_factor};
pub use course::course;
pub use curves::error_curve;
pub use joints::{feels_gravity, joint_errors, moves_tip, torques_nm};
pub use quality::quality;
pub use steps::{effects_label, steps};

use crate::points::Point;

/// Indices of the points in the order of time.
pub fn in_time(points: &[Point]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by_key(|&i| (points[i].observation.time_ns, points[i].observation.dwell));
    order
}

/// A number that is one.
pub fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Four significant digits, whole numbers at least: tables of viewers show every digit a number has. By its decimal digits,
/// because powers of ten above 22 are no floating-point numbers.
pub fn round_significant(value: f64) -> f64 {
    let exponent = value.abs().log10().floor();
    if !exponent.is_finite() {
        return value;
    }
    let places = usize::try_from(3 - exponent as i32).unwrap_or(0);
    format!("{value:.places$}").parse().unwrap_or(value)
}

/// Zero for what is not a number, in fields that cannot be absent.
pub fn or_zero(value: f64) -> f64 {
    finite(value).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_tables_have_four_digits() {
        let shown =
            [24.342_778_184, 0.131_249_9, -20.892_246, 123_456.7, 1e-7 / 3.0, 0.0].map(round_significant);
        assert_eq!(shown, [24.34, 0.1312, -20.89, 123_457.0, 3.333e-8, 0.0]);
        assert!(round_significant(f64::NAN).is_nan() && round_significant(f64::INFINITY).is_infinite());
    }
}
