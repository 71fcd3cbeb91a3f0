//! What the file of every effect is written with, here and in programs that [`register`](super::register) their own.

pub use super::classification::{Family, Lookalikes, Offered, Target, Toggle};
pub use super::context::{ARM, amplitude, amplitudes_wave, amplitudes_xyz, of_event, shift_xyz, turn_xyz};
pub use super::drivers::{Drivers, Torque};
pub use super::kind::{EffectContext, EffectKind, Placement, Shape};
pub use super::nominal_arm::NominalArm;
pub use super::physics::{Deformation, Physics, Slot};
pub use crate::rigid::Scalar;
pub use armcal_core::{Observation, Unit};
pub use nalgebra::Vector3;

pub(super) use super::state::{LED, REST, SEATED};
pub(super) use super::torque_terms::TorqueTerms;
