//! Damage: whatever the bytes, decoding ends with rows or an error, and holds no more than the message could.

use super::*;
use proptest::prelude::*;
use schemas::*;

/// Schema, encodings, message: one of everything that decodes.
struct Case {
    schema: &'static str,
    schema_encoding: &'static str,
    text: Vec<u8>,
    message_encoding: &'static str,
    message: Vec<u8>,
}

fn corpus() -> Vec<Case> {
    let cdr = |sample: Sample, message| (sample, "ros2msg", "cdr", message);
    let packed = |sample: Sample, message| (schemas::as_ros1(sample), "ros1msg", "ros1", message);
    let mut cases: Vec<Case> = [
        cdr(joint_state(), oracle::JOINT_STATE),
        cdr(joint_state(), oracle::JOINT_STATE_BIG_ENDIAN),
        cdr(joint_state(), oracle::JOINT_STATE_CDR2),
        cdr(joint_state(), oracle::JOINT_STATE_DELIMITED),
        packed(joint_state(), oracle::JOINT_STATE_ROS1),
        cdr(dynamic_joint_state(), oracle::DYNAMIC_JOINT_STATE),
        cdr(controller_state(false), oracle::CONTROLLER_STATE),
        cdr(pose_stamped(), oracle::POSE_STAMPED),
        cdr(tf(), oracle::TF),
        cdr(tf(), oracle::TF_DELIMITED),
        packed(tf(), oracle::TF_ROS1),
        cdr(rigid_bodies(), oracle::RIGID_BODIES),
        cdr(mocap_markers(), oracle::MOCAP_MARKERS),
        cdr(vicon_markers(), oracle::VICON_MARKERS),
        cdr(vicon_position(), oracle::VICON_POSITION),
        cdr(odd(), oracle::ODD),
    ]
    .into_iter()
    .map(|(sample, schema_encoding, message_encoding, message)| Case {
        schema: sample.schema,
        schema_encoding,
        text: sample.text.into_bytes(),
        message_encoding,
        message: hex(message),
    })
    .collect();
    for (schema, descriptors, message) in [
        ("foxglove.JointStates", oracle::FOXGLOVE_JOINT_STATES_DESCRIPTORS, oracle::FOXGLOVE_JOINT_STATES),
        ("foxglove.PoseInFrame", oracle::FOXGLOVE_POSE_DESCRIPTORS, oracle::FOXGLOVE_POSE),
        ("foxglove.FrameTransforms", oracle::FOXGLOVE_TRANSFORMS_DESCRIPTORS, oracle::FOXGLOVE_TRANSFORMS),
    ] {
        let (text, message) = (hex(descriptors), hex(message));
        cases.push(Case { schema, schema_encoding: "protobuf", text, message_encoding: "protobuf", message });
    }
    let text = br#"{"type":"object","properties":{"name":{"type":"array","items":{"type":"string"}},
        "position":{"type":"array","items":{"type":"number"}}}}"#;
    cases.push(Case {
        schema: "json",
        schema_encoding: "jsonschema",
        text: text.to_vec(),
        message_encoding: "json",
        message: br#"{"name":["a","b"],"position":[1.5,-2]}"#.to_vec(),
    });
    cases
}

/// Decodes if the schema still compiles; checks that nothing is larger than the message and that errors leave the
/// rows alone.
fn survive(case: &Case, text: &[u8], message: &[u8]) {
    let Ok(role) = readable_as(case.schema, case.schema_encoding, text, case.message_encoding) else {
        return;
    };
    let body = if role == Role::Pose { [None, Some("tip")] } else { [None, None] };
    for body in body {
        let plan = Plan::compile(role, case.schema, case.schema_encoding, text, case.message_encoding, body);
        let Ok(plan) = plan else { continue };
        let mut rows = Rows::new(role);
        let decoded = plan.decode(message, &mut rows);
        assert!(decoded.is_ok() || rows.is_empty());
        assert!(rows.len() <= message.len());
        if let Rows::Joints(rows) = &rows {
            assert!(rows.position.len() == rows.row_positions() && rows.position.len() <= message.len());
            // Vectors grow by doubling.
            assert!(rows.position.capacity() <= 2 * message.len() + 8, "{}", rows.position.capacity());
            assert!(rows.name_scratch.capacity() <= 4 * message.len() + 64);
        }
        // What stands before it in the rows must not change how a message is read.
        let mut after_another = Rows::new(role);
        let before =
            plan.decode(&case.message, &mut after_another).map(|()| after_another.len()).unwrap_or(0);
        assert_eq!(plan.decode(message, &mut after_another), decoded);
        assert_eq!(rows_from(&after_another, before), rows_from(&rows, 0));
        let _ = plan.bodies(message);
    }
}

/// The rows from `start`, as text, so that NaN equals NaN.
fn rows_from(rows: &Rows, start: usize) -> Vec<String> {
    match rows {
        Rows::Joints(rows) => rows.rows().skip(start).map(|row| format!("{row:?}")).collect(),
        Rows::Pose(rows) => rows.rows().skip(start).map(|row| format!("{row:?}")).collect(),
        Rows::Scalar(rows) => {
            let rows = rows.stamp_ns.iter().zip(&rows.value);
            rows.skip(start).map(|row| format!("{row:?}")).collect()
        }
    }
}

impl JointRows {
    fn row_positions(&self) -> usize {
        self.rows().map(|row| row.position.len()).sum()
    }
}

#[test]
fn the_corpus_decodes() {
    for case in corpus() {
        let role = readable_as(case.schema, case.schema_encoding, &case.text, case.message_encoding);
        let role = role.unwrap_or_else(|e| panic!("{}: {e}", case.schema));
        let plan =
            Plan::compile(role, case.schema, case.schema_encoding, &case.text, case.message_encoding, None);
        match decode(&plan.expect("compiles"), &case.message) {
            Ok(rows) => assert_eq!(rows.len(), 1, "{}", case.schema),
            Err(error) => {
                assert!(matches!(error, DecodeError::SeveralBodies { .. }), "{}: {error}", case.schema)
            }
        }
    }
}

/// Every prefix of every message.
#[test]
fn truncated_messages_end_in_an_error_or_keep_what_stands_before_the_cut() {
    for case in corpus() {
        for length in 0..case.message.len() {
            survive(&case, &case.text, &case.message[..length]);
        }
    }
    let sample = joint_state();
    let message = hex(oracle::JOINT_STATE);
    for length in 0..message.len() {
        assert!(ros2(Role::Joints, &sample, None, &message[..length]).is_err(), "cut at {length}");
    }
}

/// Where to change a byte (as a share of the length), and to what.
fn damage() -> impl Strategy<Value = Vec<(f64, u8)>> {
    proptest::collection::vec((0.0..1.0, prop_oneof![any::<u8>(), Just(0xff), Just(0)]), 1..6)
}

fn damaged(bytes: &[u8], damage: &[(f64, u8)]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for &(at, value) in damage {
        let at = (at * bytes.len() as f64) as usize;
        bytes[at] = value;
    }
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn mutated_messages_do_no_harm(pick in 0usize..20, damage in damage(), cut in 0.0..1.2) {
        let cases = corpus();
        let case = &cases[pick % cases.len()];
        let mut message = damaged(&case.message, &damage);
        message.truncate((cut * message.len() as f64) as usize);
        survive(case, &case.text, &message);
    }

    #[test]
    fn mutated_schemas_do_no_harm(pick in 0usize..20, damage in damage()) {
        let cases = corpus();
        let case = &cases[pick % cases.len()];
        survive(case, &damaged(&case.text, &damage), &case.message);
    }

    /// Any joint state comes back as it went in.
    #[test]
    fn joint_states_round_trip(
        stamp_ns in i64::from(i32::MIN) * 1_000_000_000..=i64::from(i32::MAX) * 1_000_000_000,
        frame_id in "\\PC{0,12}",
        joints_of in proptest::collection::vec(("[a-z_0-9]{0,9}", -1e3..1e3f64, -1e3..1e3f64), 1..9),
        with_effort in any::<bool>(),
    ) {
        let names: Vec<&str> = joints_of.iter().map(|j| j.0.as_str()).collect();
        let position: Vec<f64> = joints_of.iter().map(|j| j.1).collect();
        let effort: Vec<f64> = joints_of.iter().filter(|_| with_effort).map(|j| j.2).collect();
        let header = crate::ros2::Header { stamp_ns, frame_id: &frame_id };
        let message = crate::ros2::joint_state(header, &names, &position, &position, &effort);
        let rows = joints(ros2(Role::Joints, &joint_state(), None, &message));
        let row = rows.row(0);
        prop_assert_eq!(row.stamp_ns, Some(stamp_ns));
        prop_assert!(row.names.iter().map(String::as_str).eq(names));
        prop_assert_eq!(row.position, position);
        prop_assert_eq!(row.effort, effort);
    }
}
