//! `[[recordings]]`: which files, and what was declared of each.

use crate::{LoadEntry, PointsFile};
use armcal_recording::without_ending;
use armcal_table::Tilt;
use serde::Deserialize;
use std::path::PathBuf;

/// One recording.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingEntry {
    /// Name used in parameters and outputs; the stem of the first file when absent.
    pub name: Option<String>,
    /// Its files: one, the parts of a split bag or the folder of one; paths, or URLs such as `s3://bucket/key` (feature `s3`).
    pub paths: Vec<PathBuf>,
    /// Declared tilt of the board.
    #[serde(default)]
    pub tilt: Tilt,
    /// Load at the tip [kg].
    #[serde(default)]
    pub load_kg: f64,
    /// Loads at any tip or marker.
    #[serde(default)]
    pub loads: Vec<LoadEntry>,
    /// Points of the tip that a laser tracker exported, one a dwell.
    pub points: Option<PointsFile>,
}

impl RecordingEntry {
    /// The recording's name.
    pub fn name(&self) -> String {
        recording_name(self.name.as_ref(), &self.paths)
    }
}

/// The given name, or the stem of the first file.
pub fn recording_name(given: Option<&String>, paths: &[PathBuf]) -> String {
    let stem = || paths.first().map(|p| without_ending(p));
    let stem = || stem().and_then(|p| p.file_name().map(|s| s.to_string_lossy().into_owned()));
    given.cloned().or_else(stem).unwrap_or_default()
}
