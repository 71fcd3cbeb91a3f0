//! A torso that carries both arms and turns while the hand leads them, and cameras that see where it takes the tips.

use super::motion::Motion;
use super::{Pair, PairArmConfig, PairConfig};
use crate::config::{check_not_negative, check_positive, check_range, value_error};
use crate::random::{Purpose, Stream};
use crate::sensors::transport::Transport;
use crate::sensors::{Kind, Log, Message, Payload};
use crate::{LabError, config::TransportConfig};
use armcal_core::RollPitchYaw;
use nalgebra::{Point3, Quaternion};
use serde::{Deserialize, Serialize};

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

impl TorsoConfig {
    pub(super) fn check(&self, recordings: usize) -> Result<(), LabError> {
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

    /// The angle at each of so many rests [rad].
    pub(super) fn turns_rad(&self, seed: u64, recording: usize, rests: usize) -> Vec<f64> {
        let mut draw = Stream::new(seed, Purpose::Torso, recording);
        (0..rests).map(|_| draw.uniform(self.range_deg).to_radians()).collect()
    }
}

/// Adds what cameras see of the tips to the log.
pub(super) fn tips_seen(
    config: &PairConfig,
    pair: &Pair,
    motion: &Motion,
    recording: usize,
    log: &mut Log,
) -> Result<(), f64> {
    let Some((torso, seen)) = config.torso.as_ref().and_then(|t| Some((t, t.seen.as_ref()?))) else {
        return Ok(());
    };
    let Some(built) = &pair.torso else { return Ok(()) };
    let camera_from_robot = armcal_core::Pose::from(seen.robot);
    let still = TransportConfig::default();
    for (arm, topic) in seen.topics.iter().enumerate() {
        let channel = log.channel(topic, Kind::PoseStamped, "cameras", std::slice::from_ref(&torso.arm.name));
        let stream = 2 * recording + arm;
        let mut noise = Stream::new(config.seed, Purpose::ViconMarker, stream);
        let mut transport =
            Transport::new(&still, Stream::new(config.seed, Purpose::TransportMarker, stream));
        let mut near = motion.phases[0].to_rad[arm].clone();
        for sequence in 0..=(motion.duration_s() * seen.rate_hz).floor() as u32 {
            let time_s = f64::from(sequence) / seen.rate_hz;
            near = motion.joint_rad(pair, arm, time_s, &near)?;
            let robot_from_torso = built.tip_frame(motion.torso_rad(time_s));
            let tip_m =
                camera_from_robot * robot_from_torso * Point3::from(pair.arms[arm].tip_in_world(&near));
            let position_m = tip_m.coords + noise.normal3() * (seen.sigma_mm * 1e-3);
            let stamp_ns = config.start_ns(recording) + (time_s * 1e9).round() as i64;
            let log_ns = transport.log_ns(stamp_ns);
            let payload = Payload::Pose { position_m, orientation: Quaternion::identity() };
            log.messages.push(Message { channel, sequence, stamp_ns, log_ns, payload });
        }
    }
    Ok(())
}
