//! Protobuf messages with the descriptors that Foxglove ships.

use super::*;
use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

fn plan(role: Role, schema: &str, descriptors: &str, body: Option<&str>) -> Result<Plan, DecodeError> {
    Plan::compile(role, schema, "protobuf", &hex(descriptors), "protobuf", body)
}

#[test]
fn joint_states_may_lack_positions_and_efforts() {
    let plan = plan(Role::Joints, "foxglove.JointStates", oracle::FOXGLOVE_JOINT_STATES_DESCRIPTORS, None);
    let rows = joints(decode(&plan.expect("compiles"), &hex(oracle::FOXGLOVE_JOINT_STATES)));
    let row = rows.row(0);
    assert_eq!(row.stamp_ns, Some(1_700_000_000_123_456_789));
    assert_eq!(&row.names[..], ["j1", "joint_2", "j3"]);
    assert_eq!(row.position[..2], [0.5, 0.0]);
    assert!(row.position[2].is_nan() && row.effort[1].is_nan());
    assert_eq!((row.effort[0], row.effort[2]), (10.0, 30.0));
}

/// Proto3 leaves out what is zero: y of the position, x and z of the orientation, the nanoseconds.
#[test]
fn zeros_that_were_left_out_come_back() {
    let plan = plan(Role::Pose, "foxglove.PoseInFrame", oracle::FOXGLOVE_POSE_DESCRIPTORS, None);
    let rows = poses(decode(&plan.expect("compiles"), &hex(oracle::FOXGLOVE_POSE)));
    let row = rows.row(0);
    assert_eq!((row.stamp_ns, row.frame_id), (Some(3_000_000_000), "vicon"));
    assert_eq!((row.position, row.quaternion_xyzw), ([1.5, 0.0, -2.0], Some([0.0, 0.6, 0.0, 0.8])));
}

#[test]
fn a_frame_is_picked_out_of_transforms() {
    let compile = |body| {
        let schema = "foxglove.FrameTransforms";
        plan(Role::Pose, schema, oracle::FOXGLOVE_TRANSFORMS_DESCRIPTORS, body).expect("compiles")
    };
    let message = hex(oracle::FOXGLOVE_TRANSFORMS);
    let rows = poses(decode(&compile(Some("elbow")), &message));
    let row = rows.row(0);
    assert_eq!((rows.len(), row.stamp_ns), (1, Some(1_700_000_001_000_000_004)));
    assert_eq!((row.frame_id, row.body, row.position), ("world", "elbow", [4.0, 5.0, 6.0]));
    let several = decode(&compile(None), &message).expect_err("two frames");
    assert_eq!(several, DecodeError::SeveralBodies { bodies: vec!["tip".to_owned(), "elbow".to_owned()] });
}

/// By hand: an empty pose message inside (present, all zero), a group and an unknown field around it, a message
/// without any pose.
#[test]
fn unknown_fields_are_skipped_and_a_missing_pose_is_an_error() {
    let plan = plan(Role::Pose, "foxglove.PoseInFrame", oracle::FOXGLOVE_POSE_DESCRIPTORS, None);
    let plan = plan.expect("compiles");
    let group = [0x63, 0x08, 0x01, 0x6b, 0x6c, 0x64];
    let pose = [0x1a, 4, 0x0a, 0, 0x12, 0];
    let unknown = [0x70, 0xff, 0x01];
    let rows = poses(decode(&plan, &[&group[..], &pose, &unknown].concat()));
    let row = rows.row(0);
    assert_eq!((row.stamp_ns, row.position, row.quaternion_xyzw), (None, [0.0; 3], Some([0.0; 4])));
    let missing = decode(&plan, &group).expect_err("no pose");
    assert_eq!(missing.to_string(), "the message has no complete position");
    let open = decode(&plan, &group[..3]).expect_err("the group is not closed");
    assert!(matches!(open, DecodeError::Truncated { .. }), "{open}");
}

#[test]
fn descriptors_that_do_not_define_the_message_are_refused() {
    let error =
        plan(Role::Pose, "foxglove.Grid", oracle::FOXGLOVE_POSE_DESCRIPTORS, None).expect_err("no Grid");
    assert!(error.to_string().contains("does not define foxglove.Grid"), "{error}");
    let error =
        Plan::compile(Role::Pose, "a.B", "protobuf", b"\xff\xff", "protobuf", None).expect_err("garbage");
    assert!(matches!(error, DecodeError::Schema { .. }), "{error}");
}

/// Tags in another order than the definition, and a zero that proto3 leaves out: the joints stay in their places.
#[test]
fn each_of_several_paths_keeps_its_place() {
    let field = |(name, number): (&str, i32)| FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(Type::Double.into()),
        ..FieldDescriptorProto::default()
    };
    let message = DescriptorProto {
        name: Some("State".to_owned()),
        field: [("elbow", 3), ("wrist", 1), ("shoulder", 2)].map(field).to_vec(),
        ..DescriptorProto::default()
    };
    let file = FileDescriptorProto {
        name: Some("state.proto".to_owned()),
        syntax: Some("proto3".to_owned()),
        message_type: vec![message],
        ..FileDescriptorProto::default()
    };
    let data = FileDescriptorSet { file: vec![file] }.encode_to_vec();
    let fields = ["shoulder", "elbow", "wrist"].map(|path| (Place::Positions, path));
    let plan =
        Plan::at(Role::Joints, "State", "protobuf", &data, "protobuf", (None, &fields)).expect("compiles");
    let message = [&[0x11][..], &0.5_f64.to_le_bytes(), &[0x09], &(-2.0_f64).to_le_bytes()].concat();
    assert_eq!(joints(decode(&plan, &message)).row(0).position, [0.5, 0.0, -2.0]);
}
