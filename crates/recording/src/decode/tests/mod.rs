//! The decoders against messages of other people's encoders, the encoders of this crate, bytes by hand, and damage.

mod fields;
mod json;
mod mutation;
mod oracle;
mod protobuf;
mod ros;
mod schemas;

use super::*;
use schemas::Sample;

/// Bytes of a hexadecimal constant.
fn hex(text: &str) -> Vec<u8> {
    assert!(text.len().is_multiple_of(2));
    (0..text.len())
        .step_by(2)
        .map(|i| u8::from_str_radix(&text[i..i + 2], 16).expect("a hexadecimal constant"))
        .collect()
}

/// Decodes one ROS 2 message.
fn ros2(role: Role, sample: &Sample, body: Option<&str>, message: &[u8]) -> Result<Rows, DecodeError> {
    let plan = Plan::compile(role, sample.schema, "ros2msg", sample.text.as_bytes(), "cdr", body)?;
    decode(&plan, message)
}

/// Decodes one ROS 1 message.
fn ros1(role: Role, sample: Sample, body: Option<&str>, message: &[u8]) -> Result<Rows, DecodeError> {
    let sample = schemas::as_ros1(sample);
    let plan = Plan::compile(role, sample.schema, "ros1msg", sample.text.as_bytes(), "ros1", body)?;
    decode(&plan, message)
}

fn decode(plan: &Plan, message: &[u8]) -> Result<Rows, DecodeError> {
    let mut rows = Rows::new(plan.role());
    plan.decode(message, &mut rows)?;
    Ok(rows)
}

fn joints(rows: Result<Rows, DecodeError>) -> JointRows {
    match rows.expect("decodes") {
        Rows::Joints(rows) => rows,
        other => panic!("{other:?}"),
    }
}

fn poses(rows: Result<Rows, DecodeError>) -> PoseRows {
    match rows.expect("decodes") {
        Rows::Pose(rows) => rows,
        other => panic!("{other:?}"),
    }
}

fn scalars(rows: Result<Rows, DecodeError>) -> ScalarRows {
    match rows.expect("decodes") {
        Rows::Scalar(rows) => rows,
        other => panic!("{other:?}"),
    }
}
