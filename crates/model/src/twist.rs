//! How a frame moves per unit of something: a velocity and a rotation, at its origin, in axes that are said.

use nalgebra::{Matrix3, SVector, Vector3};
use std::array;

/// Motion of a frame per unit of one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Twist {
    /// d position [m per unit].
    pub translation_m: Vector3<f64>,
    /// d rotation: `w` with `dR = [w]x R` [rad per unit].
    pub rotation_rad: Vector3<f64>,
}

impl Twist {
    /// No motion.
    pub fn none() -> Twist {
        Twist { translation_m: Vector3::zeros(), rotation_rad: Vector3::zeros() }
    }

    /// The same motion in the axes that `rotation` turns its own into.
    pub fn turned(&self, rotation: &Matrix3<f64>) -> Twist {
        Twist { translation_m: rotation * self.translation_m, rotation_rad: rotation * self.rotation_rad }
    }

    /// Of a point `arm_m` away that turns with the frame: `v + w x arm`.
    pub fn shifted(&self, arm_m: &Vector3<f64>) -> Twist {
        Twist { translation_m: self.translation_m + self.rotation_rad.cross(arm_m), ..*self }
    }

    /// `factor` of it.
    pub fn times(&self, factor: f64) -> Twist {
        Twist { translation_m: self.translation_m * factor, rotation_rad: self.rotation_rad * factor }
    }

    /// Adds `factor` of another motion.
    pub fn add(&mut self, other: &Twist, factor: f64) {
        self.translation_m += other.translation_m * factor;
        self.rotation_rad += other.rotation_rad * factor;
    }
}

/// Motions of one frame per unit of `N` quantities, by axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Twists<const N: usize> {
    /// d position [m per unit].
    pub translation_m: [SVector<f64, N>; 3],
    /// d rotation [rad per unit].
    pub rotation_rad: [SVector<f64, N>; 3],
}

impl<const N: usize> Twists<N> {
    /// The same motions in the axes that `rotation` turns theirs into.
    #[inline]
    pub fn turned(&self, rotation: &Matrix3<f64>) -> Twists<N> {
        let turned = |[x, y, z]: &[SVector<f64, N>; 3]| {
            array::from_fn(|i| x * rotation[(i, 0)] + y * rotation[(i, 1)] + z * rotation[(i, 2)])
        };
        Twists { translation_m: turned(&self.translation_m), rotation_rad: turned(&self.rotation_rad) }
    }

    /// Moves the point to one `arm_m` away that turns with the frame: `v + w x arm`.
    #[inline]
    pub fn shift(&mut self, arm_m: &Vector3<f64>) {
        let ([x, y, z], [wx, wy, wz]) = (&mut self.translation_m, &self.rotation_rad);
        *x += wy * arm_m.z - wz * arm_m.y;
        *y += wz * arm_m.x - wx * arm_m.z;
        *z += wx * arm_m.y - wy * arm_m.x;
    }

    /// Adds other motions of the same frame, in the same axes.
    #[inline]
    pub fn add(&mut self, other: &Twists<N>) {
        let add = |own: &mut [SVector<f64, N>; 3], other: &[SVector<f64, N>; 3]| {
            own.iter_mut().zip(other).for_each(|(own, other)| *own += other);
        };
        add(&mut self.translation_m, &other.translation_m);
        add(&mut self.rotation_rad, &other.rotation_rad);
    }

    /// Sets the motion per unit of quantity `k`.
    #[inline]
    pub fn set(&mut self, k: usize, motion: &Twist) {
        for axis in 0..3 {
            self.translation_m[axis][k] = motion.translation_m[axis];
            self.rotation_rad[axis][k] = motion.rotation_rad[axis];
        }
    }

    /// The motion per unit of quantity `k`.
    #[inline]
    pub fn by(&self, k: usize) -> Twist {
        let of = |[x, y, z]: &[SVector<f64, N>; 3]| Vector3::new(x[k], y[k], z[k]);
        Twist { translation_m: of(&self.translation_m), rotation_rad: of(&self.rotation_rad) }
    }
}
