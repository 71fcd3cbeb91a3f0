//! Encoders of the ROS 2 messages a calibration rig records, with their schema texts.
//!
//! Plain CDR, little-endian, as every ROS 2 middleware writes it: a 4-byte encapsulation header, then the fields in
//! order, each primitive aligned to its own size counted from the end of that header (OMG DDSI-RTPS 2.5, 10.2;
//! CORBA 3.3 part 2, 9.3). Written without the decoders of this crate, so that each tests the other.

/// Message encoding of everything here.
pub const MESSAGE_ENCODING: &str = "cdr";

/// Schema encoding of everything here.
pub const SCHEMA_ENCODING: &str = "ros2msg";

/// A message type: its name and the text of its definition with all definitions it uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Schema {
    /// Full name, such as `sensor_msgs/msg/JointState`.
    pub name: &'static str,
    /// Text in the `ros2msg` format of MCAP.
    pub text: &'static str,
}

macro_rules! separator {
    () => {
        "================================================================================\n"
    };
}

macro_rules! header_definition {
    () => {
        concat!(
            separator!(),
            "MSG: std_msgs/Header\n",
            "builtin_interfaces/Time stamp\n",
            "string frame_id\n",
            separator!(),
            "MSG: builtin_interfaces/Time\n",
            "int32 sec\n",
            "uint32 nanosec\n",
        )
    };
}

macro_rules! xyz_definition {
    ($name:literal) => {
        concat!(separator!(), "MSG: geometry_msgs/", $name, "\n", "float64 x\n", "float64 y\n", "float64 z\n")
    };
}

macro_rules! quaternion_definition {
    () => {
        concat!(
            separator!(),
            "MSG: geometry_msgs/Quaternion\n",
            "float64 x 0\n",
            "float64 y 0\n",
            "float64 z 0\n",
            "float64 w 1\n",
        )
    };
}

/// `sensor_msgs/msg/JointState`, see [`joint_state`].
pub const JOINT_STATE: Schema = Schema {
    name: "sensor_msgs/msg/JointState",
    text: concat!(
        "std_msgs/Header header\n",
        "string[] name\n",
        "float64[] position\n",
        "float64[] velocity\n",
        "float64[] effort\n",
        header_definition!(),
    ),
};

/// `geometry_msgs/msg/PoseStamped`, see [`pose_stamped`].
pub const POSE_STAMPED: Schema = Schema {
    name: "geometry_msgs/msg/PoseStamped",
    text: concat!(
        "std_msgs/Header header\n",
        "Pose pose\n",
        header_definition!(),
        separator!(),
        "MSG: geometry_msgs/Pose\n",
        "Point position\n",
        "Quaternion orientation\n",
        xyz_definition!("Point"),
        quaternion_definition!(),
    ),
};

/// `geometry_msgs/msg/TransformStamped`, see [`transform_stamped`].
pub const TRANSFORM_STAMPED: Schema = Schema {
    name: "geometry_msgs/msg/TransformStamped",
    text: concat!(
        "std_msgs/Header header\n",
        "string child_frame_id\n",
        "Transform transform\n",
        header_definition!(),
        separator!(),
        "MSG: geometry_msgs/Transform\n",
        "Vector3 translation\n",
        "Quaternion rotation\n",
        xyz_definition!("Vector3"),
        quaternion_definition!(),
    ),
};

/// `geometry_msgs/msg/PointStamped`, see [`point_stamped`].
pub const POINT_STAMPED: Schema = Schema {
    name: "geometry_msgs/msg/PointStamped",
    text: concat!(
        "std_msgs/Header header\n",
        "Point point\n",
        header_definition!(),
        xyz_definition!("Point")
    ),
};

/// `sensor_msgs/msg/Temperature`, see [`temperature`].
pub const TEMPERATURE: Schema = Schema {
    name: "sensor_msgs/msg/Temperature",
    text: concat!(
        "std_msgs/Header header\n",
        "float64 temperature\n",
        "float64 variance\n",
        header_definition!(),
    ),
};

/// `std_msgs/msg/Float64`, see [`float64`].
pub const FLOAT64: Schema = Schema { name: "std_msgs/msg/Float64", text: "float64 data\n" };

/// `std_msgs/msg/Header`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header<'a> {
    /// Stamp [ns]. ROS 2 holds its seconds in an `int32`; later stamps than 2038-01-19 are clamped there.
    pub stamp_ns: i64,
    /// Frame the data is expressed in.
    pub frame_id: &'a str,
}

/// Encodes a joint state. Each of the lists is either empty or has one element a joint.
pub fn joint_state<N: AsRef<str>>(
    header: Header<'_>,
    names: &[N],
    position: &[f64],
    velocity: &[f64],
    effort: &[f64],
) -> Vec<u8> {
    let mut cdr = Cdr::new(&header);
    cdr.u32(names.len() as u32);
    for name in names {
        cdr.text(name.as_ref());
    }
    for list in [position, velocity, effort] {
        cdr.u32(list.len() as u32);
        cdr.f64s(list);
    }
    cdr.bytes
}

/// Encodes a pose: position [m] and orientation x, y, z, w.
pub fn pose_stamped(header: Header<'_>, position_m: [f64; 3], quaternion_xyzw: [f64; 4]) -> Vec<u8> {
    let mut cdr = Cdr::new(&header);
    cdr.f64s(&position_m);
    cdr.f64s(&quaternion_xyzw);
    cdr.bytes
}

/// Encodes a transform from the child frame to the header's frame: translation [m] and rotation x, y, z, w.
pub fn transform_stamped(
    header: Header<'_>,
    child_frame_id: &str,
    translation_m: [f64; 3],
    quaternion_xyzw: [f64; 4],
) -> Vec<u8> {
    let mut cdr = Cdr::new(&header);
    cdr.text(child_frame_id);
    cdr.f64s(&translation_m);
    cdr.f64s(&quaternion_xyzw);
    cdr.bytes
}

/// Encodes a point [m].
pub fn point_stamped(header: Header<'_>, point_m: [f64; 3]) -> Vec<u8> {
    let mut cdr = Cdr::new(&header);
    cdr.f64s(&point_m);
    cdr.bytes
}

/// Encodes a temperature [degC] and its variance [degC^2], 0 when unknown.
pub fn temperature(header: Header<'_>, temperature_c: f64, variance_c2: f64) -> Vec<u8> {
    let mut cdr = Cdr::new(&header);
    cdr.f64s(&[temperature_c, variance_c2]);
    cdr.bytes
}

/// Encodes one number.
pub fn float64(value: f64) -> Vec<u8> {
    let mut cdr = Cdr { bytes: vec![0, 1, 0, 0] };
    cdr.f64s(&[value]);
    cdr.bytes
}

/// A CDR message while it is written.
struct Cdr {
    bytes: Vec<u8>,
}

impl Cdr {
    /// Encapsulation header (CDR, little-endian, no options), then the message header.
    fn new(header: &Header<'_>) -> Cdr {
        let mut cdr = Cdr { bytes: vec![0, 1, 0, 0] };
        let seconds = header.stamp_ns.div_euclid(1_000_000_000);
        let seconds = i32::try_from(seconds).unwrap_or(if seconds < 0 { i32::MIN } else { i32::MAX });
        cdr.bytes.extend_from_slice(&seconds.to_le_bytes());
        cdr.u32(header.stamp_ns.rem_euclid(1_000_000_000) as u32);
        cdr.text(header.frame_id);
        cdr
    }

    /// Pads with zeros to a multiple of `size` behind the encapsulation header.
    fn align(&mut self, size: usize) {
        let length = 4 + (self.bytes.len() - 4).next_multiple_of(size);
        self.bytes.resize(length, 0);
    }

    fn u32(&mut self, value: u32) {
        self.align(4);
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    /// Length with the terminating zero, the bytes, the zero.
    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
    }

    fn f64s(&mut self, values: &[f64]) {
        if !values.is_empty() {
            self.align(8);
        }
        for value in values {
            self.bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: encapsulation; sec 1, nanosec 2; "ab" and its zero, 15 bytes in; one of padding; two doubles.
    #[test]
    fn temperature_is_laid_out_as_by_hand() {
        let bytes = temperature(Header { stamp_ns: 1_000_000_002, frame_id: "ab" }, 1.0, -2.0);
        let expected: Vec<u8> = [
            &[0, 1, 0, 0][..],
            &[1, 0, 0, 0, 2, 0, 0, 0],
            &[3, 0, 0, 0, b'a', b'b', 0],
            &[0],
            &[0, 0, 0, 0, 0, 0, 0xf0, 0x3f],
            &[0, 0, 0, 0, 0, 0, 0, 0xc0],
        ]
        .concat();
        assert_eq!(bytes, expected);
    }

    /// An empty list is its count alone, without padding for elements that do not follow.
    #[test]
    fn empty_lists_are_not_padded() {
        let bytes = joint_state::<&str>(Header { stamp_ns: 0, frame_id: "" }, &[], &[], &[], &[]);
        // 4 + stamp 8 + length 4 + zero 1 + padding 3 + four counts.
        assert_eq!(bytes.len(), 4 + 8 + 4 + 1 + 3 + 16);
    }

    #[test]
    fn stamps_before_1970_and_after_2038_stay_in_range() {
        let seconds = |stamp_ns| {
            let bytes = point_stamped(Header { stamp_ns, frame_id: "" }, [0.0; 3]);
            i32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]])
        };
        assert_eq!(seconds(-1), -1);
        assert_eq!(seconds(i64::MAX), i32::MAX);
        assert_eq!(seconds(i64::MIN), i32::MIN);
    }
}
