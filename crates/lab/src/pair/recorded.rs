//! What the recorder sees of a pair: joint state topics, each at its own instants, and what cameras see of the tips.

use super::drives::Drives;
use super::motion::Motion;
use super::{Pair, PairConfig};
use crate::LabError;
use crate::config::TransportConfig;
use crate::random::{Purpose, Stream};
use crate::sensors::encoder::joint_payload;
use crate::sensors::transport::Transport;
use crate::sensors::{Kind, Log, Message, Payload, SensorClock};
use nalgebra::{Point3, Quaternion};

/// Records a motion.
pub(crate) fn pair_log(
    config: &PairConfig,
    pair: &Pair,
    motion: &Motion,
    recording: usize,
) -> Result<Log, LabError> {
    let reference_ns = config.start_ns(recording);
    let clock = SensorClock { offset_s: 0.0, latency_s: 0.0, drift: 0.0, reference_ns };
    let mut log = Log::new(clock);
    for arm in 0..pair.carriers().len() {
        joint_states(config, pair, motion, recording, arm, &mut log)?;
    }
    let seen = tips_seen(config, pair, motion, recording, &mut log);
    seen.map_err(|short_by_m| LabError::JoinedOutOfReach {
        recording: config.recordings[recording].clone(),
        what: "the joined tips on their way".into(),
        short_by_mm: short_by_m * 1e3,
    })?;
    Ok(log.in_order())
}

fn joint_states(
    config: &PairConfig,
    pair: &Pair,
    motion: &Motion,
    recording: usize,
    arm: usize,
    log: &mut Log,
) -> Result<(), LabError> {
    let (own, built) = (config.carriers()[arm], pair.carriers()[arm]);
    let joints = &own.joints;
    let channel = log.channel(&joints.topic, Kind::JointState, "", &joints.names);
    // The torso's come behind those of the arms in all recordings.
    let stream = if arm < 2 { 2 * recording + arm } else { 2 * config.recordings.len() + recording };
    let mut noise = Stream::new(config.seed, Purpose::Encoder, stream);
    let draw = Stream::new(config.seed, Purpose::JointTransport, stream);
    let mut transport = Transport::new(&joints.transport, draw);
    let mut drives = Drives::new(own, built, recording);
    let mut near = motion.phases[0].to_rad.get(arm).cloned().unwrap_or_else(|| vec![0.0]);
    let last = (motion.duration_s() * joints.rate_hz).floor() as u32;
    for sequence in 0..=last {
        // The two computers do not sample together: half a period apart.
        let nominal_s = (f64::from(sequence) + 0.5 * arm as f64) / joints.rate_hz;
        let time_s = (nominal_s + transport.period_jitter_s()).clamp(0.0, motion.duration_s());
        near =
            motion.joint_rad(pair, arm, time_s, &near).map_err(|short_by_m| LabError::JoinedOutOfReach {
                recording: config.recordings[recording].clone(),
                what: format!("the joined tips {time_s:.2} s after the start"),
                short_by_mm: short_by_m * 1e3,
            })?;
        let counts: Vec<f64> = drives
            .reading(time_s, &near)
            .iter()
            .map(|angle| (angle / joints.count_rad() + noise.normal() * joints.noise_counts).round())
            .collect();
        let stamp_ns = config.start_ns(recording) + (time_s * 1e9).round() as i64;
        let log_ns = transport.log_ns(stamp_ns);
        let payload = joint_payload(joints, &counts, &[]);
        log.messages.push(Message { channel, sequence, stamp_ns, log_ns, payload });
    }
    Ok(())
}

/// Adds what cameras see of the tips to the log.
fn tips_seen(
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
