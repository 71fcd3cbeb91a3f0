//! What undoes a mistake of the setup where the recordings are read.

use nalgebra::Matrix3;

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
    /// Poses of all bodies are those of the sensor in the body.
    Inverted,
    /// The same of the body at the tip alone.
    TipInverted,
}

impl Mend {
    /// The reading of one joint of so many, times a factor and moved [rad].
    pub fn of_reading(joint: usize, joints: usize, factor: f64, zero_rad: f64) -> Mend {
        let only =
            |value: f64, else_: f64| (0..joints).map(|j| if j == joint { value } else { else_ }).collect();
        Mend::Readings { factors: only(factor, 1.0), zeros_rad: only(zero_rad, 0.0) }
    }
}
