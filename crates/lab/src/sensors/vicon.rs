//! The motion capture system: noisy, late, on its own clock, sometimes blind.

use super::Log;
use super::message::{Kind, Message, Payload};
use super::outliers::{Tails, draw_swaps, swapped_m};
use super::transport::Transport;
use crate::config::{BodyConfig, LabConfig, PoseMessage, ViconConfig};
use crate::mechanism::Body;
use crate::random::{Purpose, Stream};
use crate::session::Session;
use crate::trace::pose_at;
use armcal_core::Pose;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A time in which a subject was not seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Occlusion {
    /// The subject.
    pub subject: String,
    /// Start on the robot's clock [ns].
    pub start_ns: i64,
    /// End on the robot's clock [ns].
    pub end_ns: i64,
    /// What was published meanwhile.
    pub kind: OcclusionKind,
    /// Frames published in it.
    pub frames: usize,
}

/// What a bridge publishes while a subject is occluded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OcclusionKind {
    /// Zero position and zero quaternion: what the SDK returns, as ros2-vicon-receiver passes it on.
    Zeros,
    /// The last pose again and again.
    Frozen,
}

/// Adds the frames of one subject to the log.
pub fn log_subject(config: &LabConfig, recording: usize, session: &Session, body: Body, log: &mut Log) {
    let vicon = &config.vicon;
    let (settings, purposes) = match body {
        Body::Tip => (vicon.tip.clone(), [Purpose::ViconTip, Purpose::OcclusionTip, Purpose::TransportTip]),
        Body::Table => {
            (vicon.table.clone(), [Purpose::ViconTable, Purpose::OcclusionTable, Purpose::TransportTable])
        }
        Body::Base => {
            (vicon.base.clone(), [Purpose::ViconBase, Purpose::OcclusionBase, Purpose::TransportBase])
        }
        Body::Marker(marker) => (
            vicon.markers[marker].body(),
            [Purpose::ViconMarker, Purpose::OcclusionMarker, Purpose::TransportMarker],
        ),
    };
    let settings = &settings;
    // Markers have their streams one after the other: of each as many as there are recordings.
    let stream = match body {
        Body::Marker(marker) => marker * config.recordings.len() + recording,
        _ => recording,
    };
    let [noise, occlusion, transport] = purposes.map(|p| Stream::new(config.seed, p, stream));
    let (clock, start_ns) = (log.clock, config.start_ns(recording));
    let kind = match vicon.message {
        PoseMessage::PoseStamped => Kind::PoseStamped,
        PoseMessage::TransformStamped => Kind::TransformStamped,
    };
    let name = format!("{0}/{0}", settings.subject);
    let channel = log.channel(&format!("/vicon/{name}"), kind, &vicon.frame_id, &[name]);
    let mut noise = Noise::new(vicon, settings, noise);
    let mut occlusions = draw_occlusions(settings, session.trace.duration_s(), start_ns, occlusion);
    let mut transport = Transport::new(&vicon.clock.transport, transport);
    let mut tails = Tails::new(vicon, config.seed, recording);
    let swaps = if body == Body::Tip {
        draw_swaps(config, recording, session.trace.duration_s())
    } else {
        Vec::new()
    };
    // The cameras keep time by their own clock.
    let period_s = clock.robot_per_sensor() / settings.rate_hz;
    let mut last = Payload::Pose { position_m: Vector3::zeros(), orientation: Quaternion::identity() };
    for sequence in 0..=(session.trace.duration_s() / period_s).floor() as u32 {
        let time_s = f64::from(sequence) * period_s;
        let robot_ns = start_ns + (time_s * 1e9).round() as i64;
        let mut truth = pose_at(session.trace.seen(body), time_s);
        truth.translation.vector += swapped_m(&swaps, time_s);
        let seen = noise.frame(&truth, tails.at(time_s), vicon.single_precision);
        let hidden = occlusions.iter_mut().find(|o| (o.start_ns..o.end_ns).contains(&robot_ns));
        let payload = match hidden {
            None => seen,
            Some(occlusion) => {
                occlusion.frames += 1;
                match occlusion.kind {
                    OcclusionKind::Frozen => last.clone(),
                    OcclusionKind::Zeros => Payload::Pose {
                        position_m: Vector3::zeros(),
                        orientation: Quaternion::new(0.0, 0.0, 0.0, 0.0),
                    },
                }
            }
        };
        let stamp_ns = clock.stamp_ns(robot_ns) + transport.stamp_jitter_ns(vicon.clock.stamp_jitter_ms);
        let log_ns = transport.log_ns(robot_ns + (clock.latency_s * 1e9) as i64);
        log.messages.push(Message { channel, sequence, stamp_ns, log_ns, payload: payload.clone() });
        last = payload;
    }
    occlusions.retain(|occlusion| occlusion.frames > 0);
    log.occlusions.extend(occlusions);
}

/// Bursts at random times; a burst that begins in another one is part of it.
fn draw_occlusions(
    settings: &BodyConfig,
    duration_s: f64,
    start_ns: i64,
    mut draw: Stream,
) -> Vec<Occlusion> {
    let mut occlusions: Vec<Occlusion> = Vec::new();
    if settings.occlusions_per_minute == 0.0 {
        return occlusions;
    }
    let mut time_s = 0.0;
    loop {
        time_s += draw.exponential(60.0 / settings.occlusions_per_minute);
        let length_s = draw.exponential(settings.occlusion_s);
        let kind = if draw.chance(0.5) { OcclusionKind::Zeros } else { OcclusionKind::Frozen };
        if time_s >= duration_s {
            return occlusions;
        }
        let at_ns = |s: f64| start_ns + (s * 1e9) as i64;
        let (start_ns, end_ns) = (at_ns(time_s), at_ns(time_s + length_s));
        occlusions.push(Occlusion { subject: settings.subject.clone(), start_ns, end_ns, kind, frames: 0 });
        time_s += length_s;
    }
}

/// White noise plus a first-order correlated part, in position and orientation.
struct Noise {
    draw: Stream,
    keep: f64,
    white: f64,
    slow: f64,
    sigma_m: f64,
    sigma_rad: f64,
    slow_position: Vector3<f64>,
    slow_rotation: Vector3<f64>,
}

impl Noise {
    fn new(vicon: &ViconConfig, settings: &BodyConfig, mut draw: Stream) -> Noise {
        let (slow_position, slow_rotation) = (draw.normal3(), draw.normal3());
        Noise {
            draw,
            keep: (-1.0 / (settings.rate_hz * vicon.correlation_s)).exp(),
            white: (1.0 - vicon.correlated_share).sqrt(),
            slow: vicon.correlated_share.sqrt(),
            sigma_m: vicon.sigma_m(),
            sigma_rad: settings.rotation_sigma_deg.to_radians(),
            slow_position,
            slow_rotation,
        }
    }

    /// What one frame makes of a true pose.
    fn frame(&mut self, truth: &Pose, tail: f64, single_precision: bool) -> Payload {
        let step = (1.0 - self.keep * self.keep).sqrt();
        self.slow_position = self.slow_position * self.keep + self.draw.normal3() * step;
        self.slow_rotation = self.slow_rotation * self.keep + self.draw.normal3() * step;
        let shift =
            (self.draw.normal3() * self.white + self.slow_position * self.slow) * (self.sigma_m * tail);
        let turn = (self.draw.normal3() * self.white + self.slow_rotation * self.slow) * self.sigma_rad;
        let position_m = truth.translation.vector + shift;
        let orientation = (truth.rotation * UnitQuaternion::from_scaled_axis(turn)).into_inner();
        if !single_precision {
            return Payload::Pose { position_m, orientation };
        }
        let single = |v: f64| f64::from(v as f32);
        Payload::Pose {
            position_m: position_m.map(single),
            orientation: Quaternion::from(orientation.coords.map(single)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_the_declared_size_and_correlation() {
        let vicon = ViconConfig { correlated_share: 0.4, correlation_s: 0.1, ..ViconConfig::default() };
        let mut noise = Noise::new(&vicon, &vicon.tip, Stream::new(5, Purpose::ViconTip, 0));
        let truth = Pose::translation(1.0, -2.0, 0.5);
        let n = 60_000;
        let errors: Vec<(Vector3<f64>, f64)> = (0..n)
            .map(|_| match noise.frame(&truth, 1.0, false) {
                Payload::Pose { position_m, orientation } => {
                    (position_m - truth.translation.vector, 2.0 * orientation.i)
                }
                _ => panic!("not a pose"),
            })
            .collect();
        let inside = errors.iter().filter(|(e, _)| e.y.abs() < 0.28e-3).count() as f64 / n as f64;
        assert!((inside - 0.95).abs() < 0.006, "{inside} of the frames within 0.28 mm");
        let variance = errors.iter().map(|(e, _)| e.x * e.x).sum::<f64>() / n as f64;
        let lagged = errors.windows(6).map(|w| w[0].0.x * w[5].0.x).sum::<f64>() / n as f64;
        // Five frames at 100 Hz and 0.1 s: 0.4 exp(-0.5) = 0.243.
        assert!((lagged / variance - 0.243).abs() < 0.03, "{}", lagged / variance);
        let turn = (errors.iter().map(|(_, r)| r * r).sum::<f64>() / n as f64).sqrt();
        assert!((turn.to_degrees() - 0.15).abs() < 0.005, "{}", turn.to_degrees());
    }

    #[test]
    fn occlusions_come_as_often_as_declared() {
        let body = BodyConfig { occlusions_per_minute: 6.0, occlusion_s: 0.5, ..ViconConfig::default().tip };
        let drawn = draw_occlusions(&body, 6000.0, 0, Stream::new(1, Purpose::OcclusionTip, 0));
        // 10 s between bursts plus 0.5 s in one: 571 expected, standard deviation about 24.
        assert!((480..660).contains(&drawn.len()), "{}", drawn.len());
        assert!(drawn.windows(2).all(|w| w[0].end_ns <= w[1].start_ns));
        let frozen = drawn.iter().filter(|o| o.kind == OcclusionKind::Frozen).count() as f64;
        assert!((frozen / drawn.len() as f64 - 0.5).abs() < 0.1);
    }
}
