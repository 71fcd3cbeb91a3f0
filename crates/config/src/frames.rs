//! `[frames]` and `[sensor]`: what is known of base, tip, vertical and sensor.

use armcal_core::RollPitchYaw;
use armcal_model::{Frame, Knowledge};
use serde::Deserialize;

/// What is known of the position sensor itself.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorSection {
    /// Standard error of its scale along each axis [ppm], beyond which no explanation goes; 0 takes the scale as exact.
    pub scale_sigma_ppm: Option<f64>,
}

/// What is known about the frames that are not the board.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramesSection {
    /// The robot's base in the sensor's frame; without a sensor the base is the world.
    #[serde(default)]
    pub base: FrameSection,
    /// The calibrated point on the last link.
    #[serde(default)]
    pub tip: FrameSection,
    /// Which frame's z axis is vertical; gravity bends the arm along it.
    #[serde(default)]
    pub vertical: Vertical,
}

/// Which frame's z axis points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Vertical {
    /// The sensor's frame, levelled.
    #[default]
    World,
    /// The robot's base, standing upright; for a sensor whose frame lies anyhow.
    Base,
}

/// One frame.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameSection {
    /// How it is known.
    #[serde(default)]
    pub pose: FramePose,
    /// The given pose, or where the estimate starts.
    #[serde(default)]
    pub at: RollPitchYaw,
    /// Standard error of a measured frame [mm].
    #[serde(default)]
    pub sigma_mm: f64,
    /// Same for its rotation [deg].
    #[serde(default)]
    pub sigma_deg: f64,
}

/// How a frame is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FramePose {
    /// Exactly `at`.
    #[default]
    Given,
    /// From the `base` stream, with `sigma_mm` and `sigma_deg` (for the tip: `at` with those).
    Measured,
    /// Estimated with the arm.
    Estimated,
}

impl FrameSection {
    /// The frame as the model has it.
    pub fn frame(&self, name: &str, free_rotation: bool) -> Frame {
        let knowledge = match self.pose {
            FramePose::Given => Knowledge::Given,
            FramePose::Measured => pose_knowledge(self.sigma_mm, self.sigma_deg),
            FramePose::Estimated => Knowledge::Estimated,
        };
        Frame { name: name.into(), pose: self.at.into(), knowledge, free_rotation }
    }
}

/// Zero standard error means that the pose is taken as exact.
pub fn pose_knowledge(sigma_mm: f64, sigma_deg: f64) -> Knowledge {
    if sigma_mm == 0.0 && sigma_deg == 0.0 {
        return Knowledge::Given;
    }
    Knowledge::Measured { sigma_m: sigma_mm * 1e-3, sigma_rad: sigma_deg.to_radians() }
}
