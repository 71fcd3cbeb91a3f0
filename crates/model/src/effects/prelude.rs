//! What the file of every effect is written with.

pub(super) use super::context::{
    ARM, EffectContext, amplitude, amplitudes_wave, amplitudes_xyz, of_event, shift_xyz, turn_xyz,
};
pub(super) use super::drivers::Drivers;
pub(super) use super::kind::{EffectKind, Family, Lookalikes, Offered, Placement, Shape, Target, Toggle};
pub(super) use super::physics::{Deformation, Physics, Slot};
pub(super) use super::state::{LED, REST, SEATED};
pub(super) use super::torque_terms::TorqueTerms;
pub(super) use crate::rigid::Scalar;
pub(super) use armcal_core::{Observation, Unit};
pub(super) use nalgebra::Vector3;
