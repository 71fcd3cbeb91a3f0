//! From a stamp to the recorder: never early, never out of order on one channel, sometimes late.

use crate::config::TransportConfig;
use crate::random::Stream;

/// The way of one channel's messages.
#[derive(Debug)]
pub struct Transport<'a> {
    config: &'a TransportConfig,
    draw: Stream,
    last_log_ns: i64,
}

impl<'a> Transport<'a> {
    /// A channel nothing has been sent on.
    pub fn new(config: &'a TransportConfig, draw: Stream) -> Transport<'a> {
        Transport { config, draw, last_log_ns: i64::MIN }
    }

    /// By how much the next sample misses its nominal instant [s].
    pub fn period_jitter_s(&mut self) -> f64 {
        self.draw.normal() * self.config.period_jitter_ms * 1e-3
    }

    /// Log time of a message sent at `sent_ns`, both on the clock of the recording computer.
    pub fn log_ns(&mut self, sent_ns: i64) -> i64 {
        let delay_ms = self.config.shortest_ms + self.draw.exponential(self.config.mean_extra_ms);
        let log_ns = sent_ns + (delay_ms * 1e6) as i64;
        self.last_log_ns = log_ns.max(self.last_log_ns.saturating_add(1_000));
        self.last_log_ns
    }

    /// Jitter of a stamp, `sigma_ms` 1 sigma [ns].
    pub fn stamp_jitter_ns(&mut self, sigma_ms: f64) -> i64 {
        (self.draw.normal() * sigma_ms * 1e6) as i64
    }
}
