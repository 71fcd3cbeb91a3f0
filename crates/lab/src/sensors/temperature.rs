//! A slow thermometer on the arm.

use super::message::{Kind, Payload};
use super::transport::Transport;
use super::{Log, log_evenly};
use crate::config::LabConfig;
use crate::random::{Purpose, Stream};
use crate::session::Session;
use crate::trace::bracketing_steps;

/// Adds the temperature readings of a session to the log.
pub fn log_readings(config: &LabConfig, recording: usize, session: &Session, log: &mut Log) {
    let thermometer = &config.temperature;
    let channel = log.channel(&thermometer.topic, Kind::Temperature, "arm", &[]);
    let mut noise = Stream::new(config.seed, Purpose::Temperature, 2 * recording);
    let draw = Stream::new(config.seed, Purpose::Temperature, 2 * recording + 1);
    let transport = Transport::new(&config.joints.transport, draw);
    log_evenly(config, (recording, session), (channel, thermometer.rate_hz, transport), log, |time_s| {
        let (step, ..) = bracketing_steps(time_s, session.trace.len());
        let celsius = session.trace.temperature_c[step] + noise.normal() * thermometer.noise_k;
        Payload::Temperature { celsius, variance: thermometer.noise_k.powi(2) }
    });
}
