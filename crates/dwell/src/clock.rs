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
    /// Sensor time at which the offset holds [ns], chosen so that the errors of offset and drift are
    /// uncorrelated (where that time lies inside the recording).
    pub reference_ns: i64,
    /// The sensor's first stamp [ns].
    pub first_ns: i64,
    /// Correlation of the two speed profiles after alignment, 0 to 1; NaN where they could not be compared.
    pub correlation: f64,
    /// Median ratio of measured to predicted distances between positions of the tip; 1 up to a few percent
    /// when units, model and tracked point are right. NaN where they could not be compared.
    pub displacement_ratio: f64,
    /// Whether offset and drift are those that the pipeline declares, rather than estimated.
    pub declared: bool,
}

impl ClockAlignment {
    /// Sensor time -> robot time [ns]. Saturates at the ends of `i64`.
    pub fn to_robot_ns(&self, sensor_ns: i64) -> i64 {
        let offset_ns = (self.offset_s + self.drift * self.since_reference_s(sensor_ns)) * 1e9;
        sensor_ns.saturating_sub(offset_ns.round() as i64)
    }

    /// Standard error of the conversion at a sensor time [s].
    pub fn sigma_s(&self, sensor_ns: i64) -> f64 {
        self.offset_sigma_s.hypot(self.drift_sigma * self.since_reference_s(sensor_ns))
    }

    /// Offset at the sensor's first stamp and its standard error [s]: what a pipeline declares, and what is shown.
    pub fn first_offset_s(&self) -> [f64; 2] {
        let since_s = self.since_reference_s(self.first_ns);
        [self.offset_s + self.drift * since_s, self.sigma_s(self.first_ns)]
    }

    fn since_reference_s(&self, sensor_ns: i64) -> f64 {
        crate::series::seconds_between(self.reference_ns, sensor_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alignment() -> ClockAlignment {
        ClockAlignment {
            offset_s: 0.25,
            offset_sigma_s: 3e-4,
            drift: 1e-5,
            drift_sigma: 4e-6,
            reference_ns: 1_000_000_000,
            first_ns: -99_000_000_000,
            correlation: 1.0,
            displacement_ratio: 1.0,
            declared: false,
        }
    }

    #[test]
    fn a_late_sensor_is_brought_back() {
        // 100 s after the reference: 0.25 s + 100 s * 1e-5 = 0.251 s late.
        assert_eq!(alignment().to_robot_ns(101_000_000_000), 101_000_000_000 - 251_000_000);
        assert_eq!(alignment().to_robot_ns(1_000_000_000), 750_000_000);
    }

    #[test]
    fn sigma_grows_away_from_the_reference() {
        let a = alignment();
        assert!((a.sigma_s(a.reference_ns) - 3e-4).abs() < 1e-15);
        assert!((a.sigma_s(a.reference_ns + 100_000_000_000) - 5e-4).abs() < 1e-12);
    }

    #[test]
    fn what_is_shown_is_the_offset_at_the_first_stamp() {
        let [offset_s, sigma_s] = alignment().first_offset_s();
        assert!((offset_s - (0.25 - 100.0 * 1e-5)).abs() < 1e-12);
        assert!((sigma_s - 5e-4).abs() < 1e-12);
    }

    #[test]
    fn extreme_stamps_saturate() {
        let a = alignment();
        assert!(a.to_robot_ns(i64::MIN) < 0);
        assert!(a.to_robot_ns(i64::MAX) > 0);
    }
}
