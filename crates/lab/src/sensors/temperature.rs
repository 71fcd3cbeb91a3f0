//! A slow thermometer on the arm.

use super::Log;
use super::message::{Channel, Kind, Message, Payload};
use super::transport::Transport;
use crate::config::LabConfig;
use crate::random::{Purpose, Stream};
use crate::session::Session;
use crate::trace::around;

/// Adds the temperature readings of a session to the log.
pub fn readings(config: &LabConfig, recording: usize, session: &Session, log: &mut Log) {
    let thermometer = &config.temperature;
    log.channels.push(Channel {
        topic: thermometer.topic.clone(),
        kind: Kind::Temperature,
        frame_id: "arm".into(),
        names: Vec::new(),
    });
    let channel = log.channels.len() - 1;
    let mut noise = Stream::new(config.seed, Purpose::Temperature, 2 * recording);
    let draw = Stream::new(config.seed, Purpose::Temperature, 2 * recording + 1);
    let mut transport = Transport::new(&config.joints.transport, draw);
    for sequence in 0..=(session.trace.duration_s() * thermometer.rate_hz).floor() as u32 {
        let time_s = f64::from(sequence) / thermometer.rate_hz;
        let (step, ..) = around(time_s, session.trace.len());
        let celsius = session.trace.temperature_c[step] + noise.normal() * thermometer.noise_k;
        let stamp_ns = config.start_ns(recording) + (time_s * 1e9).round() as i64;
        let log_ns = transport.log_ns(stamp_ns);
        let payload = Payload::Temperature { celsius, variance: thermometer.noise_k.powi(2) };
        log.messages.push(Message { channel, sequence, stamp_ns, log_ns, payload });
    }
}
