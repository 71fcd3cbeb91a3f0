//! Definitions of ROS messages for databases that do not hold them (rosbag2 before Iron) and files that hold only part of them.

/// A message type and its own definition.
pub(crate) const TYPES: &[(&str, &str)] = &[
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
    (
        "control_msgs/DynamicJointState",
        "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values\n",
    ),
    ("control_msgs/InterfaceValue", "string[] interface_names\nfloat64[] values\n"),
    ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"),
    ("geometry_msgs/PointStamped", "std_msgs/Header header\nPoint point\n"),
    ("geometry_msgs/Pose", "Point position\nQuaternion orientation\n"),
    ("geometry_msgs/PoseArray", "std_msgs/Header header\nPose[] poses\n"),
    ("geometry_msgs/PoseStamped", "std_msgs/Header header\nPose pose\n"),
    ("geometry_msgs/PoseWithCovariance", "Pose pose\nfloat64[36] covariance\n"),
    ("geometry_msgs/PoseWithCovarianceStamped", "std_msgs/Header header\nPoseWithCovariance pose\n"),
    ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"),
    ("geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n"),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\nTransform transform\n",
    ),
    ("geometry_msgs/Twist", "Vector3 linear\nVector3 angular\n"),
    ("geometry_msgs/TwistWithCovariance", "Twist twist\nfloat64[36] covariance\n"),
    ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"),
    (
        "mocap4r2_msgs/Marker",
        "int8 id_type\nint32 marker_index\nstring marker_name\ngeometry_msgs/Point translation\n",
    ),
    ("mocap4r2_msgs/Markers", "std_msgs/Header header\nuint32 frame_number\nMarker[] markers\n"),
    ("mocap4r2_msgs/RigidBodies", "std_msgs/Header header\nuint32 frame_number\nRigidBody[] rigidbodies\n"),
    ("mocap4r2_msgs/RigidBody", "string rigid_body_name\nMarker[] markers\ngeometry_msgs/Pose pose\n"),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n\
         geometry_msgs/TwistWithCovariance twist\n",
    ),
    (
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
    ),
    ("sensor_msgs/Temperature", "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n"),
    ("std_msgs/Float32", "float32 data\n"),
    ("std_msgs/Float32MultiArray", "MultiArrayLayout layout\nfloat32[] data\n"),
    ("std_msgs/Float64", "float64 data\n"),
    ("std_msgs/Float64MultiArray", "MultiArrayLayout layout\nfloat64[] data\n"),
    ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"),
    ("std_msgs/MultiArrayDimension", "string label\nuint32 size\nuint32 stride\n"),
    ("std_msgs/MultiArrayLayout", "MultiArrayDimension[] dim\nuint32 data_offset\n"),
    ("std_msgs/String", "string data\n"),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"),
];

/// The definition of a message type, such as `sensor_msgs/msg/JointState`, with all that it uses, in the `ros2msg` format
/// of MCAP; `None` if the type is not known here.
pub(crate) fn full_text(name: &str) -> Option<String> {
    text_with(name, own_text)
}

/// The same of ROS 1, in its `ros1msg` format: only the header is another.
pub(crate) fn ros1_text(name: &str) -> Option<String> {
    text_with(name, |name| match name {
        "std_msgs/Header" => Some("uint32 seq\ntime stamp\nstring frame_id\n"),
        _ => own_text(name),
    })
}

fn text_with(name: &str, own_text: fn(&str) -> Option<&'static str>) -> Option<String> {
    let root = name.replace("::", "/").replacen("/msg/", "/", 1);
    let mut text = own_text(&root)?.to_owned();
    let mut used = vec![root];
    let mut at = 0;
    while at < used.len() {
        let package = used[at].split_once('/').map_or("", |(package, _)| package).to_owned();
        for line in own_text(&used[at]).unwrap_or_default().lines() {
            let kind = line.split([' ', '[']).next().unwrap_or_default();
            let full = if kind.contains('/') { kind.to_owned() } else { format!("{package}/{kind}") };
            if let Some(definition) = own_text(&full).filter(|_| !used.contains(&full)) {
                text += &format!("{}\nMSG: {full}\n{definition}", "=".repeat(80));
                used.push(full);
            }
        }
        at += 1;
    }
    Some(text)
}

fn own_text(name: &str) -> Option<&'static str> {
    TYPES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
