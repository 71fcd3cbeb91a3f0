//! Rigid transforms over any scalar: `f64` predicts, dual numbers differentiate.

use armcal_core::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use num_dual::DualNum;

/// The scalars the physics is written over.
pub trait Scalar: DualNum<Primitive = f64> + Copy {}

impl<D: DualNum<Primitive = f64> + Copy> Scalar for D {}

/// A rigid transform: rotation matrix, then translation [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rigid<D: Scalar> {
    pub rotation: Matrix3<D>,
    pub translation_m: Vector3<D>,
}

impl<D: Scalar> Rigid<D> {
    /// First `self`, then `next` in the frame that `self` leads to.
    pub fn then(&self, next: &Rigid<D>) -> Rigid<D> {
        Rigid {
            rotation: matrix_product(&self.rotation, &next.rotation),
            translation_m: self.rotation * next.translation_m + self.translation_m,
        }
    }

    /// The frame itself.
    pub fn identity() -> Rigid<D> {
        Rigid { rotation: Matrix3::identity(), translation_m: Vector3::zeros() }
    }
}

impl Rigid<f64> {
    /// Coordinates of a point of the inner frame in the outer one [m].
    pub fn point(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point_m + self.translation_m
    }
}

impl From<&Pose> for Rigid<f64> {
    fn from(pose: &Pose) -> Rigid<f64> {
        Rigid {
            rotation: pose.rotation.to_rotation_matrix().into_inner(),
            translation_m: pose.translation.vector,
        }
    }
}

impl From<&Rigid<f64>> for Pose {
    fn from(rigid: &Rigid<f64>) -> Pose {
        let rotation = Rotation3::from_matrix_unchecked(rigid.rotation);
        Pose::from_parts(
            Translation3::from(rigid.translation_m),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )
    }
}

/// The product of two 3x3 matrices, written out: nalgebra's general product costs dual numbers twice as much.
pub(crate) fn matrix_product<D: Scalar>(a: &Matrix3<D>, b: &Matrix3<D>) -> Matrix3<D> {
    Matrix3::from_fn(|i, j| a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)])
}

/// Rotation matrix of a rotation vector [rad], Rodrigues' formula:
/// `R = I + s [r]x + c [r]x^2` with `s = sin(t)/t`, `c = (1 - cos t)/t^2`, `t = |r|`.
///
/// Near zero `s` and `c` come from their series in `t^2`, which is smooth where the square root is not;
/// the first term left out is below 1e-17.
pub(crate) fn rotation_of_vector<D: Scalar>(r: &Vector3<D>) -> Matrix3<D> {
    let squared = r.x * r.x + r.y * r.y + r.z * r.z;
    let one = D::from(1.0);
    let (s, c) = if squared.re() < 1e-3 {
        let s = one - squared / 6.0 * (one - squared / 20.0 * (one - squared / 42.0));
        let c = (one - squared / 12.0 * (one - squared / 30.0 * (one - squared / 56.0))) * 0.5;
        (s, c)
    } else {
        let angle = squared.sqrt();
        let (sine, cosine) = angle.sin_cos();
        // A quotient of dual numbers is rounded otherwise than one of f64, a reciprocal is not: predicting and
        // differentiating agree to the last bit.
        (sine * angle.recip(), (one - cosine) * squared.recip())
    };
    let (x, y, z) = (r.x, r.y, r.z);
    Matrix3::new(
        one - c * (y * y + z * z),
        c * x * y - s * z,
        c * x * z + s * y,
        c * x * y + s * z,
        one - c * (x * x + z * z),
        c * y * z - s * x,
        c * x * z - s * y,
        c * y * z + s * x,
        one - c * (x * x + y * y),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rodrigues_agrees_with_nalgebra_on_both_sides_of_the_series(
            x in -3.0..3.0f64, y in -3.0..3.0f64, z in -3.0..3.0f64, size in -9.0..0.0f64,
        ) {
            let r = Vector3::new(x, y, z) * 10f64.powf(size);
            let expected = Rotation3::from_scaled_axis(r).into_inner();
            prop_assert!((rotation_of_vector(&r) - expected).abs().max() < 1e-14);
        }
    }
}
