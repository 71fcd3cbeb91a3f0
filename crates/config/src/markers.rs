//! `[markers.*]`: what else is seen of the arm than its tip.

use crate::{FramePose, FrameSection};
use armcal_core::RollPitchYaw;
use serde::Deserialize;

/// A marker on a link of the arm; `[streams.bodies]` says by its name where it is read. One that `[closed_chain]` names need
/// not be: the tip of another branch.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerSection {
    /// The link of a URDF, or the row of a DH table, that it is on.
    pub link: String,
    /// How its place on the link is known.
    #[serde(default = "estimated")]
    pub pose: FramePose,
    /// Its place on the link, or where the estimate starts.
    #[serde(default)]
    pub at: RollPitchYaw,
    /// Standard error of a measured place [mm].
    #[serde(default)]
    pub sigma_mm: f64,
    /// Same for its rotation [deg].
    #[serde(default)]
    pub sigma_deg: f64,
}

fn estimated() -> FramePose {
    FramePose::Estimated
}

impl MarkerSection {
    /// Its place as any other frame.
    pub fn frame(&self) -> FrameSection {
        let MarkerSection { pose, at, sigma_mm, sigma_deg, .. } = *self;
        FrameSection { pose, at, sigma_mm, sigma_deg }
    }
}
