//! `[markers.*]`: what else is seen of the arm than its tip.

use super::{FramePose, FrameSection, Pipeline};
use crate::error::Error;
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

/// Markers that contradict the streams, or themselves; `fail` makes an error of a key and what is wrong with it.
pub(super) fn check(
    pipeline: &Pipeline,
    fail: &dyn Fn(&str, String) -> Result<(), Error>,
) -> Result<(), Error> {
    let bodies = &pipeline.streams.bodies;
    for (name, marker) in &pipeline.markers {
        let key = format!("markers.{name}");
        if let Some(why) = no_name(name) {
            return fail(&key, why);
        }
        let joined = pipeline.closed_chain.iter().flat_map(|chain| &chain.between).flatten();
        if !bodies.contains_key(name) && !joined.into_iter().any(|point| point == name) {
            return fail(&key, format!("has no [streams.bodies.{name}] that says where it is read"));
        }
        if marker.pose == FramePose::Measured && marker.sigma_mm == 0.0 {
            let problem = "is \"measured\" without sigma_mm; give it, or pose = \"given\"";
            return fail(&format!("{key}.pose"), problem.into());
        }
    }
    match bodies.keys().find(|name| !pipeline.markers.contains_key(*name)) {
        None => Ok(()),
        Some(name) => {
            let next = format!("add [markers.{name}] with link = \"...\"");
            let problem = format!("is read, but nothing says which link it is on: {next}");
            fail(&format!("streams.bodies.{name}"), problem)
        }
    }
}

/// Why a marker, or a place, cannot have a name; it begins the names of its parameters.
pub(super) fn no_name(name: &str) -> Option<String> {
    let taken = ["tip", "base", "board", "world", "table"].contains(&name);
    let plain = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    match (taken, plain) {
        (true, _) => Some("is the name of something else; give it another".to_owned()),
        (_, false) => Some("is no name: use letters, digits, _ and -".to_owned()),
        _ => None,
    }
}
