//! Configuration of clock alignment and dwell detection, with its defaults.

use crate::DwellError;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// How the sensor's clock is aligned with the robot's (`[clock]` of a pipeline).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ClockConfig {
    /// Half-width of the search for the offset [s]. Default 2.
    pub max_offset_s: f64,
    /// Centre of the search, sensor minus robot [s]: for clocks that count from different epochs. Default 0.
    pub initial_offset_s: f64,
    /// Largest credible relative rate error [ppm]; a drift that the data determine no better than this is
    /// not estimated. Default 1000.
    pub max_drift_ppm: f64,
    /// Length of the shortest smoothing kernel of both speeds [s]; widened for slow streams, and tried at 3
    /// and 10 times the length as well. Default 0.2.
    pub smoothing_s: f64,
    /// Longest gap between rows that is bridged by a straight line [s]; at least 3.5 sample periods. Default 0.05.
    pub max_gap_s: f64,
    /// Least time in motion [s]. Default 3.
    pub min_motion_s: f64,
    /// Speed below which the tip counts as standing [mm/s]. Default 5.
    pub min_speed_mm_s: f64,
    /// Least correlation of predicted and measured speed. Default 0.6.
    pub min_correlation: f64,
    /// `"same"`: one clock stamps both streams. Nothing is estimated then; the motion may contradict.
    pub known: Option<KnownClock>,
    /// The offset, where it is known: sensor minus robot at the sensor's first stamp [ms]. Nothing is estimated then.
    pub offset_ms: Option<f64>,
    /// The drift beside a known offset [ppm]; 0 where it is not given.
    pub drift_ppm: Option<f64>,
}

/// A relation of the two clocks that has a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum KnownClock {
    /// Sensor and robot are stamped by one clock.
    Same,
}

/// Offset and drift as a pipeline declares them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Declared {
    /// Sensor minus robot at the sensor's first stamp [s].
    pub offset_s: f64,
    pub drift: f64,
}

impl Default for ClockConfig {
    fn default() -> Self {
        ClockConfig {
            max_offset_s: 2.0,
            initial_offset_s: 0.0,
            max_drift_ppm: 1000.0,
            smoothing_s: 0.2,
            max_gap_s: 0.05,
            min_motion_s: 3.0,
            min_speed_mm_s: 5.0,
            min_correlation: 0.6,
            known: None,
            offset_ms: None,
            drift_ppm: None,
        }
    }
}

impl ClockConfig {
    /// Checks the values; the key at fault is in the error.
    pub fn check(&self) -> Result<(), DwellError> {
        let within = |key, value, range, why| check_range("clock", key, value, range, why);
        within("max_offset_s", self.max_offset_s, 1e-3..=3600.0, "must be between 0.001 and 3600")?;
        within("initial_offset_s", self.initial_offset_s, -9e9..=9e9, "must be a finite number of seconds")?;
        within("max_drift_ppm", self.max_drift_ppm, 0.0..=1e4, "must be between 0 and 10000")?;
        within("smoothing_s", self.smoothing_s, 1e-3..=10.0, "must be between 0.001 and 10")?;
        within("max_gap_s", self.max_gap_s, 0.0..=10.0, "must be between 0 and 10")?;
        within("min_motion_s", self.min_motion_s, 0.0..=f64::MAX, "must not be negative")?;
        within("min_speed_mm_s", self.min_speed_mm_s, 0.0..=f64::MAX, "must not be negative")?;
        within("min_correlation", self.min_correlation, 0.0..=1.0, "must be between 0 and 1")?;
        self.check_declared()
    }

    /// The relation of the clocks, where it is declared.
    pub(crate) fn declared(&self) -> Option<Declared> {
        let offset_s = self.offset_ms.map(|ms| ms * 1e-3).or(self.known.map(|KnownClock::Same| 0.0))?;
        Some(Declared { offset_s, drift: self.drift_ppm.unwrap_or(0.0) * 1e-6 })
    }

    fn check_declared(&self) -> Result<(), DwellError> {
        let s = "clock";
        let refuse = |key, value, why| Err(DwellError::Config { section: s, key, value, why });
        match (self.known, self.offset_ms, self.drift_ppm) {
            (Some(_), Some(value), _) => {
                refuse("offset_ms", value, "is not known beside known = \"same\": keep one")
            }
            (Some(_), _, Some(value)) => {
                refuse("drift_ppm", value, "is not known beside known = \"same\": keep one")
            }
            (None, None, Some(value)) => refuse("drift_ppm", value, "needs offset_ms beside it"),
            (_, offset_ms, drift_ppm) => {
                let (offset_ms, drift_ppm) = (offset_ms.unwrap_or(0.0), drift_ppm.unwrap_or(0.0));
                check_range(
                    s,
                    "offset_ms",
                    offset_ms,
                    -9e12..=9e12,
                    "must be a finite number of milliseconds",
                )?;
                let most = self.max_drift_ppm;
                check_range(s, "drift_ppm", drift_ppm, -most..=most, "must be within max_drift_ppm")
            }
        }
    }
}

/// What counts as a dwell, and how it is summarised (`[dwell]` of a pipeline).
///
/// Floors for joints are in degrees; a prismatic joint reads 1 rad as 1 m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DwellConfig {
    /// Shortest dwell [s]. Default 0.4.
    pub min_duration_s: f64,
    /// Length of the window whose spread decides stillness [s]; at least 5 sample periods. Default 0.12,
    /// a period of hand tremor (8 to 12 Hz).
    pub window_s: f64,
    /// A gap between joint rows longer than this ends a dwell [s]; at least 3.5 sample periods. Default 0.25.
    pub max_gap_s: f64,
    /// A dwell begins where every spread falls below this many times the noise at rest. Default 2.5.
    pub enter_factor: f64,
    /// A dwell ends where a spread rises above this many times the noise at rest. Default 5.
    pub leave_factor: f64,
    /// Edges are trimmed while the local mean is further than this many times the noise from the pose at
    /// rest (slow settling, tremor before rest). Default 2.
    pub settle_factor: f64,
    /// Spread of a joint that always counts as still [deg]. Default 0.005.
    pub joint_floor_deg: f64,
    /// Whether the tip stream has a say in what is still. Default true.
    pub use_tip: bool,
    /// Spread of the tip that always counts as still, per axis [mm]. Default 0.05.
    pub tip_floor_mm: f64,
    /// Two still intervals at the same pose this close are one dwell [s]. Default 0.15.
    pub merge_gap_s: f64,
    /// Cut off both ends of a dwell [s], except where the stream itself begins or ends. Default 0.02.
    pub trim_s: f64,
    /// How far a joint may creep while the arm rests [deg]: slowly, one way, and never faster than before. Default 0.3.
    pub creep_deg: f64,
    /// How far a joint must have been away for its arrival direction to be known [deg]. Default 0.3.
    pub arrival_threshold_deg: f64,
    /// The same in encoder counts, for quantised encoders; the larger of both holds. Default 3.
    pub arrival_threshold_counts: f64,
    /// Dwells worth fewer independent readings are warned about. Default 4.
    pub min_effective_samples: f64,
    /// Standard error of a mean tip position below which is not believed, per axis [mm]. Default 0.01.
    pub tip_sigma_floor_mm: f64,
    /// Standard error of a mean orientation below which is not believed, per axis [deg]. Default 0.001.
    pub orientation_sigma_floor_deg: f64,
    /// A temperature reading further from a dwell than this is not used for it [s]. Default 60.
    pub temperature_max_age_s: f64,
}

impl Default for DwellConfig {
    fn default() -> Self {
        DwellConfig {
            min_duration_s: 0.4,
            window_s: 0.12,
            max_gap_s: 0.25,
            enter_factor: 2.5,
            leave_factor: 5.0,
            settle_factor: 2.0,
            joint_floor_deg: 0.005,
            use_tip: true,
            tip_floor_mm: 0.05,
            merge_gap_s: 0.15,
            trim_s: 0.02,
            creep_deg: 0.3,
            arrival_threshold_deg: 0.3,
            arrival_threshold_counts: 3.0,
            min_effective_samples: 4.0,
            tip_sigma_floor_mm: 0.01,
            orientation_sigma_floor_deg: 0.001,
            temperature_max_age_s: 60.0,
        }
    }
}

impl DwellConfig {
    /// Checks the values; the key at fault is in the error.
    pub fn check(&self) -> Result<(), DwellError> {
        let within = |key, value, range, why| check_range("dwell", key, value, range, why);
        let enter = self.enter_factor;
        within("min_duration_s", self.min_duration_s, 1e-3..=1e6, "must be at least 0.001")?;
        within("window_s", self.window_s, 1e-3..=60.0, "must be between 0.001 and 60")?;
        within("enter_factor", enter, 1.0..=1e9, "must be at least 1")?;
        within("leave_factor", self.leave_factor, enter..=1e9, "must be at least enter_factor")?;
        for (key, value) in [
            ("max_gap_s", self.max_gap_s),
            ("settle_factor", self.settle_factor),
            ("joint_floor_deg", self.joint_floor_deg),
            ("tip_floor_mm", self.tip_floor_mm),
            ("merge_gap_s", self.merge_gap_s),
            ("trim_s", self.trim_s),
            ("creep_deg", self.creep_deg),
            ("arrival_threshold_deg", self.arrival_threshold_deg),
            ("arrival_threshold_counts", self.arrival_threshold_counts),
            ("min_effective_samples", self.min_effective_samples),
            ("tip_sigma_floor_mm", self.tip_sigma_floor_mm),
            ("orientation_sigma_floor_deg", self.orientation_sigma_floor_deg),
            ("temperature_max_age_s", self.temperature_max_age_s),
        ] {
            within(key, value, 0.0..=f64::MAX, "must be finite and not negative")?;
        }
        Ok(())
    }
}

fn check_range(
    section: &'static str,
    key: &'static str,
    value: f64,
    range: RangeInclusive<f64>,
    why: &'static str,
) -> Result<(), DwellError> {
    if range.contains(&value) { Ok(()) } else { Err(DwellError::Config { section, key, value, why }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_key_is_refused_and_defaults_are_valid() {
        assert!(toml::from_str::<DwellConfig>("min_duration = 1").is_err());
        let c: DwellConfig = toml::from_str("min_duration_s = 1.0").expect("valid");
        assert_eq!(c, DwellConfig { min_duration_s: 1.0, ..DwellConfig::default() });
        assert_eq!(c.check(), Ok(()));
        assert_eq!(ClockConfig::default().check(), Ok(()));
    }

    #[test]
    fn a_senseless_value_names_its_key() {
        let c = DwellConfig { leave_factor: 1.0, ..DwellConfig::default() };
        assert!(matches!(c.check(), Err(DwellError::Config { key: "leave_factor", .. })));
        let c = ClockConfig { smoothing_s: f64::NAN, ..ClockConfig::default() };
        assert!(matches!(c.check(), Err(DwellError::Config { key: "smoothing_s", .. })));
    }
}
