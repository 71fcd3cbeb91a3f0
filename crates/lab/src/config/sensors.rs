//! Encoders, motion capture, thermometer, and the clocks and transport of their messages.

use crate::LabError;
use crate::checks::{
    check_not_negative, check_positive, check_range, check_share, check_tail_degrees, value_error,
};
use serde::{Deserialize, Serialize};

/// Encoders and the joint state topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EncoderConfig {
    /// Topic. Default `/joint_states`.
    pub topic: String,
    /// Joint names, from base to tip. Default `joint1`, `joint2`, `joint3`.
    pub names: Vec<String>,
    /// Rate of the messages [Hz]. Default 100.
    pub rate_hz: f64,
    /// Counts per turn of the joint. Default 65536.
    pub counts_per_turn: f64,
    /// Electrical noise before the count is taken, 1 sigma [counts]. Default 0.3.
    pub noise_counts: f64,
    /// What is published: angles in `rad`, or raw `counts`.
    pub format: JointFormat,
    /// Sense of counting of each joint, +1 or -1; empty: all +1. Only seen in raw counts.
    pub direction: Vec<i8>,
    /// Count at joint zero of each joint; empty: all 0. Only seen in raw counts.
    pub zero_counts: Vec<i64>,
    /// Whether velocities are published (differences of counts). Default true.
    pub velocity: bool,
    /// Topic of the set-points, as joint states; none by default.
    pub set_point_topic: Option<String>,
    /// From the stamp to the recorder.
    pub transport: TransportConfig,
}

/// What the position field of a joint state holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointFormat {
    /// Quantised angles [rad].
    Rad,
    /// Encoder counts.
    Counts,
}

/// How a message gets its stamp and reaches the recorder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TransportConfig {
    /// Jitter of the instant of sampling, 1 sigma [ms]. The stamp follows it. Default 0.2.
    pub period_jitter_ms: f64,
    /// Shortest time from sending to logging [ms]. Default 3.
    pub shortest_ms: f64,
    /// Mean time on top of the shortest, exponentially distributed [ms]. Default 5.
    pub mean_extra_ms: f64,
}

/// The motion capture system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ViconConfig {
    /// `frame_id` of its messages. Default `vicon/world`.
    pub frame_id: String,
    /// Message type of all subjects.
    pub message: PoseMessage,
    /// Position noise: half width of the 95 % interval of one coordinate of one frame [mm]. Default 0.28.
    pub noise_95_mm: f64,
    /// Share of the noise variance that is correlated from frame to frame. Default 0.3.
    pub correlated_share: f64,
    /// Correlation time of that part [s]. Default 0.05.
    pub correlation_s: f64,
    /// Degrees of freedom of Student's t for the size of the noise from one stretch of `tail_s` to the next: heavy
    /// tails that averaging over a pause does not remove. 0 for none. Default 0.
    #[serde(skip_serializing_if = "super::is_default")]
    pub tail_degrees: f64,
    /// Length of such a stretch [s]. Default 2.
    #[serde(skip_serializing_if = "is_two")]
    pub tail_s: f64,
    /// Swaps of the tip's markers a minute. Default 0.
    #[serde(skip_serializing_if = "super::is_default")]
    pub swaps_per_minute: f64,
    /// Mean length of a swap [s]. Default 2.
    #[serde(skip_serializing_if = "is_two")]
    pub swap_s: f64,
    /// How far a swap displaces the tip, per axis, 1 sigma [mm]. Default 3.
    #[serde(skip_serializing_if = "is_three")]
    pub swap_mm: f64,
    /// Whether the bridge passes positions through in single precision. Default false.
    pub single_precision: bool,
    /// Relation of its clock to the robot's.
    pub clock: ClockConfig,
    /// Which part of the table carries the markers.
    pub table_markers: TableMarkers,
    /// The tip's origin relative to the tool point, in the tip frame [mm]. Default 0.
    pub tip_offset_mm: [f64; 3],
    /// Error of the base's marker plate per coordinate, 1 sigma [mm]. Default 0.3.
    pub base_mount_sigma_mm: f64,
    /// Error of the base's marker plate about each axis, 1 sigma [deg]. Default 0.05.
    pub base_mount_sigma_deg: f64,
    /// The tip subject.
    pub tip: BodyConfig,
    /// The table subject.
    pub table: BodyConfig,
    /// The base subject.
    pub base: BodyConfig,
    /// Markers on links of the arm, beside the tip.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub markers: Vec<MarkerConfig>,
}

/// Message type of the tracked subjects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PoseMessage {
    /// `geometry_msgs/msg/PoseStamped`, as ros2-vicon-receiver publishes.
    PoseStamped,
    /// `geometry_msgs/msg/TransformStamped`, as vicon_bridge publishes.
    TransformStamped,
}

/// Which part of the table carries the markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TableMarkers {
    /// The tilting board itself: the subject's pose is the board's pose.
    Board,
    /// The frame below the mechanism: the subject's pose is that of the untilted board.
    Frame,
}

/// One tracked subject.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyConfig {
    /// Subject name; the topic is `/vicon/<subject>/<subject>`.
    pub subject: String,
    /// Frames a second.
    pub rate_hz: f64,
    /// Orientation noise about each axis, 1 sigma [deg].
    pub rotation_sigma_deg: f64,
    /// Bursts of occlusion a minute.
    pub occlusions_per_minute: f64,
    /// Mean length of a burst [s].
    pub occlusion_s: f64,
}

/// One marker on a link of the arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerConfig {
    /// Subject name; the topic is `/vicon/<subject>/<subject>`.
    pub subject: String,
    /// The joint whose link carries it, from 1.
    pub link: usize,
    /// How far it is from where that link ends (the next axis, or the tip), along the axes of the base while all joints are at
    /// zero [mm].
    pub at_mm: [f64; 3],
    /// Frames a second. Default 100.
    #[serde(default = "default_marker_hz")]
    pub rate_hz: f64,
    /// Orientation noise about each axis, 1 sigma [deg]. Default 0.15.
    #[serde(default = "default_marker_deg")]
    pub rotation_sigma_deg: f64,
    /// Bursts of occlusion a minute. Default 0.
    #[serde(default)]
    pub occlusions_per_minute: f64,
    /// Mean length of a burst [s]. Default 0.3.
    #[serde(default = "default_burst_s")]
    pub occlusion_s: f64,
}

fn default_marker_hz() -> f64 {
    100.0
}

fn default_marker_deg() -> f64 {
    0.15
}

fn default_burst_s() -> f64 {
    0.3
}

impl MarkerConfig {
    /// As any other subject.
    pub fn body(&self) -> BodyConfig {
        BodyConfig {
            subject: self.subject.clone(),
            rate_hz: self.rate_hz,
            rotation_sigma_deg: self.rotation_sigma_deg,
            occlusions_per_minute: self.occlusions_per_minute,
            occlusion_s: self.occlusion_s,
        }
    }
}

/// How the sensor's clock relates to the robot's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ClockConfig {
    /// How far the sensor's clock is ahead at the start of a recording [ms]. Default 38.
    pub offset_ms: f64,
    /// Change of that from recording to recording, 1 sigma [ms]. Default 4.
    pub offset_sigma_ms: f64,
    /// How much faster it runs [ppm]. Default 25.
    pub drift_ppm: f64,
    /// Change of that from recording to recording, 1 sigma [ppm]. Default 3.
    pub drift_sigma_ppm: f64,
    /// Time from exposure to stamp [ms]: the bridge stamps with its own "now". Default 9.
    pub latency_ms: f64,
    /// Jitter of the stamp, 1 sigma [ms]. Default 0.3.
    pub stamp_jitter_ms: f64,
    /// From the stamp to the recorder.
    pub transport: TransportConfig,
}

/// The thermometer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TemperatureConfig {
    /// Topic. Default `/temperature`.
    pub topic: String,
    /// Whether there is a thermometer at all. Default true.
    #[serde(skip_serializing_if = "is_true")]
    pub published: bool,
    /// Rate [Hz]. Default 0.5.
    pub rate_hz: f64,
    /// Temperature at the start of the session [degC]. Default 22.
    pub start_c: f64,
    /// How much the arm warms up in the end [K]. Default 6.
    pub rise_k: f64,
    /// Time constant of warming up [s]. Default 1800.
    pub time_constant_s: f64,
    /// Noise of a reading, 1 sigma [K]. Default 0.05.
    pub noise_k: f64,
}

impl Default for EncoderConfig {
    fn default() -> EncoderConfig {
        EncoderConfig {
            topic: "/joint_states".into(),
            names: (1..=3).map(|j| format!("joint{j}")).collect(),
            rate_hz: 100.0,
            counts_per_turn: 65536.0,
            noise_counts: 0.3,
            format: JointFormat::Rad,
            direction: Vec::new(),
            zero_counts: Vec::new(),
            velocity: true,
            set_point_topic: None,
            transport: TransportConfig::default(),
        }
    }
}

impl Default for TransportConfig {
    fn default() -> TransportConfig {
        TransportConfig { period_jitter_ms: 0.2, shortest_ms: 3.0, mean_extra_ms: 5.0 }
    }
}

impl Default for ViconConfig {
    fn default() -> ViconConfig {
        let body = |subject: &str, rate_hz, rotation_sigma_deg, occlusions_per_minute| BodyConfig {
            subject: subject.into(),
            rate_hz,
            rotation_sigma_deg,
            occlusions_per_minute,
            occlusion_s: 0.3,
        };
        ViconConfig {
            frame_id: "vicon/world".into(),
            message: PoseMessage::PoseStamped,
            noise_95_mm: 0.28,
            correlated_share: 0.3,
            correlation_s: 0.05,
            tail_degrees: 0.0,
            tail_s: 2.0,
            swaps_per_minute: 0.0,
            swap_s: 2.0,
            swap_mm: 3.0,
            single_precision: false,
            clock: ClockConfig::default(),
            table_markers: TableMarkers::Board,
            tip_offset_mm: [0.0; 3],
            base_mount_sigma_mm: 0.3,
            base_mount_sigma_deg: 0.05,
            tip: body("tip", 100.0, 0.15, 2.0),
            table: body("table", 20.0, 0.03, 0.5),
            base: body("base", 20.0, 0.05, 0.2),
            markers: Vec::new(),
        }
    }
}

impl Default for ClockConfig {
    fn default() -> ClockConfig {
        ClockConfig {
            offset_ms: 38.0,
            offset_sigma_ms: 4.0,
            drift_ppm: 25.0,
            drift_sigma_ppm: 3.0,
            latency_ms: 9.0,
            stamp_jitter_ms: 0.3,
            transport: TransportConfig { period_jitter_ms: 0.0, ..TransportConfig::default() },
        }
    }
}

impl Default for TemperatureConfig {
    fn default() -> TemperatureConfig {
        TemperatureConfig {
            topic: "/temperature".into(),
            published: true,
            rate_hz: 0.5,
            start_c: 22.0,
            rise_k: 6.0,
            time_constant_s: 1800.0,
            noise_k: 0.05,
        }
    }
}

impl EncoderConfig {
    /// One count [rad].
    pub fn count_rad(&self) -> f64 {
        std::f64::consts::TAU / self.counts_per_turn
    }

    pub(crate) fn check(&self) -> Result<(), LabError> {
        check_rate("joints.rate_hz", self.rate_hz)?;
        check_positive("joints.counts_per_turn", self.counts_per_turn)?;
        check_not_negative("joints.noise_counts", self.noise_counts)?;
        self.transport.check("joints.transport")?;
        let joints = self.names.len();
        if !self.direction.is_empty()
            && (self.direction.len() != joints || self.direction.iter().any(|d| d.abs() != 1))
        {
            return Err(value_error(
                "joints.direction",
                format!("must be +1 or -1 for each of {joints} joints, or empty"),
            ));
        }
        if !self.zero_counts.is_empty() && self.zero_counts.len() != joints {
            return Err(value_error("joints.zero_counts", format!("must have {joints} entries or none")));
        }
        Ok(())
    }
}

impl TransportConfig {
    fn check(&self, key: &str) -> Result<(), LabError> {
        check_not_negative(&format!("{key}.period_jitter_ms"), self.period_jitter_ms)?;
        check_not_negative(&format!("{key}.shortest_ms"), self.shortest_ms)?;
        check_not_negative(&format!("{key}.mean_extra_ms"), self.mean_extra_ms)
    }
}

impl ViconConfig {
    /// Noise of one coordinate of one frame, 1 sigma [m].
    pub fn sigma_m(&self) -> f64 {
        self.noise_95_mm * 1e-3 / 1.96
    }

    pub(super) fn check(&self) -> Result<(), LabError> {
        check_not_negative("vicon.noise_95_mm", self.noise_95_mm)?;
        check_tail_degrees("vicon.tail_degrees", self.tail_degrees)?;
        check_positive("vicon.tail_s", self.tail_s)?;
        check_not_negative("vicon.swaps_per_minute", self.swaps_per_minute)?;
        check_positive("vicon.swap_s", self.swap_s)?;
        check_not_negative("vicon.swap_mm", self.swap_mm)?;
        check_share("vicon.correlated_share", self.correlated_share)?;
        check_positive("vicon.correlation_s", self.correlation_s)?;
        check_not_negative("vicon.base_mount_sigma_mm", self.base_mount_sigma_mm)?;
        check_not_negative("vicon.base_mount_sigma_deg", self.base_mount_sigma_deg)?;
        let clock = &self.clock;
        check_not_negative("vicon.clock.offset_sigma_ms", clock.offset_sigma_ms)?;
        check_not_negative("vicon.clock.drift_sigma_ppm", clock.drift_sigma_ppm)?;
        check_not_negative("vicon.clock.latency_ms", clock.latency_ms)?;
        check_not_negative("vicon.clock.stamp_jitter_ms", clock.stamp_jitter_ms)?;
        clock.transport.check("vicon.clock.transport")?;
        check_range("vicon.clock.offset_ms", [clock.offset_ms, 1e6])?;
        check_range("vicon.clock.drift_ppm", [clock.drift_ppm, 1e5])?;
        let markers: Vec<(String, BodyConfig)> =
            self.markers.iter().map(|m| (format!("markers {}", m.subject), m.body())).collect();
        let markers = markers.iter().map(|(key, body)| (key.as_str(), body));
        let subjects = [("tip", &self.tip), ("table", &self.table), ("base", &self.base)];
        for (key, body) in subjects.into_iter().chain(markers) {
            if body.subject.is_empty() {
                return Err(value_error(&format!("vicon.{key}.subject"), "is empty; name it".to_owned()));
            }
            check_rate(&format!("vicon.{key}.rate_hz"), body.rate_hz)?;
            check_not_negative(&format!("vicon.{key}.rotation_sigma_deg"), body.rotation_sigma_deg)?;
            check_not_negative(&format!("vicon.{key}.occlusions_per_minute"), body.occlusions_per_minute)?;
            check_not_negative(&format!("vicon.{key}.occlusion_s"), body.occlusion_s)?;
        }
        Ok(())
    }
}

impl TemperatureConfig {
    /// The arm's temperature `session_s` after the session began [degC]: it warms up with one time constant.
    pub fn at(&self, session_s: f64) -> f64 {
        self.start_c + self.rise_k * (1.0 - (-session_s / self.time_constant_s).exp())
    }

    pub(super) fn check(&self) -> Result<(), LabError> {
        check_rate("temperature.rate_hz", self.rate_hz)?;
        check_positive("temperature.time_constant_s", self.time_constant_s)?;
        check_not_negative("temperature.noise_k", self.noise_k)
    }
}

fn check_rate(key: &str, hz: f64) -> Result<(), LabError> {
    check_positive(key, hz)?;
    if hz > 5000.0 { Err(value_error(key, format!("{hz} Hz is more than the lab's 5000"))) } else { Ok(()) }
}

// Keys at their defaults stay out of the truth file.

fn is_two(v: &f64) -> bool {
    *v == 2.0
}

fn is_three(v: &f64) -> bool {
    *v == 3.0
}

fn is_true(v: &bool) -> bool {
    *v
}
