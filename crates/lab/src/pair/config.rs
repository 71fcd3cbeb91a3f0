//! The lab file of two arms: recognised by its `[[arms]]`.

use crate::LabError;
use crate::arm::DhRow;
use crate::checks::{check_not_negative, check_positive, check_range, parse_toml, value_error};
use crate::config::{DeviationConfig, EncoderConfig};
use crate::mechanisms::{Keys, MechanismConfig};
use armcal_core::RollPitchYaw;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Two arms with their tips joined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairConfig {
    /// Name of the rig.
    pub name: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Clock at the start of the first recording [s since 1970]. Default 1760000000.
    #[serde(default = "crate::config::default_start")]
    pub start_unix_s: u64,
    /// The arms.
    pub arms: [PairArmConfig; 2],
    /// A torso that carries both; none by default, and each stands by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torso: Option<TorsoConfig>,
    /// How the tips are joined.
    #[serde(default)]
    pub joined: JoinConfig,
    /// What is done in each recording.
    #[serde(default)]
    pub task: PairTaskConfig,
    /// Names of the recordings; the files are `<name>.mcap`. Default one, `closed`.
    #[serde(default = "default_recordings")]
    pub recordings: Vec<String>,
}

/// One of the arms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairArmConfig {
    /// Its name.
    pub name: String,
    /// Where its base is meant to stand in the world.
    #[serde(default)]
    pub base: RollPitchYaw,
    /// How far each coordinate of the base is off, 1 sigma [mm]. Default 0.
    #[serde(default)]
    pub placement_sigma_mm: f64,
    /// How far it is off about each axis, 1 sigma [deg]. Default 0.
    #[serde(default)]
    pub placement_sigma_deg: f64,
    /// Nominal DH rows from base to tip (standard convention).
    pub rows: Vec<DhRow>,
    /// How far the built arm deviates.
    #[serde(default)]
    pub deviation: DeviationConfig,
    /// Where it waits before the tips are joined and after [deg].
    pub home_deg: Vec<f64>,
    /// Its encoders and their topic.
    pub joints: EncoderConfig,
    /// Mass of each link, which hangs on what is in the drives [kg]. Default 2.
    #[serde(default = "default_link_kg", skip_serializing_if = "is_default_link")]
    pub link_kg: f64,
    /// What is hidden in its drives and encoders; in recordings only ([`super::simulate`]).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mechanisms: Vec<MechanismConfig>,
}

/// What carries both arms. Their bases are placed on the frame at its tip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorsoConfig {
    /// Its joint, as an arm of one row.
    pub arm: PairArmConfig,
    /// Between which angles it is turned [deg].
    pub range_deg: [f64; 2],
    /// What cameras see of the tips; nothing by default.
    pub seen: Option<TipsSeenConfig>,
}

/// Cameras that see both tips.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TipsSeenConfig {
    /// A topic a tip.
    pub topics: [String; 2],
    /// Frames a second [Hz].
    pub rate_hz: f64,
    /// White noise, 1 sigma per axis [mm].
    pub sigma_mm: f64,
    /// Where the robot stands in the cameras' frame.
    pub robot: RollPitchYaw,
}

/// How the tips are joined.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct JoinConfig {
    /// Distance of the tips on a rigid link with a ball joint at either end [mm]; both in one point when absent.
    pub length_mm: Option<f64>,
    /// Error of that length, 1 sigma [mm]. Default 0.
    pub length_sigma_mm: f64,
    /// How far the joined points are apart all the same, anew in each dwell, 1 sigma per axis [mm]. Default 0.05.
    pub slip_sigma_mm: f64,
}

/// What the hand does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PairTaskConfig {
    /// Dwells with the tips joined. Default 80.
    pub poses: usize,
    /// The region of the world they are drawn from: x, y, z, each from and to [m].
    pub region_m: [[f64; 2]; 3],
    /// Length of a rest [s].
    pub rest_s: [f64; 2],
    /// Time between two rests [s].
    pub move_s: [f64; 2],
    /// Tremor of the hand on the way, 1 sigma per axis [mm]. Default 0.4.
    pub tremor_mm: f64,
}

impl Default for JoinConfig {
    fn default() -> JoinConfig {
        JoinConfig { length_mm: None, length_sigma_mm: 0.0, slip_sigma_mm: 0.05 }
    }
}

impl Default for PairTaskConfig {
    fn default() -> PairTaskConfig {
        PairTaskConfig {
            poses: 80,
            region_m: [[0.22, 0.56], [0.0, 0.5], [0.05, 0.6]],
            rest_s: [0.8, 1.4],
            move_s: [0.7, 1.1],
            tremor_mm: 0.4,
        }
    }
}

impl PairConfig {
    /// Reads and checks a lab file.
    pub fn from_toml(text: &str, path: &Path) -> Result<PairConfig, LabError> {
        let config: PairConfig = parse_toml("lab file", text, path)?;
        config.check()?;
        Ok(config)
    }

    /// Clock at the start of recording `recording` [ns]: a quarter of an hour apart.
    pub fn start_ns(&self, recording: usize) -> i64 {
        (self.start_unix_s as i64 + 900 * recording as i64) * 1_000_000_000
    }

    /// The arms, then the torso.
    pub(super) fn carriers(&self) -> Vec<&PairArmConfig> {
        self.arms.iter().chain(self.torso.as_ref().map(|torso| &torso.arm)).collect()
    }

    /// Checks every value the simulation divides by, indexes with or waits for.
    pub fn check(&self) -> Result<(), LabError> {
        self.arms.iter().try_for_each(|arm| arm.check(self.recordings.len()))?;
        self.torso.iter().try_for_each(|torso| torso.check(self.recordings.len()))?;
        if self.arms[0].name == self.arms[1].name || self.arms[0].joints.topic == self.arms[1].joints.topic {
            return Err(value_error("arms", "the two need names and topics of their own".into()));
        }
        if let Some(length_mm) = self.joined.length_mm {
            check_positive("joined.length_mm", length_mm)?;
        }
        check_not_negative("joined.length_sigma_mm", self.joined.length_sigma_mm)?;
        check_not_negative("joined.slip_sigma_mm", self.joined.slip_sigma_mm)?;
        let task = &self.task;
        task.region_m.iter().try_for_each(|r| check_range("task.region_m", *r))?;
        for (key, seconds) in [("task.rest_s", task.rest_s), ("task.move_s", task.move_s)] {
            check_range(key, seconds)?;
            check_positive(key, seconds[0])?;
        }
        check_not_negative("task.tremor_mm", task.tremor_mm)?;
        if self.recordings.is_empty() {
            return Err(value_error("recordings", "there are none; name at least one".into()));
        }
        for (i, name) in self.recordings.iter().enumerate() {
            let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
            if name.is_empty() || !name.chars().all(plain) || self.recordings[..i].contains(name) {
                return Err(value_error(
                    "recordings",
                    format!("`{name}` cannot be the name of another file"),
                ));
            }
        }
        if self.start_unix_s > 2_100_000_000 {
            return Err(value_error(
                "start_unix_s",
                "lies beyond 2036; give seconds, not milliseconds".into(),
            ));
        }
        Ok(())
    }
}

impl PairArmConfig {
    fn check(&self, recordings: usize) -> Result<(), LabError> {
        let joints = self.rows.iter().filter(|row| row.joint).count();
        for (key, size) in
            [("arms.home_deg", self.home_deg.len()), ("arms.joints.names", self.joints.names.len())]
        {
            if size != joints || joints == 0 {
                return Err(value_error(key, format!("has {size} entries for an arm of {joints} joints")));
            }
        }
        if !self.rows[0].joint {
            return Err(value_error(
                "arms.rows",
                "the first row must be a joint; put a fixed base into `base`".into(),
            ));
        }
        let rows = self.rows.iter().flat_map(|r| [r.theta_deg, r.d_m, r.a_m, r.alpha_deg]);
        if !rows.chain(self.home_deg.iter().copied()).all(f64::is_finite) {
            return Err(value_error("arms", format!("`{}` has a number that is not finite", self.name)));
        }
        check_not_negative("arms.link_kg", self.link_kg)?;
        for (table, mechanism) in self.mechanisms.iter().enumerate() {
            acts_on_drives(mechanism)?;
            mechanism.hidden().check(&Keys { table, joints, recordings, markers: 0 })?;
        }
        check_not_negative("arms.deviation.length_mm", self.deviation.length_mm)?;
        check_not_negative("arms.deviation.angle_deg", self.deviation.angle_deg)?;
        check_not_negative("arms.placement_sigma_mm", self.placement_sigma_mm)?;
        check_not_negative("arms.placement_sigma_deg", self.placement_sigma_deg)?;
        self.joints.check()
    }
}

impl TorsoConfig {
    fn check(&self, recordings: usize) -> Result<(), LabError> {
        check_range("torso.range_deg", self.range_deg)?;
        if self.arm.home_deg.len() != 1 {
            return Err(value_error("torso.arm.home_deg", "is not of one joint; a torso has one".into()));
        }
        if let Some(seen) = &self.seen {
            check_positive("torso.seen.rate_hz", seen.rate_hz)?;
            check_not_negative("torso.seen.sigma_mm", seen.sigma_mm)?;
        }
        self.arm.check(recordings)
    }
}

/// Refuses what acts on anything but drives and encoders: the hand leads rigid arms.
fn acts_on_drives(mechanism: &MechanismConfig) -> Result<(), LabError> {
    use MechanismConfig::{
        AxisTilt, AxisWobble, BaseCompliance, BoardScale, Bump, CameraDistortion, CameraScale, FrameDrift,
        LinkBending, RoomTemperature, ThermalGrowth, Twist, WarmUp,
    };
    let elsewhere = matches!(
        mechanism,
        AxisTilt(_)
            | AxisWobble(_)
            | BaseCompliance(_)
            | BoardScale(_)
            | Bump(_)
            | CameraDistortion(_)
            | CameraScale(_)
            | FrameDrift(_)
            | LinkBending(_)
            | RoomTemperature(_)
            | ThermalGrowth(_)
            | Twist(_)
            | WarmUp(_)
    );
    let why = "acts on links, frames or cameras; an arm of a pair takes what is in its drives and encoders";
    if elsewhere { Err(value_error("arms.mechanisms", why.to_owned())) } else { Ok(()) }
}

fn default_link_kg() -> f64 {
    2.0
}

fn is_default_link(link_kg: &f64) -> bool {
    *link_kg == default_link_kg()
}

fn default_recordings() -> Vec<String> {
    vec!["closed".into()]
}
