//! Lines in space and turning about them (Rodrigues' rotation formula). The lab's whole kinematics is
//! built on these two functions, so that it shares no formula with the models being fitted.

use armcal_core::Pose;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

/// A directed line: a joint axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// A point on it [m].
    pub point_m: Vector3<f64>,
    /// Its unit direction.
    pub direction: Vector3<f64>,
}

impl Line {
    /// Where a point goes when the body it belongs to turns about the line.
    pub fn turn_point(&self, point_m: &Vector3<f64>, angle_rad: f64) -> Vector3<f64> {
        self.point_m + rotate_vector(&self.direction, &(point_m - self.point_m), angle_rad)
    }

    /// Where another line goes when the body it belongs to turns about this one.
    pub fn turn_line(&self, line: &Line, angle_rad: f64) -> Line {
        Line {
            point_m: self.turn_point(&line.point_m, angle_rad),
            direction: rotate_vector(&self.direction, &line.direction, angle_rad),
        }
    }

    /// Velocity of a point per unit of turning speed [m/rad].
    pub fn velocity(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.direction.cross(&(point_m - self.point_m))
    }
}

/// Turns `v` about the unit vector `axis`: `v cos + (k x v) sin + k (k.v)(1 - cos)`, Rodrigues 1840.
pub fn rotate_vector(axis: &Vector3<f64>, v: &Vector3<f64>, angle_rad: f64) -> Vector3<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

/// The pose of a body whose origin is at `origin_m` and whose x, y and z axes point along `axes`.
pub fn pose_from_axes(origin_m: Vector3<f64>, axes: &[Vector3<f64>; 3]) -> Pose {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(axes));
    Pose::from_parts(origin_m.into(), UnitQuaternion::from_rotation_matrix(&rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Rotation3, Unit};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn turning_agrees_with_the_matrix_exponential(
            k in prop::array::uniform3(-1.0..1.0f64), v in prop::array::uniform3(-1.0..1.0f64), angle in -6.0..6.0f64,
        ) {
            let k = Vector3::from(k);
            prop_assume!(k.norm() > 0.1);
            let axis = Unit::new_normalize(k);
            let v = Vector3::from(v);
            let exponential = (axis.cross_matrix() * angle).exp() * v;
            prop_assert!((rotate_vector(&axis, &v, angle) - exponential).norm() < 1e-12);
            prop_assert!((rotate_vector(&axis, &v, angle) - Rotation3::from_axis_angle(&axis, angle) * v).norm() < 1e-12);
        }
    }
}
