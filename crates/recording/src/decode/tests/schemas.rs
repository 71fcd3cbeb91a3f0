//! Schema texts as recordings carry them, traps included.

/// One message type of the corpus.
pub(super) struct Sample {
    pub(super) schema: &'static str,
    pub(super) text: String,
}

const SEPARATOR: &str = "================================================================================";

/// Joins definitions the way rosbag2 and rosbag do: the message first, then `MSG:` sections.
fn join(schema: &'static str, root: &str, used: &[(&str, &str)]) -> Sample {
    let mut text = root.to_owned();
    for (name, definition) in used {
        text += &format!("\n{SEPARATOR}\nMSG: {name}\n{definition}");
    }
    Sample { schema, text }
}

const HEADER: (&str, &str) = (
    "std_msgs/Header",
    "# Standard metadata for higher-level stamped data types.\n# This is generally used to communicate timestamped data\n\
     # in a particular coordinate frame.\n\n# Two-integer timestamp that is expressed as seconds and nanoseconds.\n\
     builtin_interfaces/Time stamp\n\n# Transform frame with which this data is associated.\nstring frame_id\n",
);
const TIME: (&str, &str) = (
    "builtin_interfaces/Time",
    "# Time indicates a specific point in time, relative to a clock's 0 point.\n\n\
     # The seconds component, valid over all int32 values.\nint32 sec\n\n\
     # The nanoseconds component, valid in the range [0, 1e9).\nuint32 nanosec\n",
);
const DURATION: (&str, &str) = ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n");
const HEADER_ROS1: (&str, &str) = (
    "std_msgs/Header",
    "# sequence ID: consecutively increasing ID \nuint32 seq\n#Two-integer timestamp that is expressed as:\n\
     time stamp\n#Frame this data is associated with\nstring frame_id\n",
);
const POINT: (&str, &str) =
    ("geometry_msgs/Point", "# This contains the position of a point\nfloat64 x\nfloat64 y\nfloat64 z\n");
const VECTOR: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z");
const QUATERNION: (&str, &str) =
    ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n");
const POSE: (&str, &str) =
    ("geometry_msgs/Pose", "# A representation of pose\n\nPoint position\nQuaternion orientation\n");
const TRANSFORM: (&str, &str) = ("geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n");
const TRANSFORM_STAMPED: &str = "# https://wiki.ros.org/tf\nstd_msgs/Header header\n\nstring child_frame_id\n\n# Translation and rotation\nTransform transform\n";
const JOINT_STATE: &str = "# This is a message that holds data to describe the state of a set of torque controlled joints.\n#\n\
     # * the position of the joint (rad or m),\n\nstd_msgs/Header header\n\nstring[] name\nfloat64[] position\n\
     float64[] velocity\nfloat64[] effort\n";

/// `sensor_msgs/msg/JointState`.
pub(super) fn joint_state() -> Sample {
    join("sensor_msgs/msg/JointState", JOINT_STATE, &[HEADER, TIME])
}

/// `geometry_msgs/msg/PoseStamped`.
pub(super) fn pose_stamped() -> Sample {
    join(
        "geometry_msgs/msg/PoseStamped",
        "std_msgs/Header header\nPose pose",
        &[HEADER, TIME, POSE, POINT, QUATERNION],
    )
}

/// `geometry_msgs/msg/TransformStamped`.
pub(super) fn transform_stamped() -> Sample {
    let used = [HEADER, TIME, TRANSFORM, VECTOR, QUATERNION];
    join("geometry_msgs/msg/TransformStamped", TRANSFORM_STAMPED, &used)
}

/// `geometry_msgs/msg/PointStamped`.
pub(super) fn point_stamped() -> Sample {
    join("geometry_msgs/msg/PointStamped", "std_msgs/Header header\nPoint point\n", &[HEADER, TIME, POINT])
}

/// `sensor_msgs/msg/Temperature`, with a schema name that lacks `/msg/`.
pub(super) fn temperature() -> Sample {
    let root = "std_msgs/Header header # timestamp\n\nfloat64 temperature     # in Degrees Celsius.\n\nfloat64 variance        # 0 is interpreted as variance unknown.\n";
    join("sensor_msgs/Temperature", root, &[HEADER, TIME])
}

/// `tf2_msgs/msg/TFMessage`.
pub(super) fn tf() -> Sample {
    join(
        "tf2_msgs/msg/TFMessage",
        "geometry_msgs/TransformStamped[] transforms\n",
        &[("geometry_msgs/TransformStamped", TRANSFORM_STAMPED), HEADER, TIME, TRANSFORM, VECTOR, QUATERNION],
    )
}

/// `vicon_bridge/msg/Markers`.
pub(super) fn vicon_markers() -> Sample {
    let marker = "string marker_name\nstring subject_name\nstring segment_name\ngeometry_msgs/Point translation\nbool occluded\n";
    join(
        "vicon_bridge/msg/Markers",
        "Header header\nuint32 frame_number # Vicon Frame Number\nvicon_bridge/Marker[] markers # Array of Markers\n",
        &[HEADER, TIME, ("vicon_bridge/Marker", marker), POINT],
    )
}

const MOCAP_MARKER: (&str, &str) = (
    "mocap4r2_msgs/Marker",
    "int8 USE_NAME=0\nint8 USE_INDEX = 1\nint8 USE_BOTH=2  # both\n\nint8 id_type\nint32 marker_index\nstring marker_name\n\
     geometry_msgs/Point translation\n",
);

/// `mocap4r2_msgs/msg/Markers`.
pub(super) fn mocap_markers() -> Sample {
    let root = "std_msgs/Header header\nuint32 frame_number\nmocap4r2_msgs/Marker[] markers\n";
    join("mocap4r2_msgs/msg/Markers", root, &[HEADER, TIME, MOCAP_MARKER, POINT])
}

/// `mocap4r2_msgs/msg/RigidBodies`.
pub(super) fn rigid_bodies() -> Sample {
    let body =
        ("mocap4r2_msgs/RigidBody", "string rigid_body_name\nMarker[] markers\ngeometry_msgs/Pose pose\n");
    let root = "std_msgs/Header header\nuint32 frame_number\nmocap4r2_msgs/RigidBody[] rigidbodies\n";
    let used = [HEADER, TIME, body, MOCAP_MARKER, POSE, POINT, QUATERNION];
    join("mocap4r2_msgs/msg/RigidBodies", root, &used)
}

/// `vicon_receiver/msg/Position`.
pub(super) fn vicon_position() -> Sample {
    let root = "std_msgs/Header header\nfloat32 x_trans \nfloat32 y_trans\nfloat32 z_trans\n\
         float32 x_rot #first element of the quaternion\nfloat32 y_rot\nfloat32 z_rot\n\
         float32 w #forth element of the quaternion\nstring segment_name\nstring subject_name\n\
         int32 frame_number\nstring translation_type #Local or Global\n";
    join("vicon_receiver/msg/Position", root, &[HEADER, TIME])
}

/// `control_msgs/msg/DynamicJointState`.
pub(super) fn dynamic_joint_state() -> Sample {
    join(
        "control_msgs/msg/DynamicJointState",
        "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n",
        &[HEADER, TIME, ("control_msgs/InterfaceValue", "string[] interface_names\nfloat64[] values\n")],
    )
}

/// `control_msgs/msg/JointTrajectoryControllerState` since 2023; `old` as before.
pub(super) fn controller_state(old: bool) -> Sample {
    let (reference, feedback) = if old { ("desired", "actual") } else { ("reference", "feedback") };
    let point = "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\nbuiltin_interfaces/Duration time_from_start\n";
    let root = format!(
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint {reference}\n\
         trajectory_msgs/JointTrajectoryPoint {feedback}\ntrajectory_msgs/JointTrajectoryPoint error\n"
    );
    join(
        "control_msgs/msg/JointTrajectoryControllerState",
        &root,
        &[HEADER, TIME, ("trajectory_msgs/JointTrajectoryPoint", point), DURATION],
    )
}

/// Bounded texts and lists, fixed lists, empty messages (constants only), a default value, `int64` after one byte.
pub(super) fn odd() -> Sample {
    let root = "string SEPARATOR=#not a comment\nstring<=10[<=4] labels [\"#a\", \"b\"]\r\nfloat64[3] fixed\nEmpty nothing\nodd_msgs/msg/Empty[2] more\n\
         int8 a -1\nint64 b\nuint16[] w\nfloat32 temperature 20.5\n";
    join("odd_msgs/msg/Odd", root, &[("odd_msgs/Empty", "uint8 ONLY=1\n")])
}

/// The same message type as ROS 1 recordings define it.
pub(super) fn as_ros1(sample: Sample) -> Sample {
    let mut text = String::new();
    for (i, section) in sample.text.split(&format!("{SEPARATOR}\n")).enumerate() {
        if section.starts_with("MSG: builtin_interfaces/") {
            continue;
        }
        if i > 0 {
            text += SEPARATOR;
            text.push('\n');
        }
        if section.starts_with("MSG: std_msgs/Header") {
            text += &format!("MSG: {}\n{}\n", HEADER_ROS1.0, HEADER_ROS1.1);
        } else {
            text += &section.replace("std_msgs/Header header", "Header header");
        }
    }
    Sample { schema: sample.schema, text }
}
