//! The relation between the robot's clock and the position sensor's clock.

use serde::Serialize;

/// `robot_time = sensor_time - offset - drift * (sensor_time - reference)`.
///
/// A positive offset means that the sensor's stamps are late: the same motion carries a later stamp
/// in the sensor's stream than in the robot's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClockAlignment {
    /// Offset at the reference time [s].
    pub offset_s: f64,
    /// Standard error of the offset [s].
    pub offset_sigma_s: f64,
    /// Relative rate error of the sensor's clock, dimensionless (1e-6 = 1 ppm).
    pub drift: f64,
    /// Standard error of the drift.
    pub drift_sigma: f64,
    /// Sensor time at which the offset holds [ns].
    pub reference_ns: i64,
    /// Correlation of the two speed profiles after alignment, 0 to 1.
    pub correlation: f64,
}

impl ClockAlignment {
    /// Sensor time -> robot time [ns].
    pub fn to_robot_ns(&self, sensor_ns: i64) -> i64 {
        let since_reference_s = (sensor_ns - self.reference_ns) as f64 * 1e-9;
        sensor_ns - ((self.offset_s + self.drift * since_reference_s) * 1e9).round() as i64
    }
}
