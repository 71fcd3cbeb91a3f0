//! The residual of one observation, `measured - predicted`, and its orientation part.
//!
//! Orientation: `e = Log(R_measured R_predicted^T)`, the rotation vector in world axes that carries the
//! predicted orientation into the measured one. A small rotation `w` of the prediction
//! (`R_predicted -> Exp(w) R_predicted`) changes it by `de = -J(e) w`, with `J` the inverse of the right
//! Jacobian of SO(3) (Chirikjian 2011, eq. 10.86; Sola et al. 2018, eq. 144):
//! `J(e) = I + [e]x / 2 + (1/t^2 - cot(t/2) / (2 t)) [e]x^2`, `t = |e|`. Exact for every `t < pi`.

use nalgebra::{DMatrix, Matrix3, UnitQuaternion, Vector3};

/// `measured - predicted` of one observation, in the world frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelResidual {
    /// Position part [m].
    pub position_m: Vector3<f64>,
    /// Rotation vector from predicted to measured [rad], in world axes, where the observation has an orientation.
    pub rotation_rad: Option<Vector3<f64>>,
    /// The unit vector along which alone the position is known: of the rigid link between two tips, whose position part lies
    /// along it.
    pub along: Option<Vector3<f64>>,
}

impl ModelResidual {
    /// Number of rows: 3, or 6 with an orientation; 1 where only a distance is known.
    pub fn len(&self) -> usize {
        match (self.along, self.rotation_rad) {
            (Some(_), _) => 1,
            (None, Some(_)) => 6,
            (None, None) => 3,
        }
    }

    /// Never: a residual has at least its position.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The rows in the order of the Jacobian's: x, y, z [m], then the rotation vector [rad]; the error of a distance [m].
    pub fn rows(&self) -> impl Iterator<Item = f64> + '_ {
        let along = self.along.map(|along| along.dot(&self.position_m));
        let position = self.position_m.iter().copied().filter(move |_| along.is_none());
        let rotation = self.rotation_rad.iter().flat_map(|e| e.iter().copied());
        along.into_iter().chain(position).chain(rotation)
    }
}

/// The rotation vector from predicted to measured [rad], world axes.
pub(crate) fn rotation_error_rad(
    measured: &UnitQuaternion<f64>,
    predicted: &UnitQuaternion<f64>,
) -> Vector3<f64> {
    (measured * predicted.inverse()).scaled_axis()
}

/// `-J(e)` of the module's formula: d rotation error / d small rotation of the prediction.
pub(crate) fn rotation_error_rate(e: &Vector3<f64>) -> Matrix3<f64> {
    let t = e.norm();
    let factor = if t < 1e-3 {
        // The difference of the two terms cancels near zero; its series does not.
        1.0 / 12.0 + t * t / 720.0
    } else {
        1.0 / (t * t) - 1.0 / (2.0 * t * (t / 2.0).tan())
    };
    let cross = e.cross_matrix();
    -(Matrix3::identity() + cross * 0.5 + cross * cross * factor)
}

/// Adds a column of three rows to a Jacobian, starting at `row`.
pub(crate) fn add_to_column(jacobian: &mut DMatrix<f64>, row: usize, column: usize, value: &Vector3<f64>) {
    let mut target = jacobian.fixed_view_mut::<3, 1>(row, column);
    target += value;
}
