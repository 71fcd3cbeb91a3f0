//! `[observations]`: which dwells take part, and how exact the sensor is.

use serde::Deserialize;

/// Which dwells become observations.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationsSection {
    /// Dwells in a cavity.
    pub seated: bool,
    /// Dwells the sensor saw away from the cavities.
    pub tracked: bool,
    /// Standard error of a tracked position that averaging does not reduce, per axis [mm].
    pub sensor_sigma_mm: f64,
    /// Same for orientation [deg].
    pub sensor_sigma_deg: f64,
}

impl Default for ObservationsSection {
    fn default() -> Self {
        ObservationsSection { seated: true, tracked: true, sensor_sigma_mm: 0.0, sensor_sigma_deg: 0.0 }
    }
}
