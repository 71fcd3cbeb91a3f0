//! JSON messages with their schemas.

use super::*;

/// The shape of foxglove-sdk's `JointStates.json`, descriptions left out.
const JOINT_STATES: &str = r#"{"title":"foxglove.JointStates","type":"object","properties":{
    "timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},
    "joints":{"type":"array","items":{"type":"object","title":"foxglove.JointState","properties":{
        "name":{"type":"string"},"position":{"type":"number"},"velocity":{"type":"number"},
        "effort":{"type":["number","null"]}}}}}}"#;

/// A ROS message as JSON, with references and a ROS 2 stamp.
const POSE_STAMPED: &str = r##"{"type":"object","properties":{"header":{"$ref":"#/$defs/Header"},
    "pose":{"type":"object","properties":{"position":{"$ref":"#/$defs/V"},"orientation":{"$ref":"#/$defs/Q"}}}},
    "$defs":{
    "Header":{"type":"object","properties":{"stamp":{"type":"object","properties":{"sec":{"type":"integer"},
        "nanosec":{"type":"integer"}}},"frame_id":{"type":"string"}}},
    "V":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},
    "Q":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},
        "w":{"type":"number"}}}}}"##;

fn plan(role: Role, schema: &str) -> Plan {
    Plan::compile(role, "any", "jsonschema", schema.as_bytes(), "json", None).expect("compiles")
}

#[test]
fn joint_states() {
    let message = br#"{"joints":[{"name":"a","position":0.5,"effort":null},{"name":"b","position":"NaN"},
        {"name":"c","position":-1e-3,"effort":2}],"timestamp":{"sec":1700000000,"nsec":123456789}}"#;
    let rows = joints(decode(&plan(Role::Joints, JOINT_STATES), message));
    let row = rows.row(0);
    assert_eq!(row.stamp_ns, Some(1_700_000_000_123_456_789));
    assert_eq!(&row.names[..], ["a", "b", "c"]);
    assert!(row.position[0] == 0.5 && row.position[1].is_nan() && row.position[2] == -1e-3);
    assert!(row.effort[0].is_nan() && row.effort[1].is_nan() && row.effort[2] == 2.0);
}

#[test]
fn poses_through_references() {
    let plan = plan(Role::Pose, POSE_STAMPED);
    let message = br#"{"header":{"stamp":{"sec":-1,"nanosec":5},"frame_id":"lab"},"pose":{"position":{"x":1,"y":2,"z":3},
        "orientation":{"x":0,"y":0.6,"z":0,"w":0.8}}}"#;
    let rows = poses(decode(&plan, message));
    let row = rows.row(0);
    assert_eq!((row.stamp_ns, row.frame_id), (Some(-999_999_995), "lab"));
    assert_eq!((row.position, row.quaternion_xyzw), ([1.0, 2.0, 3.0], Some([0.0, 0.6, 0.0, 0.8])));

    let short = decode(&plan, br#"{"pose":{"position":{"x":1,"y":2}}}"#).expect_err("no z").to_string();
    assert!(short.contains("complete position"), "{short}");
    let typed =
        decode(&plan, br#"{"pose":{"position":{"x":[1],"y":2,"z":3}}}"#).expect_err("a list").to_string();
    assert!(typed.contains("x should be a number, but is an array"), "{typed}");
    let cut = decode(&plan, &message[..50]).expect_err("cut off");
    assert!(matches!(cut, DecodeError::Malformed { encoding: "json", .. }), "{cut}");
}

/// Fields of several names that only quotes can tell apart, in another order than that of the message; one is missing.
#[test]
fn a_number_for_each_joint_comes_in_the_order_of_the_paths() {
    let schema = r#"{"type":"object","properties":{"timestamp":{"type":"object","properties":{"sec":{"type":"integer"},
        "nsec":{"type":"integer"}}},"a.pos":{"type":"number"},"a":{"type":"object","properties":{"pos":{"type":"number"},
        "it's":{"type":"number"}}},"q[]":{"type":"number"},"w.x":{"type":"object","properties":{"q":{"type":"number"}}}}}"#;
    let read = |paths: &[&str], message: &[u8]| {
        let fields: Vec<(Place, &str)> = paths.iter().map(|path| (Place::Positions, *path)).collect();
        let plan = Plan::at(Role::Joints, "any", "jsonschema", schema.as_bytes(), "json", (None, &fields))?;
        decode(&plan, message)
    };
    let message =
        br#"{"timestamp":{"sec":1,"nsec":2},"a.pos":1,"a":{"pos":2,"it's":3},"q[]":4,"w.x":{"q":5}}"#;
    let paths = ["w.x.q", "'q[]'", "a.'it''s'", "a.pos", "'a.pos'"];
    let rows = joints(read(&paths, message));
    assert_eq!(
        (rows.row(0).position, rows.row(0).stamp_ns),
        (&[5.0, 4.0, 3.0, 2.0, 1.0][..], Some(1_000_000_002))
    );
    let rows = joints(read(&["'q[]'", "'a.pos'"], br#"{"a.pos":1,"q[]":null}"#));
    assert!(rows.row(0).position[0].is_nan() && rows.row(0).position[1] == 1.0);
    assert!(joints(read(&["'q[]'", "'a.pos'"], b"{}")).is_empty());
    let refused = read(&["'q[]'", "'a.poss'"], message).expect_err("nowhere").to_string();
    assert!(refused.contains("did you mean \"'a.pos'\"?") && refused.contains("a.'it''s'"), "{refused}");
    // All of a message are in the order of its definition, whatever they are called.
    assert_eq!(joints(read(&["*"], message)).row(0).position, [1.0, 4.0]);
    assert_eq!(joints(read(&["a.*"], message)).row(0).position, [2.0, 3.0]);
}

/// vicon_bridge appends the markers that no subject owns, without names.
#[test]
fn unlabelled_markers_are_not_a_body() {
    let schema = r#"{"type":"object","properties":{"markers":{"type":"array","items":{"type":"object","properties":{
        "marker_name":{"type":"string"},"subject_name":{"type":"string"},"occluded":{"type":"boolean"},
        "translation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},
        "z":{"type":"number"}}}}}}}}"#;
    let marker = |name: &str, subject: &str| {
        format!(
            r#"{{"marker_name":"{name}","subject_name":"{subject}","occluded":false,"translation":{{"x":1,"y":2,"z":3}}}}"#
        )
    };
    let plan = plan(Role::Pose, schema);
    let message = format!(r#"{{"markers":[{},{},{}]}}"#, marker("", ""), marker("m1", "arm"), marker("", ""));
    let rows = poses(decode(&plan, message.as_bytes()));
    assert_eq!((rows.len(), rows.row(0).body, rows.bodies()), (1, "arm/m1", vec!["arm/m1"]));
}

#[test]
fn schemas_that_go_in_circles_are_refused() {
    let list = r##"{"type":"object","properties":{"a":{"$ref":"#/$defs/a"}},
        "$defs":{"a":{"type":"array","items":{"$ref":"#/$defs/a"}}}}"##;
    for schema in [list, r##"{"$ref":"#"}"##, "[]", "1", "{", ""] {
        let found = readable_as("any", "jsonschema", schema.as_bytes(), "json");
        assert!(matches!(found, Err(DecodeError::Schema { .. })), "{schema}: {found:?}");
    }
    // An object that holds itself is sound.
    let tree = r##"{"type":"object","properties":{"temperature":{"type":"number"},"child":{"$ref":"#"}}}"##;
    assert_eq!(readable_as("any", "jsonschema", tree.as_bytes(), "json"), Ok(Role::Scalar));
}
