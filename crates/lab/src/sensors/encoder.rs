//! Encoders: angles become counts, counts become joint states.

use super::message::{Kind, Message, Payload};
use super::transport::Transport;
use super::{Log, log_evenly};
use crate::config::{EncoderConfig, JointFormat, LabConfig};
use crate::random::{Purpose, Stream};
use crate::session::Session;
use crate::trace::row_at;

/// Adds the joint states of a session to the log.
pub fn joint_states(config: &LabConfig, recording: usize, session: &Session, log: &mut Log) {
    let joints = &config.joints;
    let channel = log.channel(&joints.topic, Kind::JointState, "", &joints.names);
    let mut noise = Stream::new(config.seed, Purpose::Encoder, recording);
    let mut transport = joint_transport(config, recording, 0);
    let mut before: Option<(f64, Vec<f64>)> = None;
    for sequence in 0..=(session.trace.duration_s() * joints.rate_hz).floor() as u32 {
        let nominal_s = f64::from(sequence) / joints.rate_hz;
        let time_s = (nominal_s + transport.period_jitter_s()).clamp(0.0, session.trace.duration_s());
        let counts: Vec<f64> = row_at(&session.trace.reading_rad, time_s)
            .iter()
            .map(|angle| (angle / joints.count_rad() + noise.normal() * joints.noise_counts).round())
            .collect();
        let speed = match &before {
            Some((then_s, then)) if time_s > *then_s => {
                counts.iter().zip(then).map(|(now, then)| (now - then) / (time_s - then_s)).collect()
            }
            _ => vec![0.0; counts.len()],
        };
        let payload = joint_payload(joints, &counts, &speed);
        let stamp_ns = config.start_ns(recording) + (time_s * 1e9).round() as i64;
        let log_ns = transport.log_ns(stamp_ns);
        log.messages.push(Message { channel, sequence, stamp_ns, log_ns, payload });
        before = Some((time_s, counts));
    }
}

/// Adds the controller's set-points to the log, if they are published.
pub fn set_points(config: &LabConfig, recording: usize, session: &Session, log: &mut Log) {
    let joints = &config.joints;
    let Some(topic) = &joints.set_point_topic else { return };
    let channel = log.channel(topic, Kind::JointState, "", &joints.names);
    let transport = joint_transport(config, recording, 1);
    log_evenly(config, (recording, session), (channel, joints.rate_hz, transport), log, |time_s| {
        // Set-points step: the one in force is the one of the step before, not a mean of two.
        let (step, ..) = crate::trace::bracketing_steps(time_s, session.trace.len());
        let set = &session.trace.set_point_rad[step];
        let counts: Vec<f64> = set.iter().map(|angle| (angle / joints.count_rad()).round()).collect();
        joint_payload(joints, &counts, &[])
    });
}

fn joint_transport(config: &LabConfig, recording: usize, channel: usize) -> Transport<'_> {
    let draw = Stream::new(config.seed, Purpose::JointTransport, 2 * recording + channel);
    Transport::new(&config.joints.transport, draw)
}

/// A joint state of these counts, in the form that is published.
pub(crate) fn joint_payload(joints: &EncoderConfig, counts: &[f64], counts_per_s: &[f64]) -> Payload {
    let (position, velocity): (Vec<f64>, Vec<f64>) = match joints.format {
        JointFormat::Rad => {
            let rad = |counts: &[f64]| counts.iter().map(|c| c * joints.count_rad()).collect();
            (rad(counts), rad(counts_per_s))
        }
        JointFormat::Counts => {
            let sense = |j: usize| joints.direction.get(j).map_or(1.0, |d| f64::from(*d));
            let zero = |j: usize| joints.zero_counts.get(j).map_or(0.0, |z| *z as f64);
            let raw = counts.iter().enumerate().map(|(j, c)| zero(j) + sense(j) * c).collect();
            (raw, counts_per_s.iter().enumerate().map(|(j, c)| sense(j) * c).collect())
        }
    };
    Payload::Joints { position, velocity: if joints.velocity { velocity } else { Vec::new() } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_carry_direction_and_zero_and_radians_do_not() {
        let raw = EncoderConfig {
            format: JointFormat::Counts,
            counts_per_turn: 4096.0,
            direction: vec![1, -1, 1],
            zero_counts: vec![0, 2048, -5],
            ..EncoderConfig::default()
        };
        let Payload::Joints { position, velocity } =
            joint_payload(&raw, &[10.0, 10.0, 10.0], &[1.0, 1.0, 1.0])
        else {
            panic!("not joints")
        };
        assert_eq!(position, [10.0, 2038.0, 5.0]);
        assert_eq!(velocity, [1.0, -1.0, 1.0]);
        let rad = EncoderConfig { format: JointFormat::Rad, velocity: false, ..raw };
        let Payload::Joints { position, velocity } = joint_payload(&rad, &[1024.0; 3], &[1.0; 3]) else {
            panic!("not joints")
        };
        assert!(position.iter().all(|q| (q - std::f64::consts::FRAC_PI_2).abs() < 1e-15));
        assert!(velocity.is_empty());
    }
}
