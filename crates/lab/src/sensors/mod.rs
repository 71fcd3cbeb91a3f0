//! What the recorder gets to see of a session: encoders, cameras, a thermometer, gauges, each with its clock.

mod clock;
pub(crate) mod encoder;
pub(crate) mod gauge;
mod message;
pub(crate) mod outliers;
mod temperature;
pub(crate) mod transport;
mod vicon;

pub use clock::SensorClock;
pub use message::{Channel, Kind, Message, Payload};
pub use vicon::{Occlusion, OcclusionKind};

use crate::config::LabConfig;
use crate::mechanism::Body;
use crate::session::Session;
use transport::Transport;

/// Everything that reached the recorder.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// The channels.
    pub channels: Vec<Channel>,
    /// The messages, in the order of their log times.
    pub messages: Vec<Message>,
    /// The sensor's clock.
    pub clock: SensorClock,
    /// When which subject was occluded.
    pub occlusions: Vec<Occlusion>,
}

impl Log {
    /// Nothing was recorded yet.
    pub fn new(clock: SensorClock) -> Log {
        Log { channels: Vec::new(), messages: Vec::new(), clock, occlusions: Vec::new() }
    }

    /// Announces a channel.
    pub fn channel(&mut self, topic: &str, kind: Kind, frame_id: &str, names: &[String]) -> usize {
        let (topic, frame_id, names) = (topic.to_owned(), frame_id.to_owned(), names.to_vec());
        self.channels.push(Channel { topic, kind, frame_id, names });
        self.channels.len() - 1
    }

    /// In the order of the log times. Stable: messages logged in the same nanosecond keep the order of their channels.
    pub fn in_order(mut self) -> Log {
        self.messages.sort_by_key(|message| message.log_ns);
        self
    }
}

/// Adds messages that come evenly, so many a second, stamped by the robot's clock; `payload` is told when [s].
fn log_evenly(
    config: &LabConfig,
    (recording, session): (usize, &Session),
    (channel, rate_hz, mut transport): (usize, f64, Transport),
    log: &mut Log,
    mut payload: impl FnMut(f64) -> Payload,
) {
    for sequence in 0..=(session.trace.duration_s() * rate_hz).floor() as u32 {
        let time_s = f64::from(sequence) / rate_hz;
        let payload = payload(time_s);
        let stamp_ns = config.start_ns(recording) + (time_s * 1e9).round() as i64;
        let log_ns = transport.log_ns(stamp_ns);
        log.messages.push(Message { channel, sequence, stamp_ns, log_ns, payload });
    }
}

/// Records a session.
pub fn record_session(config: &LabConfig, recording: usize, session: &Session) -> Log {
    let clock = SensorClock::draw(config, recording);
    let mut log = Log::new(clock);
    encoder::joint_states(config, recording, session, &mut log);
    let markers = (0..config.vicon.markers.len()).map(Body::Marker);
    for body in [Body::Tip, Body::Table, Body::Base].into_iter().chain(markers) {
        vicon::log_subject(config, recording, session, body, &mut log);
    }
    if config.temperature.published {
        temperature::log_readings(config, recording, session, &mut log);
    }
    gauge::log_readings(config, recording, session, &mut log);
    encoder::set_points(config, recording, session, &mut log);
    log.in_order()
}
