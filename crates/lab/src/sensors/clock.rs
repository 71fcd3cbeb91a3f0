//! The clock of the motion capture system against the clock of the robot.

use crate::config::LabConfig;
use crate::random::{Purpose, Stream};
use serde::{Deserialize, Serialize};

/// `robot_time = sensor_time - offset - drift * (sensor_time - reference)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SensorClock {
    /// How far stamps are late at the reference: clock offset plus latency [s]. This is what alignment finds.
    pub offset_s: f64,
    /// The latency in it: from exposure to stamp [s].
    pub latency_s: f64,
    /// How much faster the sensor's clock runs.
    pub drift: f64,
    /// Sensor time at which the offset holds [ns].
    pub reference_ns: i64,
}

impl SensorClock {
    /// Draws the clock of one recording.
    pub fn draw(config: &LabConfig, recording: usize) -> SensorClock {
        let clock = &config.vicon.clock;
        let mut draw = Stream::new(config.seed, Purpose::Clock, recording);
        let offset_s = (clock.offset_ms + clock.offset_sigma_ms * draw.normal()) * 1e-3;
        let latency_s = clock.latency_ms * 1e-3;
        SensorClock {
            offset_s: offset_s + latency_s,
            latency_s,
            drift: (clock.drift_ppm + clock.drift_sigma_ppm * draw.normal()) * 1e-6,
            reference_ns: config.start_ns(recording),
        }
    }

    /// The stamp of something exposed at `robot_ns` on the robot's clock.
    pub fn stamp_ns(&self, robot_ns: i64) -> i64 {
        let since_reference_s = (robot_ns - self.reference_ns) as f64 * 1e-9;
        let sensor_s = (since_reference_s + self.offset_s) / (1.0 - self.drift);
        self.reference_ns + (sensor_s * 1e9).round() as i64
    }

    /// Seconds on the robot's clock per second on the sensor's.
    pub fn robot_per_sensor(&self) -> f64 {
        1.0 - self.drift
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_invert_the_alignment_the_product_estimates() {
        let clock = SensorClock {
            offset_s: 0.047,
            latency_s: 0.009,
            drift: 25e-6,
            reference_ns: 1_760_000_000_000_000_000,
        };
        for robot_s in [0.0, 1.25, 500.0] {
            let robot_ns = clock.reference_ns + (robot_s * 1e9) as i64;
            let sensor_ns = clock.stamp_ns(robot_ns);
            let since_reference_s = (sensor_ns - clock.reference_ns) as f64 * 1e-9;
            let back_s = since_reference_s - clock.offset_s - clock.drift * since_reference_s;
            assert!((back_s - robot_s).abs() < 2e-9, "{back_s} {robot_s}");
        }
    }
}
