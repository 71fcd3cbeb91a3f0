//! The model: where the tip should be, and how that changes with every parameter.
//!
//! One equation, each symbol with the module that owns it:
//!
//! ```text
//! r(p) = measured(p) - B(p) * A_1(p, q_1) * ... * A_n(p, q_n) * T(p)
//! ```
//!
//! * `A_i`: the rows of a [`Chain`], read from a DH table ([`Chain::from_dh_toml`]) or a URDF
//!   ([`Chain::from_urdf`]); the formulas are in `segment`, written once and generic over the scalar;
//! * `B`, `T`, and the board behind a seated `measured`: [`Frames`];
//! * what makes the arm differ from these rigid frames (play, compliance, ...): [`catalogue`], in `effects`;
//! * `r` and its exact Jacobian: [`Model::residual`], [`Model::residual_with_jacobian`].
//!
//! Each segment's small transform is differentiated by dual numbers; the product rule in `tree`
//! carries these derivatives to the tip, so that nothing is differentiated numerically and no
//! derivative is written by hand.

mod chain;
mod deviation;
mod effects;
mod error;
mod fixed;
mod frames;
mod measurements;
mod model;
mod registry;
mod residual;
mod rigid;
mod segment;
mod skeleton;
mod still;
mod tree;
mod twist;

#[cfg(test)]
mod tests;

pub use chain::{Arm, Chain, DhRow, Masses, check_xml, roll_pitch_yaw_of, three_numbers};
pub use deviation::Deviation;
pub use effects::{
    Drivers, EffectKind, EffectSpec, EffectTable, Expression, Family, JointReference, Lookalikes, Offered,
    Override, PlacedEffect, Session, Shape, Since, Target, Toggle, Torque, catalogue, effects_toml, find,
    is_of_effect, place_and_moment, prelude as effect_prelude, register, tables_toml,
};
pub use error::ModelError;
pub use fixed::{FixedPlace, Length};
pub use frames::{ArmFrames, Frame, Frames, Knowledge, Marker};
pub use measurements::{
    AnyMeasurement, DISTANCE, Measurement, MeasurementKind, find_measurement, measurement_kinds,
    register_measurements,
};
pub use model::{
    CalibratedOrigins, CarriedMotions, CarriedPoint, LinkFrame, Model, RecordingStart, least_dwells,
};
pub use residual::ModelResidual;
pub use rigid::Scalar;
pub use segment::Motion;
pub use skeleton::{Bone, Moving, Place, Skeleton};
pub use tree::Asked;
