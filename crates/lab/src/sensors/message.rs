//! Messages before they are encoded.

use nalgebra::{Quaternion, Vector3};

/// What a channel carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `sensor_msgs/msg/JointState`.
    JointState,
    /// `geometry_msgs/msg/PoseStamped`.
    PoseStamped,
    /// `geometry_msgs/msg/TransformStamped`.
    TransformStamped,
    /// `sensor_msgs/msg/Temperature`.
    Temperature,
    /// `std_msgs/msg/Float64`, which has no header.
    Float64,
}

/// One channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// Topic.
    pub topic: String,
    /// What it carries.
    pub kind: Kind,
    /// `frame_id` of its headers.
    pub frame_id: String,
    /// Joint names, or the name of the tracked body.
    pub names: Vec<String>,
}

/// One message.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Index of its channel.
    pub channel: usize,
    /// Its number on the channel.
    pub sequence: u32,
    /// Header stamp, on the clock of the machine that made it [ns].
    pub stamp_ns: i64,
    /// Log time, on the clock of the robot's computer [ns].
    pub log_ns: i64,
    /// What it says.
    pub payload: Payload,
}

/// What a message says.
#[derive(Debug, Clone, PartialEq)]
pub enum Payload {
    /// Joint state.
    Joints {
        /// Angles [rad], or raw counts.
        position: Vec<f64>,
        /// Speeds in the same unit per second; empty when not published.
        velocity: Vec<f64>,
    },
    /// Pose of a tracked body.
    Pose {
        /// Position [m].
        position_m: Vector3<f64>,
        /// Orientation; all zero in an occluded frame.
        orientation: Quaternion<f64>,
    },
    /// Temperature [degC].
    Temperature {
        /// Value.
        celsius: f64,
        /// Variance [K^2].
        variance: f64,
    },
    /// One number, in the unit of its instrument.
    Number(f64),
}
