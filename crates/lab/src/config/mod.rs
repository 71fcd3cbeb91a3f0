//! `LAB.toml`: what the rig is, what it does, and how it is watched. The defaults are the paper's rig.

mod arm;
mod gauge;
mod sensors;
mod task;

pub use arm::{ArmConfig, DeviationConfig, DriveConfig};
pub use gauge::{GaugeConfig, GaugeKind};
pub use sensors::{
    BodyConfig, ClockConfig, EncoderConfig, JointFormat, MarkerConfig, PoseMessage, TableMarkers,
    TemperatureConfig, TransportConfig, ViconConfig,
};
pub use task::{
    FreeConfig, HandConfig, Order, PassConfig, SetPointsConfig, StopConfig, SweepConfig, TaskConfig,
    TourConfig,
};

use crate::LabError;
use crate::checks::{check_not_negative, parse_toml, value_error};
use crate::mechanisms::{Keys, MechanismConfig};
use armcal_core::RollPitchYaw;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The whole virtual laboratory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabConfig {
    /// Name of the rig.
    pub name: String,
    /// Seed of everything random. Another seed is another rig of the same kind.
    pub seed: u64,
    /// Robot clock at the start of the first recording [s since 1970].
    #[serde(default = "default_start")]
    pub start_unix_s: u64,
    /// From the start of one recording to the start of the next [s]; the board is tilted in between. Default 1200.
    #[serde(default = "default_interval")]
    pub interval_s: f64,
    /// The arm.
    #[serde(default)]
    pub arm: ArmConfig,
    /// Pose of the robot's base in the world (Vicon) frame.
    #[serde(default = "default_base")]
    pub base: RollPitchYaw,
    /// The calibration board and where it stands.
    pub board: BoardConfig,
    /// What the arm does in each recording.
    #[serde(default)]
    pub task: TaskConfig,
    /// How a person guides the tip.
    #[serde(default)]
    pub hand: HandConfig,
    /// Encoders and the joint state topic.
    #[serde(default)]
    pub joints: EncoderConfig,
    /// The motion capture system.
    #[serde(default)]
    pub vicon: ViconConfig,
    /// The thermometer.
    #[serde(default)]
    pub temperature: TemperatureConfig,
    /// Instruments that read one length of the tip.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gauges: Vec<GaugeConfig>,
    /// The recordings, in the order of the session.
    pub recordings: Vec<RecordingConfig>,
    /// What is hidden in the rig: see [`crate::mechanisms`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mechanisms: Vec<MechanismConfig>,
}

/// The board and its placement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardConfig {
    /// Board file, relative to the lab file; `builtin:paper` is the paper's board, known to the lab.
    pub file: PathBuf,
    /// How far cavities really are from where the drawing has them, per axis, 1 sigma [mm]; what the board file
    /// declares when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub true_cavity_sigma_mm: Option<f64>,
    /// Pose of the untilted board in the robot's base frame, as the lab believes it to be.
    #[serde(default = "default_board_pose")]
    pub in_base: RollPitchYaw,
    /// Where the board really stands: deviation of each coordinate, 1 sigma [mm]. Default 3.
    #[serde(default = "default_placement_mm")]
    pub placement_sigma_mm: f64,
    /// How it really stands: deviation about each axis, 1 sigma [deg]. Default 0.5.
    #[serde(default = "default_placement_deg")]
    pub placement_sigma_deg: f64,
    /// Deviation of the tilt reached from the tilt declared, 1 sigma, roll and pitch each [deg]. Default 0.1.
    #[serde(default = "default_tilt_deg")]
    pub tilt_sigma_deg: f64,
}

/// One recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingConfig {
    /// Its name; the file is `<name>.mcap`.
    pub name: String,
    /// Declared roll of the board [deg].
    #[serde(default)]
    pub roll_deg: f64,
    /// Declared pitch of the board [deg].
    #[serde(default)]
    pub pitch_deg: f64,
    /// Load carried at the tip [kg].
    #[serde(default)]
    pub load_kg: f64,
}

impl LabConfig {
    /// Reads and checks a lab file.
    pub fn from_toml(text: &str, path: &Path) -> Result<LabConfig, LabError> {
        let config: LabConfig = parse_toml("lab file", text, path)?;
        config.check()?;
        Ok(config)
    }

    /// Robot clock at the start of recording `recording` [ns].
    pub fn start_ns(&self, recording: usize) -> i64 {
        self.start_unix_s as i64 * 1_000_000_000 + (recording as f64 * self.interval_s * 1e9) as i64
    }

    /// Checks every value the simulation divides by, indexes with or waits for.
    pub fn check(&self) -> Result<(), LabError> {
        let joints = self.arm.rows.iter().filter(|row| row.joint).count();
        let sizes = [
            ("arm.rows", joints),
            ("arm.drives", self.arm.drives.len()),
            ("arm.home_deg", self.arm.home_deg.len()),
            ("joints.names", self.joints.names.len()),
            ("task.free.range_deg", self.task.free.range_deg.len()),
        ];
        for (key, size) in sizes {
            if size != joints || joints == 0 {
                return Err(value_error(key, format!("has {size} entries for an arm of {joints} joints")));
            }
        }
        self.arm.check()?;
        self.task.check()?;
        for stop in self.task.tours.iter().flat_map(|tour| &tour.stops) {
            if let StopConfig::Pose { joint_deg, from_deg } = stop
                && ![joint_deg, from_deg].iter().all(|q| q.len() == joints && q.iter().all(|q| q.is_finite()))
            {
                return Err(value_error(
                    "task.tours.stops",
                    format!("a pose needs {joints} finite joint angles"),
                ));
            }
        }
        self.hand.check()?;
        self.joints.check()?;
        self.vicon.check()?;
        self.temperature.check()?;
        self.gauges.iter().try_for_each(GaugeConfig::check)?;
        let board = [
            ("board.placement_sigma_mm", self.board.placement_sigma_mm),
            ("board.placement_sigma_deg", self.board.placement_sigma_deg),
            ("board.tilt_sigma_deg", self.board.tilt_sigma_deg),
            ("interval_s", self.interval_s),
            ("board.true_cavity_sigma_mm", self.board.true_cavity_sigma_mm.unwrap_or(0.0)),
        ];
        board.iter().try_for_each(|(key, v)| check_not_negative(key, *v))?;
        if self.start_unix_s > 2_100_000_000 {
            let why = "lies beyond 2036, where ROS 2 stamps end soon; give seconds, not milliseconds";
            return Err(value_error("start_unix_s", why.into()));
        }
        self.check_recordings()?;
        let (recordings, markers) = (self.recordings.len(), self.vicon.markers.len());
        if let Some(marker) = self.vicon.markers.iter().find(|m| !(1..=joints).contains(&m.link)) {
            let why = format!("must be a joint from 1 to {joints}, is {}", marker.link);
            return Err(value_error("vicon.markers.link", why));
        }
        let mut tables = self.mechanisms.iter().enumerate();
        tables.try_for_each(|(table, m)| m.hidden().check(&Keys { table, joints, recordings, markers }))
    }

    fn check_recordings(&self) -> Result<(), LabError> {
        if self.recordings.is_empty() {
            return Err(value_error("recordings", "there are none; add a [[recordings]] table".into()));
        }
        for (i, recording) in self.recordings.iter().enumerate() {
            let name = &recording.name;
            let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.');
            if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
                return Err(value_error("recordings.name", format!("`{name}` cannot be the name of a file")));
            }
            if self.recordings[..i].iter().any(|other| other.name == *name) {
                return Err(value_error("recordings.name", format!("`{name}` occurs twice")));
            }
            check_not_negative("recordings.load_kg", recording.load_kg)?;
        }
        Ok(())
    }
}

pub(crate) fn default_start() -> u64 {
    1_760_000_000
}

fn default_interval() -> f64 {
    1200.0
}

fn default_base() -> RollPitchYaw {
    RollPitchYaw { xyz_m: [1.2, -0.4, 0.75], rpy_deg: [0.4, -0.6, 30.0] }
}

fn default_board_pose() -> RollPitchYaw {
    RollPitchYaw { xyz_m: [0.42, 0.0, 0.10], rpy_deg: [0.0; 3] }
}

fn default_placement_mm() -> f64 {
    3.0
}

fn default_placement_deg() -> f64 {
    0.5
}

fn default_tilt_deg() -> f64 {
    0.1
}

/// Keys at their defaults stay out of the truth file.
fn is_default<T: Default + PartialEq>(v: &T) -> bool {
    *v == T::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALLEST: &str =
        "name = 'x'\nseed = 1\n[board]\nfile = 'b.toml'\n[[recordings]]\nname = 'normal'\n";

    const BLIND: &str = "\n[vicon.tip]\nsubject = 'tip'\nrate_hz = 0.0\nrotation_sigma_deg = 0.1\n\
        occlusions_per_minute = 0.0\nocclusion_s = 0.1\n";

    fn read(text: &str) -> Result<LabConfig, LabError> {
        LabConfig::from_toml(text, Path::new("lab.toml"))
    }

    #[test]
    fn the_defaults_are_the_papers_rig() {
        let config = read(SMALLEST).unwrap();
        assert_eq!(config.arm.rows.len(), 4);
        assert_eq!(config.vicon.noise_95_mm, 0.28);
        assert_eq!((config.arm.deviation.length_mm, config.arm.deviation.angle_deg), (5.0, 2.0));
    }

    #[test]
    fn what_cannot_work_is_named() {
        for (text, says) in [
            ("\n[vicon]\nrate = 3\n", "rate"),
            (BLIND, "vicon.tip.rate_hz"),
            ("\n[joints]\nnames = ['a']\n", "joints.names"),
            ("\n[[recordings]]\nname = 'normal'\n", "occurs twice"),
            ("\n[[recordings]]\nname = '../x'\n", "name of a file"),
            ("\n[hand]\nseated_s = [2.0, 1.0]\n", "hand.seated_s"),
        ] {
            let error = read(&format!("{SMALLEST}{text}")).unwrap_err();
            let mut shown = error.to_string();
            if let LabError::Parse { source, .. } = &error {
                shown += &source.to_string();
            }
            assert!(shown.contains(says), "{shown}");
        }
    }
}
