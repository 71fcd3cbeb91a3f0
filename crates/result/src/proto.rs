//! Messages of `proto/armcal.proto`, which Foxglove has no schema for.
//!
//! The code and the descriptor set are made of it when the crate is built.

#![allow(missing_docs)] // The .proto documents the fields whose names do not.

use crate::run::role_word;
use armcal_calibrate::Estimate;
use foxglove::{Encode, Schema};
use prost::bytes::BufMut;

include!(concat!(env!("OUT_DIR"), "/armcal.rs"));

/// `google.protobuf.FileDescriptorSet` of the messages and what they import.
const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/armcal.binpb"));

macro_rules! impl_encode {
    ($($message:ident),+) => {
        $(impl Encode for $message {
            type Error = prost::EncodeError;

            fn get_schema() -> Option<Schema> {
                Some(Schema::new(concat!("armcal.", stringify!($message)), "protobuf", DESCRIPTORS))
            }

            fn get_message_encoding() -> String {
                "protobuf".into()
            }

            fn encode(&self, buffer: &mut impl BufMut) -> Result<(), prost::EncodeError> {
                prost::Message::encode(self, buffer)
            }
        })+
    };
}

impl_encode!(
    Dwell,
    Assignment,
    Residual,
    Parameters,
    ParameterTable,
    Calibration,
    ClockAlignment,
    JointErrors,
    BoardErrors,
    Course,
    Steps,
    Story,
    Candidates,
    EffectTable,
    Diagnosis,
    ErrorCurve,
    Quality
);

/// Counts and indices as protobuf has them.
pub fn saturating_u32(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

/// One parameter.
pub fn parameter_message(e: &Estimate) -> Parameter {
    let p = &e.parameter;
    let shown = |si: f64| p.unit.to_display(si);
    Parameter {
        name: p.name.clone(),
        unit: p.unit.symbol().into(),
        nominal: p.nominal,
        value: e.value,
        sigma: e.sigma,
        ci95_low: e.ci95[0],
        ci95_high: e.ci95[1],
        lower: p.lower,
        upper: p.upper,
        display_unit: p.unit.display_symbol().into(),
        display_nominal: shown(p.nominal),
        display_value: shown(e.value),
        display_change: shown(e.value - p.nominal),
        display_ci95_half: shown((e.ci95[1] - e.ci95[0]) / 2.0),
        free: p.free,
        determined: e.determined,
        at_bound: e.at_bound,
        role: role_word(p.role).into(),
        meaning: p.meaning.clone(),
    }
}
