//! Messages of `proto/armcal.proto`, which Foxglove has no schema for.
//!
//! The code and the descriptor set are made of it when the crate is built.

#![allow(missing_docs)] // The .proto documents the fields whose names do not.

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
