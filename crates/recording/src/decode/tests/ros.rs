//! ROS 2 and ROS 1 messages.

use super::*;
use crate::ros2 as encode;
use schemas::*;

fn is_the_joint_state(rows: &JointRows) {
    assert_eq!(rows.len(), 1);
    let row = rows.row(0);
    assert_eq!(row.stamp_ns, Some(1_700_000_000_123_456_789));
    assert_eq!(&row.names[..], ["j1", "joint_2", "j3"]);
    assert_eq!(row.position, [0.5, -1.25, 3.0]);
    assert_eq!(row.effort, [10.0, 20.0, 30.0]);
}

#[test]
fn joint_states_of_every_encapsulation_agree() {
    for message in [
        oracle::JOINT_STATE,
        oracle::JOINT_STATE_BIG_ENDIAN,
        oracle::JOINT_STATE_CDR2,
        oracle::JOINT_STATE_CDR2_BIG_ENDIAN,
        oracle::JOINT_STATE_DELIMITED,
        oracle::JOINT_STATE_DELIMITED_BIG_ENDIAN,
    ] {
        is_the_joint_state(&joints(ros2(Role::Joints, &joint_state(), None, &hex(message))));
    }
    is_the_joint_state(&joints(ros1(Role::Joints, joint_state(), None, &hex(oracle::JOINT_STATE_ROS1))));
    let mutable = ros2(Role::Joints, &joint_state(), None, &hex(oracle::JOINT_STATE_MUTABLE));
    assert_eq!(mutable.err(), Some(DecodeError::Encapsulation { id: 0x000b }));
}

/// Python's mcap-ros2-support writes three `=` and leaves `builtin_interfaces/Time` undefined.
#[test]
fn a_schema_may_take_time_for_granted() {
    let text = "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n===\n\
        MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";
    let sample = Sample { schema: "sensor_msgs/msg/JointState", text: text.to_owned() };
    is_the_joint_state(&joints(ros2(Role::Joints, &sample, None, &hex(oracle::JOINT_STATE))));
}

#[test]
fn poses_agree() {
    let check = |rows: PoseRows| {
        let row = rows.row(0);
        assert_eq!(row.stamp_ns, Some(1_700_000_000_000_000_005));
        assert_eq!((row.frame_id, row.body, row.occluded), ("vicon", "", false));
        assert_eq!(row.position, [1.5, 2.5, -3.5]);
        assert_eq!(row.quaternion_xyzw, Some([0.0, 0.6, 0.0, 0.8]));
    };
    for message in [oracle::POSE_STAMPED, oracle::POSE_STAMPED_BIG_ENDIAN] {
        check(poses(ros2(Role::Pose, &pose_stamped(), None, &hex(message))));
    }
    check(poses(ros1(Role::Pose, pose_stamped(), None, &hex(oracle::POSE_STAMPED_ROS1))));
}

#[test]
fn transforms_points_and_temperatures_agree() {
    let transforms = [
        ros2(Role::Pose, &transform_stamped(), None, &hex(oracle::TRANSFORM_STAMPED)),
        ros2(Role::Pose, &transform_stamped(), Some("tip"), &hex(oracle::TRANSFORM_STAMPED)),
        ros1(Role::Pose, transform_stamped(), None, &hex(oracle::TRANSFORM_STAMPED_ROS1)),
    ];
    for rows in transforms {
        let rows = poses(rows);
        let row = rows.row(0);
        assert_eq!(row.stamp_ns, Some(1_700_000_001_000_000_009));
        assert_eq!((row.frame_id, row.body), ("world", "tip"));
        assert_eq!((row.position, row.quaternion_xyzw), ([1.0, 2.0, 3.0], Some([0.0, 0.0, 0.0, 1.0])));
    }
    let points = [
        ros2(Role::Pose, &point_stamped(), None, &hex(oracle::POINT_STAMPED)),
        ros1(Role::Pose, point_stamped(), None, &hex(oracle::POINT_STAMPED_ROS1)),
    ];
    for rows in points {
        let rows = poses(rows);
        let row = rows.row(0);
        assert_eq!((row.stamp_ns, row.frame_id), (Some(3_000_000_004), "lab"));
        assert_eq!((row.position, row.quaternion_xyzw), ([7.0, 8.0, 9.0], None));
    }
    let temperatures = [
        ros2(Role::Scalar, &temperature(), None, &hex(oracle::TEMPERATURE)),
        ros1(Role::Scalar, temperature(), None, &hex(oracle::TEMPERATURE_ROS1)),
    ];
    for rows in temperatures {
        let rows = scalars(rows);
        assert_eq!((rows.stamp_ns[0], rows.value[0]), (Some(12_000_000_013), 23.25));
    }
}

#[test]
fn a_body_is_picked_out_of_tf() {
    let messages = [oracle::TF, oracle::TF_CDR2, oracle::TF_CDR2_BIG_ENDIAN, oracle::TF_DELIMITED];
    let all = messages
        .map(|message| ros2(Role::Pose, &tf(), Some("elbow/a"), &hex(message)))
        .into_iter()
        .chain([ros1(Role::Pose, tf(), Some("elbow/a"), &hex(oracle::TF_ROS1))]);
    for rows in all {
        let rows = poses(rows);
        assert_eq!(rows.len(), 1);
        let row = rows.row(0);
        assert_eq!(row.stamp_ns, Some(1_700_000_001_000_000_002));
        assert_eq!((row.frame_id, row.body), ("world", "elbow/a"));
        assert_eq!((row.position, row.quaternion_xyzw), ([4.0, 5.0, 6.0], Some([0.0, 0.0, 0.0, 1.0])));
    }
}

#[test]
fn a_body_that_is_not_there_gives_no_rows_and_none_asked_for_names_them_all() {
    let absent = ros2(Role::Pose, &tf(), Some("hand"), &hex(oracle::TF));
    assert!(poses(absent).is_empty());
    let bodies = ["tip", "elbow/a", "table"].map(str::to_owned).to_vec();
    let open = ros2(Role::Pose, &tf(), None, &hex(oracle::TF)).expect_err("three bodies");
    assert_eq!(open, DecodeError::SeveralBodies { bodies: bodies.clone() });
    let plan = Plan::compile(Role::Pose, "tf", "ros2msg", tf().text.as_bytes(), "cdr", Some("hand"));
    assert_eq!(plan.expect("compiles").bodies(&hex(oracle::TF)), Ok(bodies));
    let unnamed = ros2(Role::Pose, &pose_stamped(), Some("tip"), &hex(oracle::POSE_STAMPED));
    assert!(matches!(unnamed, Err(DecodeError::NoBodyName { .. })));
}

#[test]
fn vicon_markers_are_in_millimetres_and_may_be_occluded() {
    let sample = vicon_markers();
    let message = hex(oracle::VICON_MARKERS);
    let plan = Plan::compile(Role::Pose, sample.schema, "ros2msg", sample.text.as_bytes(), "cdr", Some("m1"));
    assert!(plan.expect("compiles").in_millimetres());
    for (body, position, occluded) in [
        ("m1", [100.0, 200.0, 300.0], false),
        ("arm/m1", [100.0, 200.0, 300.0], false),
        ("m2", [0.0; 3], true),
    ] {
        let rows = poses(ros2(Role::Pose, &sample, Some(body), &message));
        assert_eq!(rows.len(), 1);
        let row = rows.row(0);
        assert_eq!((row.stamp_ns, row.frame_id), (Some(100_000_000_200), "map"));
        assert_eq!((row.position, row.occluded, row.quaternion_xyzw), (position, occluded, None));
    }
    let several = ros2(Role::Pose, &sample, None, &message).expect_err("two markers");
    assert_eq!(several.to_string(), "several bodies on this channel, set `body` to one of: arm/m1, arm/m2");
}

#[test]
fn mocap_markers_go_by_name_or_number() {
    let message = hex(oracle::MOCAP_MARKERS);
    for (body, x) in [("led", 1.0), ("42", 2.0)] {
        let rows = poses(ros2(Role::Pose, &mocap_markers(), Some(body), &message));
        assert_eq!((rows.len(), rows.row(0).position), (1, [x; 3]));
        assert_eq!(rows.row(0).stamp_ns, Some(100_000_000_200));
    }
}

#[test]
fn rigid_bodies_skip_their_markers() {
    let message = hex(oracle::RIGID_BODIES);
    let expected =
        [("tool", [1.0, 2.0, 3.0], [0.0, 0.0, 1.0, 0.0]), ("table", [4.0, 5.0, 6.0], [0.0, 0.0, 0.0, 1.0])];
    for (body, position, quaternion) in expected {
        let rows = poses(ros2(Role::Pose, &rigid_bodies(), Some(body), &message));
        let row = rows.row(0);
        assert_eq!((rows.len(), row.body, row.frame_id), (1, body, "map"));
        assert_eq!((row.position, row.quaternion_xyzw), (position, Some(quaternion)));
    }
}

#[test]
fn vicon_position_is_one_body() {
    for body in [None, Some("seg"), Some("arm/seg")] {
        let rows = poses(ros2(Role::Pose, &vicon_position(), body, &hex(oracle::VICON_POSITION)));
        let row = rows.row(0);
        assert_eq!((row.body, row.position), ("arm/seg", [100.5, 200.5, 300.5]));
        assert_eq!(row.quaternion_xyzw, Some([0.0, 0.0, 0.0, 1.0]));
    }
}

#[test]
fn controllers_report_what_was_measured() {
    let rows = joints(ros2(Role::Joints, &dynamic_joint_state(), None, &hex(oracle::DYNAMIC_JOINT_STATE)));
    let row = rows.row(0);
    assert_eq!((&row.names[..], row.position), (&["a".to_owned(), "bb".to_owned()][..], &[1.0, 2.0][..]));
    assert_eq!(row.effort[0], 5.0);
    assert!(row.effort[1].is_nan(), "bb reports no effort");
    for old in [false, true] {
        let rows = joints(ros2(Role::Joints, &controller_state(old), None, &hex(oracle::CONTROLLER_STATE)));
        let row = rows.row(0);
        assert_eq!((row.position, row.effort), (&[1.0, 2.0][..], &[3.0, 4.0][..]));
        assert_eq!(row.stamp_ns, Some(100_000_000_200));
    }
}

#[test]
fn traps_of_the_definition_language_do_not_move_the_fields_behind_them() {
    let rows = scalars(ros2(Role::Scalar, &odd(), None, &hex(oracle::ODD)));
    assert_eq!((rows.stamp_ns[0], rows.value[0]), (None, 36.5));
}

#[test]
fn encoders_and_decoders_agree() {
    let header = encode::Header { stamp_ns: -1, frame_id: "welt-ä" };
    let run = |role, schema: encode::Schema, message: &[u8]| {
        let sample = Sample { schema: schema.name, text: schema.text.to_owned() };
        ros2(role, &sample, None, message)
    };
    let message = encode::joint_state(header, &["a", "ß"], &[1.0, f64::NAN], &[], &[2.0, -0.0]);
    let rows = joints(run(Role::Joints, encode::JOINT_STATE, &message));
    assert_eq!((rows.row(0).stamp_ns, rows.row(0).names[1].as_str()), (Some(-1), "ß"));
    assert!(rows.row(0).position[0] == 1.0 && rows.row(0).position[1].is_nan());
    assert_eq!(rows.row(0).effort, [2.0, -0.0]);

    let (p, q) = ([0.1, -0.2, 0.3], [0.4, 0.5, -0.6, 0.7]);
    let message = encode::pose_stamped(header, p, q);
    let rows = poses(run(Role::Pose, encode::POSE_STAMPED, &message));
    assert_eq!(
        (rows.row(0).frame_id, rows.row(0).position, rows.row(0).quaternion_xyzw),
        ("welt-ä", p, Some(q))
    );
    let message = encode::transform_stamped(header, "tip", p, q);
    let rows = poses(run(Role::Pose, encode::TRANSFORM_STAMPED, &message));
    assert_eq!((rows.row(0).body, rows.row(0).position, rows.row(0).quaternion_xyzw), ("tip", p, Some(q)));
    let rows = poses(run(Role::Pose, encode::POINT_STAMPED, &encode::point_stamped(header, p)));
    assert_eq!((rows.row(0).position, rows.row(0).quaternion_xyzw), (p, None));
    let rows = scalars(run(Role::Scalar, encode::TEMPERATURE, &encode::temperature(header, 21.5, 0.1)));
    assert_eq!((rows.stamp_ns[0], rows.value[0]), (Some(-1), 21.5));
}

/// The encoders give the bytes of rosbags, so that other programs read what the lab writes.
#[test]
fn encoders_agree_with_rosbags() {
    let header = |stamp_ns, frame_id| encode::Header { stamp_ns, frame_id };
    let base = header(1_700_000_000_123_456_789, "base");
    let joint =
        encode::joint_state(base, &["j1", "joint_2", "j3"], &[0.5, -1.25, 3.0], &[], &[10.0, 20.0, 30.0]);
    assert_eq!(joint, hex(oracle::JOINT_STATE));
    let vicon = header(1_700_000_000_000_000_005, "vicon");
    let pose = encode::pose_stamped(vicon, [1.5, 2.5, -3.5], [0.0, 0.6, 0.0, 0.8]);
    assert_eq!(pose, hex(oracle::POSE_STAMPED));
    let world = header(1_700_000_001_000_000_009, "world");
    let transform = encode::transform_stamped(world, "tip", [1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0]);
    assert_eq!(transform, hex(oracle::TRANSFORM_STAMPED));
    assert_eq!(
        encode::point_stamped(header(3_000_000_004, "lab"), [7.0, 8.0, 9.0]),
        hex(oracle::POINT_STAMPED)
    );
    assert_eq!(encode::temperature(header(12_000_000_013, "cell"), 23.25, 0.5), hex(oracle::TEMPERATURE));
}

#[test]
fn name_lists_are_shared_and_alternating_publishers_stay_apart() {
    let sample = joint_state();
    let plan = Plan::compile(Role::Joints, sample.schema, "ros2msg", sample.text.as_bytes(), "cdr", None);
    let plan = plan.expect("compiles");
    let mut rows = Rows::new(Role::Joints);
    let header = encode::Header { stamp_ns: 0, frame_id: "" };
    for i in 0..6 {
        let names: &[&str] = if i % 2 == 0 { &["a", "b"] } else { &["gripper"] };
        let position = vec![f64::from(i); names.len()];
        plan.decode(&encode::joint_state(header, names, &position, &[], &[]), &mut rows).expect("decodes");
    }
    let nothing: [&str; 0] = [];
    plan.decode(&encode::joint_state(header, &nothing, &[7.0], &[], &[]), &mut rows).expect("no names");
    plan.decode(&encode::joint_state(header, &["a"], &[], &[1.0], &[]), &mut rows)
        .expect("no positions: no row");
    let wrong = plan.decode(&encode::joint_state(header, &["a"], &[1.0, 2.0], &[], &[]), &mut rows);
    assert_eq!(wrong, Err(DecodeError::Lengths { positions: 2, others: 1, of: "names" }));
    let Rows::Joints(rows) = rows else { panic!("joints") };
    assert_eq!(rows.len(), 7);
    assert_eq!(rows.name_lists().len(), 3);
    assert!(std::sync::Arc::ptr_eq(rows.row(0).names, rows.row(4).names));
    assert_eq!((rows.row(3).names[0].as_str(), rows.row(3).position), ("gripper", &[3.0][..]));
    assert!(rows.row(6).names.is_empty());
    assert_eq!(rows.row(6).position, [7.0]);
}

#[test]
fn what_cannot_be_read_says_why() {
    let role =
        |schema, encoding, text: &str, message| readable_as(schema, encoding, text.as_bytes(), message);
    let idl = role("a/msg/B", "ros2idl", "", "cdr").expect_err("not supported").to_string();
    assert!(idl.contains("ros2idl") && idl.contains("ros2msg") && idl.contains("protobuf"), "{idl}");
    let image = role("sensor_msgs/msg/Image", "ros2msg", "uint32 width\nuint8[] pixels\n", "cdr");
    let image = image.expect_err("no shape").to_string();
    assert!(image.contains("width, pixels"), "{image}");
    let missing = role("a/msg/B", "ros2msg", "C c\nfloat64 temperature\n", "cdr").expect_err("C").to_string();
    assert!(missing.contains("line 1") && missing.contains("C"), "{missing}");
    let service =
        role("a/msg/B", "ros2msg", "int32 a\n---\nint32 b\n", "cdr").expect_err("service").to_string();
    assert!(service.contains("line 2") && service.contains("---"), "{service}");
    let cycle =
        role("a/B", "ros2msg", "a/B[] b\nfloat64 temperature\n", "cdr").expect_err("cycle").to_string();
    assert!(cycle.contains("contains itself"), "{cycle}");
    let wide =
        role("a/B", "ros2msg", "wstring w\nfloat64 temperature\n", "cdr").expect_err("wstring").to_string();
    assert!(wide.contains("wstring"), "{wide}");
    assert_eq!(role("a/B", "ros2msg", "float64 temperature\nwstring w\n", "cdr"), Ok(Role::Scalar));
    let sample = temperature();
    let other = Plan::compile(Role::Joints, sample.schema, "ros2msg", sample.text.as_bytes(), "cdr", None);
    let other = other.expect_err("another role").to_string();
    assert!(other.contains("holds temperature, not joints"), "{other}");
}

#[test]
fn every_vendor_schema_has_its_role() {
    let samples = [
        (Role::Joints, joint_state()),
        (Role::Joints, dynamic_joint_state()),
        (Role::Joints, controller_state(false)),
        (Role::Joints, controller_state(true)),
        (Role::Pose, pose_stamped()),
        (Role::Pose, transform_stamped()),
        (Role::Pose, point_stamped()),
        (Role::Pose, tf()),
        (Role::Pose, rigid_bodies()),
        (Role::Pose, mocap_markers()),
        (Role::Pose, vicon_markers()),
        (Role::Pose, vicon_position()),
        (Role::Scalar, temperature()),
    ];
    for (role, sample) in samples {
        let found = readable_as(sample.schema, "ros2msg", sample.text.as_bytes(), "cdr");
        assert_eq!(found, Ok(role), "{} as ROS 2", sample.schema);
        let sample = ros1_of(sample);
        let found = readable_as(sample.schema, "ros1msg", sample.text.as_bytes(), "ros1");
        assert_eq!(found, Ok(role), "{} as ROS 1", sample.schema);
    }
}

/// ROS 1 has `duration` where ROS 2 has `builtin_interfaces/Duration`.
fn ros1_of(sample: Sample) -> Sample {
    let sample = schemas::as_ros1(sample);
    Sample { text: sample.text.replace("builtin_interfaces/Duration", "duration"), ..sample }
}

/// A list says how long it is; the message must be long enough before anything is read or allocated.
#[test]
fn absurd_lengths_are_refused_at_once() {
    let mut message = hex(oracle::JOINT_STATE);
    // The count of names stands behind encapsulation 4, stamp 8, length 4, "base" and zero 5, padding 3.
    message[24..28].copy_from_slice(&[0xff; 4]);
    let error = ros2(Role::Joints, &joint_state(), None, &message).expect_err("too long");
    assert_eq!(error, DecodeError::Truncated { bytes: message.len(), at: 28, needed: 4 * 0xffff_ffff });
    let text = "E[4294967295] e\nE[] f\nfloat64[4294967295] x\nfloat64 temperature\n===\nMSG: a/E\n";
    let sample = Sample { schema: "a/B", text: text.to_owned() };
    let plan = Plan::compile(Role::Scalar, "a/B", "ros1msg", sample.text.as_bytes(), "ros1", None);
    let error = decode(&plan.expect("compiles"), &[0xff; 64]).expect_err("too long");
    assert!(matches!(error, DecodeError::Truncated { at: 4, .. }), "{error}");
}
