//! Instruments that read one length of the tip: a ballbar or a wire to a fixed point, a gauge above a plane.

use super::default_placement_mm;
use crate::LabError;
use crate::checks::{check_not_negative, check_positive, check_range, value_error};
use armcal_core::RollPitchYaw;
use serde::{Deserialize, Serialize};

/// One instrument. It reads millimetres, as `std_msgs/msg/Float64`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GaugeConfig {
    /// Topic.
    pub topic: String,
    /// What it measures.
    pub kind: GaugeKind,
    /// Where it stands in the robot's base frame, as the lab believes it: the point, or the plane with its normal along z.
    pub in_base: RollPitchYaw,
    /// Where it really stands: deviation of each coordinate, 1 sigma [mm]. Default 3.
    #[serde(default = "default_placement_mm")]
    pub placement_sigma_mm: f64,
    /// How a plane really lies: deviation about each axis, 1 sigma [deg]. Default 0.3.
    #[serde(default = "default_placement_deg")]
    pub placement_sigma_deg: f64,
    /// Distance at which it reads zero [mm]. Default 0.
    #[serde(default)]
    pub zero_mm: f64,
    /// How well that is known, 1 sigma [mm]. Default 0.
    #[serde(default)]
    pub zero_sigma_mm: f64,
    /// Its stops: it reads no less and no more [mm].
    pub range_mm: [f64; 2],
    /// Noise of a reading, 1 sigma [mm]. Default 0.005.
    #[serde(default = "default_noise_mm")]
    pub noise_mm: f64,
    /// Rate [Hz]. Default 50.
    #[serde(default = "default_rate_hz")]
    pub rate_hz: f64,
}

/// What an instrument measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum GaugeKind {
    /// How far the tip is from a point.
    Distance,
    /// How high it is above a plane.
    Height,
}

fn default_placement_deg() -> f64 {
    0.3
}

fn default_noise_mm() -> f64 {
    0.005
}

fn default_rate_hz() -> f64 {
    50.0
}

impl GaugeConfig {
    pub(super) fn check(&self) -> Result<(), LabError> {
        if self.topic.is_empty() {
            return Err(value_error("gauges.topic", "is empty; name it".to_owned()));
        }
        check_not_negative("gauges.placement_sigma_mm", self.placement_sigma_mm)?;
        check_not_negative("gauges.placement_sigma_deg", self.placement_sigma_deg)?;
        check_not_negative("gauges.zero_sigma_mm", self.zero_sigma_mm)?;
        check_not_negative("gauges.noise_mm", self.noise_mm)?;
        check_positive("gauges.rate_hz", self.rate_hz)?;
        check_range("gauges.range_mm", self.range_mm)
    }
}
