//! Instruments that read one length of the true tip.

use super::message::{Kind, Payload};
use super::transport::Transport;
use super::{Log, log_evenly};
use crate::config::{GaugeKind, LabConfig};
use crate::random::{Purpose, Stream};
use crate::session::Session;
use crate::trace::pose_at;
use armcal_core::Pose;
use nalgebra::{Translation3, UnitQuaternion, Vector3};

/// Where an instrument really stands, and what it really has where it reads zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// In the base frame.
    pub in_base: Pose,
    /// Distance at which it reads zero [m].
    pub zero_m: f64,
}

impl Standing {
    /// Of one of the instruments of a rig.
    pub fn draw(config: &LabConfig, index: usize) -> Standing {
        let gauge = &config.gauges[index];
        let mut draw = Stream::new(config.seed, Purpose::Gauge, index);
        let mut three = |sigma: f64| Vector3::from_fn(|_, _| draw.normal() * sigma);
        let off_m = three(gauge.placement_sigma_mm * 1e-3);
        let turned = UnitQuaternion::from_scaled_axis(three(gauge.placement_sigma_deg.to_radians()));
        let believed = Pose::from(gauge.in_base);
        let in_base = Pose::from_parts(
            Translation3::from(believed.translation.vector + off_m),
            turned * believed.rotation,
        );
        Standing { in_base, zero_m: (gauge.zero_mm + draw.normal() * gauge.zero_sigma_mm) * 1e-3 }
    }

    /// What the instrument should read of a tip, stops and noise aside [m].
    fn length_m(&self, kind: GaugeKind, base: &Pose, tip: &Pose) -> f64 {
        let from = base * self.in_base;
        let gap_m = tip.translation.vector - from.translation.vector;
        let length_m = match kind {
            GaugeKind::Distance => gap_m.norm(),
            GaugeKind::Height => (from.rotation * Vector3::z()).dot(&gap_m),
        };
        length_m - self.zero_m
    }
}

/// Adds the readings of every instrument to the log.
pub fn log_readings(config: &LabConfig, recording: usize, session: &Session, log: &mut Log) {
    for index in 0..config.gauges.len() {
        of_one(config, [recording, index], session, log);
    }
}

fn of_one(config: &LabConfig, [recording, index]: [usize; 2], session: &Session, log: &mut Log) {
    let gauge = &config.gauges[index];
    let channel = log.channel(&gauge.topic, Kind::Float64, "", &[]);
    let standing = Standing::draw(config, index);
    // Behind the draws of where the instruments stand.
    let stream = 1000 + 2 * (recording * config.gauges.len() + index);
    let mut noise = Stream::new(config.seed, Purpose::Gauge, stream);
    let draw = Stream::new(config.seed, Purpose::Gauge, stream + 1);
    let transport = Transport::new(&config.joints.transport, draw);
    log_evenly(config, (recording, session), (channel, gauge.rate_hz, transport), log, |time_s| {
        let base = pose_at(&session.trace.world_from_base, time_s);
        let tip = pose_at(&session.trace.world_from_tip, time_s);
        let read_mm = standing.length_m(gauge.kind, &base, &tip) * 1e3 + noise.normal() * gauge.noise_mm;
        let [low, high] = gauge.range_mm;
        Payload::Number(read_mm.clamp(low, high))
    });
}
