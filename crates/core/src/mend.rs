//! What undoes a mistake of the setup where the recordings are read.

use nalgebra::{Matrix3, UnitQuaternion};

/// Keys under `[streams]` of a pipeline that undo a mistake.
#[derive(Debug, Clone, PartialEq)]
pub enum Mend {
    /// Each joint's reading times its factor, and then this added to it [rad].
    Readings {
        /// A factor a joint.
        factors: Vec<f64>,
        /// An angle a joint [rad].
        zeros_rad: Vec<f64>,
    },
    /// Each joint read where the one of this place is read.
    Order(Vec<usize>),
    /// Positions of all bodies in other axes: a signed permutation of those that are published.
    Axes(Matrix3<f64>),
    /// The same of the body at the tip and of markers on the arm alone.
    AxesOfArm(Matrix3<f64>),
    /// Positions of all bodies so many times as large.
    Scale(f64),
    /// Orientations of the body at the tip and of markers on the arm in other axes than their positions.
    OrientationAxes(Matrix3<f64>),
    /// Poses of all bodies are those of the sensor in the body.
    Inverted,
    /// The same of the body at the tip alone.
    TipInverted,
}

/// The turns that carry axes onto axes: 24, the first of them none.
pub fn axis_turns() -> Vec<Matrix3<f64>> {
    let orders = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];
    let signed = |order: [usize; 3], signs: usize| {
        Matrix3::from_fn(|row, column| {
            let sign = if signs >> row & 1 == 0 { 1.0 } else { -1.0 };
            if order[row] == column { sign } else { 0.0 }
        })
    };
    let all = orders.into_iter().flat_map(|order| (0..8).map(move |signs| signed(order, signs)));
    all.filter(|turn| turn.determinant() > 0.0).collect()
}

/// A rotation as it is in axes that a matrix, a turn or a reflection, carries these onto.
pub fn in_axes(matrix: &Matrix3<f64>, rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_matrix(&(matrix * rotation.to_rotation_matrix().matrix() * matrix.transpose()))
}

impl Mend {
    /// The reading of one joint of so many, times a factor and moved [rad].
    pub fn of_reading(joint: usize, joints: usize, factor: f64, zero_rad: f64) -> Mend {
        let only =
            |value: f64, else_: f64| (0..joints).map(|j| if j == joint { value } else { else_ }).collect();
        Mend::Readings { factors: only(factor, 1.0), zeros_rad: only(zero_rad, 0.0) }
    }
}
