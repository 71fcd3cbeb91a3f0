//! Fields that the user names by their paths, and lists of poses without names.

use super::*;
use crate::foreign::definition_of;

/// Some fields of Franka's state, as `franka_msgs` names them.
const ROBOT: &str = "std_msgs/Header header\ngeometry_msgs/PoseStamped o_t_ee\nuint8 robot_mode\n\
     sensor_msgs/JointState measured_joint_state\nfloat64[7] measured_torque\n";
const KUKA: &str = "std_msgs/Header header\nJointQuantity position\n";
const QUANTITY: &str = "float32 a1\nfloat32 a2\nfloat32 a3\n";

/// A definition with those it uses, which are known or given.
fn with(root: &str, used: &[(&str, &str)]) -> String {
    let known = ["geometry_msgs/PoseStamped", "sensor_msgs/JointState", "std_msgs/Header"];
    let known = known.map(|name| (name, definition_of(name).expect("known")));
    let all = known.iter().map(|(name, text)| (*name, text.as_str())).chain(used.iter().copied());
    all.fold(root.to_owned(), |text, (name, own)| format!("{text}{}\nMSG: {name}\n{own}", "=".repeat(80)))
}

fn at(
    role: Role,
    text: &str,
    body: Option<&str>,
    fields: &[(Place, &str)],
    message: &str,
) -> Result<Rows, DecodeError> {
    let plan =
        Plan::at(role, "lab_msgs/msg/State", "ros2msg", text.as_bytes(), "cdr", (body, fields))?.exact();
    decode(&plan, &hex(message))
}

fn known(role: Role, name: &'static str, body: Option<&str>, message: &str) -> Result<Rows, DecodeError> {
    let sample = Sample { schema: name, text: definition_of(name).expect("known") };
    ros2(role, &sample, body, &hex(message))
}

#[test]
fn a_state_of_a_vendor_is_read_by_the_paths_of_its_fields() {
    let text = with(ROBOT, &[]);
    let fields = [(Place::Positions, "measured_joint_state.position[]")];
    let rows = joints(at(Role::Joints, &text, None, &fields, oracle::FRANKA));
    let row = rows.row(0);
    assert_eq!((row.position, row.names.len(), row.stamp_ns), (&[0.25, 0.5][..], 0, Some(100_000_000_200)));

    let names = (Place::Names, "measured_joint_state.name[]");
    let fields = [fields[0], names, (Place::Efforts, "measured_joint_state.effort[]")];
    let rows = joints(at(Role::Joints, &text, None, &fields, oracle::FRANKA));
    assert_eq!(rows.row(0).names[..], ["a".to_owned(), "bb".to_owned()]);
    assert_eq!(rows.row(0).effort, [7.0, 8.0]);

    let fields = [(Place::Positions, "measured_torque[]")];
    let rows = joints(at(Role::Joints, &text, None, &fields, oracle::FRANKA));
    assert_eq!(rows.row(0).position, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);

    // The frame is that of the pose's own header, the stamp that of the message.
    let fields = [(Place::Position, "o_t_ee.pose.position"), (Place::Orientation, "o_t_ee.pose.orientation")];
    let rows = poses(at(Role::Pose, &text, None, &fields, oracle::FRANKA));
    let row = rows.row(0);
    assert_eq!((row.frame_id, row.position, row.stamp_ns), ("base", [1.0, 2.0, 3.0], Some(100_000_000_200)));
    assert_eq!(row.quaternion_xyzw, Some([0.0, 0.0, 0.0, 1.0]));

    let text = with(KUKA, &[("lab_msgs/JointQuantity", QUANTITY)]);
    let rows = joints(at(Role::Joints, &text, None, &[(Place::Positions, "position.*")], oracle::KUKA));
    assert_eq!(rows.row(0).position, [1.0, 2.0, 3.0]);

    let (name, data) = ("std_msgs/msg/Float64MultiArray", [(Place::Positions, "data[]")]);
    let text = definition_of(name).expect("known");
    let plan =
        Plan::at(Role::Joints, name, "ros2msg", text.as_bytes(), "cdr", (None, &data)).expect("compiles");
    let rows = joints(decode(&plan.exact(), &hex(oracle::MULTI_ARRAY)));
    assert_eq!((rows.row(0).position, rows.row(0).stamp_ns), (&[0.25, 0.5][..], None));
}

#[test]
fn a_path_that_leads_nowhere_names_the_nearest_that_does() {
    let text = with(ROBOT, &[]);
    for (place, path, nearest) in [
        (Place::Positions, "measured_joint_state.positions[]", "measured_joint_state.position[]"),
        (Place::Positions, "measured_joint_state.position", "measured_joint_state.position[]"),
        (Place::Names, "joint_state.name[]", "measured_joint_state.name[]"),
        (Place::Position, "o_t_ee.position", "o_t_ee.pose.position"),
        (Place::Positions, "o_t_e.*", "o_t_ee"),
    ] {
        let role = if place == Place::Position { Role::Pose } else { Role::Joints };
        let error = at(role, &text, None, &[(place, path)], oracle::FRANKA).expect_err("nowhere").to_string();
        assert!(error.contains(path) && error.contains(nearest), "{error}");
    }
}

#[test]
fn messages_longer_or_shorter_than_their_definition_are_told() {
    let fields = [(Place::Positions, "measured_joint_state.position[]")];
    let short = with(&ROBOT.replace("float64[7] measured_torque\n", ""), &[]);
    let long = with(&ROBOT.replace("float64[7]", "float64[8]"), &[]);
    let error = at(Role::Joints, &short, None, &fields, oracle::FRANKA).expect_err("left over");
    assert_eq!(error, DecodeError::LeftOver { bytes: hex(oracle::FRANKA).len(), left: 56 });
    let error = at(Role::Joints, &long, None, &fields, oracle::FRANKA).expect_err("cut");
    assert!(matches!(error, DecodeError::Truncated { .. }), "{error}");
    // Up to three bytes of padding are none that is left over.
    let padded = oracle::FRANKA.to_owned() + "000000";
    assert!(at(Role::Joints, &with(ROBOT, &[]), None, &fields, &padded).is_ok());
    assert!(at(Role::Joints, &with(ROBOT, &[]), None, &fields, &(padded + "00")).is_err());
}

#[test]
fn poses_of_a_list_are_told_by_their_places() {
    let array = "geometry_msgs/msg/PoseArray";
    for (body, position) in [("0", [1.0, 2.0, 3.0]), ("1", [4.0, 5.0, 6.0])] {
        let rows = poses(known(Role::Pose, array, Some(body), oracle::POSE_ARRAY));
        assert_eq!((rows.len(), rows.row(0).position, rows.row(0).body), (1, position, body));
        assert_eq!((rows.row(0).frame_id, rows.row(0).stamp_ns), ("map", Some(100_000_000_200)));
    }
    let several = known(Role::Pose, array, None, oracle::POSE_ARRAY).expect_err("several");
    assert_eq!(several, DecodeError::SeveralBodies { bodies: vec!["0".into(), "1".into()] });
    assert!(poses(known(Role::Pose, array, Some("2"), oracle::POSE_ARRAY)).is_empty());

    let rows = poses(known(Role::Pose, "geometry_msgs/msg/Pose", None, oracle::BARE_POSE));
    assert_eq!((rows.row(0).position, rows.row(0).stamp_ns), ([4.0, 5.0, 6.0], None));
}

#[test]
fn a_body_with_two_parents_has_two_rows() {
    let rows = poses(known(Role::Pose, "tf2_msgs/msg/TFMessage", Some("tip"), oracle::TWO_PARENTS));
    let of: Vec<(&str, f64)> = rows.rows().map(|row| (row.frame_id, row.position[0])).collect();
    assert_eq!(of, [("map", 1.0), ("base", 2.0)]);
}
