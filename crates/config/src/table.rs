//! `[table]`: the calibration table.

use armcal_core::RollPitchYaw;
use armcal_table::AssociationConfig;
use serde::Deserialize;
use std::path::PathBuf;

/// The calibration table.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSection {
    /// Board geometry file.
    pub board: PathBuf,
    /// How the board's pose is known.
    pub pose: BoardPose,
    /// What the table's markers are fixed to, for `pose = "measured"`.
    #[serde(default)]
    pub markers_on: MarkersOn,
    /// Pose of the untilted board (`given`), or of the board relative to the tracked table subject
    /// (`measured`; identity when absent).
    #[serde(default)]
    pub at: RollPitchYaw,
    /// Standard error of a measured board pose beyond the sensor's noise [mm]; 0 takes it as exact.
    #[serde(default)]
    pub sigma_mm: f64,
    /// Same for its rotation [deg].
    #[serde(default)]
    pub sigma_deg: f64,
    /// How dwells are associated to cavities.
    #[serde(default)]
    pub association: AssociationConfig,
}

/// How the board's pose is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BoardPose {
    /// From the `table` stream.
    Measured,
    /// From `at` and the declared tilt.
    Given,
    /// Estimated with the arm, one pose a recording (camera-free).
    Estimated,
}

/// What the table's markers are fixed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MarkersOn {
    /// The board itself: the measured pose includes the tilt.
    #[default]
    Board,
    /// The frame below the tilting mechanism: the declared tilt is applied on top.
    Frame,
}
