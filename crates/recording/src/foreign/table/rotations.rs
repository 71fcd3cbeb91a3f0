//! Rotations as tables write them, as quaternions x, y, z, w.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};

/// A matrix or quaternion whose length is off by more is none.
const OFF: f64 = 1e-2;

/// How three numbers are a rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Turns {
    /// A rotation vector: its axis times its angle.
    Vector,
    /// About the fixed axes x, y, z in this order: roll, pitch, yaw.
    Fixed,
    /// About z, then the turned y, then the turned x.
    Kuka,
}

impl Turns {
    /// How the numbers are read, in words.
    pub fn words(self) -> &'static str {
        match self {
            Turns::Vector => "a rotation vector",
            Turns::Fixed => "turns about the fixed axes x, y, z in this order",
            Turns::Kuka => "turns about z, then the turned y, then the turned x (A, B, C)",
        }
    }

    fn quaternion(self, [a, b, c]: [f64; 3]) -> UnitQuaternion<f64> {
        match self {
            Turns::Vector => UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)),
            Turns::Fixed => UnitQuaternion::from_euler_angles(a, b, c),
            Turns::Kuka => UnitQuaternion::from_euler_angles(c, b, a),
        }
    }
}

/// Quaternions of three numbers a row, with the radians of one where a name says it; and in words how they were read.
pub(super) fn of_three(rows: &[[f64; 3]], turns: Turns, unit: Option<f64>) -> (Vec<[f64; 4]>, String) {
    let largest = rows.iter().flatten().filter(|x| x.is_finite()).fold(0.0, |l: f64, x| l.max(x.abs()));
    // No angle is written as more than a turn: such numbers are degrees.
    let in_degrees = unit.map_or(largest > TAU + OFF, |unit| unit < 1.0);
    let turns = if turns == Turns::Vector && in_degrees { Turns::Fixed } else { turns };
    let factor = if in_degrees { PI / 180.0 } else { 1.0 };
    let all = rows.iter().map(|row| components(turns.quaternion(row.map(|x| x * factor)))).collect();
    (all, format!("{} in {}", turns.words(), if in_degrees { "deg" } else { "rad" }))
}

/// The quaternion of a matrix, row by row; `None` where it is no rotation.
pub(super) fn of_matrix(rows: &[f64; 9]) -> Option<[f64; 4]> {
    let matrix = Matrix3::from_row_slice(rows);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).amax();
    let is_rotation = off < OFF && matrix.determinant() > 0.0;
    is_rotation.then(|| {
        components(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_eps(
            &matrix,
            f64::EPSILON,
            100,
            Rotation3::from_matrix_unchecked(matrix),
        )))
    })
}

/// Whether four numbers are a quaternion.
pub(super) fn is_quaternion(of: &[f64]) -> bool {
    of.len() == 4 && (of.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < OFF
}

fn components(q: UnitQuaternion<f64>) -> [f64; 4] {
    [q.i, q.j, q.k, q.w]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn about z of each kind: x becomes y.
    #[test]
    fn a_quarter_turn_is_one_however_it_is_written() {
        let h = 0.5_f64.sqrt();
        let near = |a: [f64; 4], b: [f64; 4]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-9);
        for (row, turns) in [
            ([0.0, 0.0, PI / 2.0], Turns::Vector),
            ([0.0, 0.0, 90.0], Turns::Fixed),
            ([90.0, 0.0, 0.0], Turns::Kuka),
            ([0.0, 0.0, 90.0], Turns::Vector),
        ] {
            let (all, _) = of_three(&[row], turns, None);
            assert!(near(all[0], [0.0, 0.0, h, h]), "{row:?} {turns:?}: {all:?}");
        }
        let (small, words) = of_three(&[[1.0, 2.0, 3.0]], Turns::Vector, Some(PI / 180.0));
        assert!(words.ends_with("deg") && is_quaternion(&small[0]));
        let turned = of_matrix(&[0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]).expect("a rotation");
        assert!(near(turned, [0.0, 0.0, h, h]), "{turned:?}");
        assert_eq!(of_matrix(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0]), None, "a mirror");
        assert_eq!(of_matrix(&[2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]), None);
    }

    /// Two turns do not commute: the order is the one that is named.
    #[test]
    fn the_order_of_turns_is_that_of_the_axes() {
        let [a, b] = [30_f64, 50.0].map(f64::to_radians);
        let turn = |axis: Vector3<f64>, by: f64| UnitQuaternion::from_scaled_axis(axis * by);
        let fixed = turn(Vector3::z(), b) * turn(Vector3::x(), a);
        let (read, _) = of_three(&[[a, 0.0, b]], Turns::Fixed, Some(1.0));
        assert!(components(fixed).iter().zip(read[0]).all(|(x, y)| (x - y).abs() < 1e-12));
        let (kuka, _) = of_three(&[[b, 0.0, a]], Turns::Kuka, Some(1.0));
        assert!(components(fixed).iter().zip(kuka[0]).all(|(x, y)| (x - y).abs() < 1e-12));
    }
}
