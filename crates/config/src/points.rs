//! `points` of a recording: what a laser tracker exported beside it.

use armcal_recording::LengthUnit;
use serde::Deserialize;
use std::path::PathBuf;

/// Points of the tip, dwell by dwell, in a CSV file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointsFile {
    /// The file.
    pub csv: PathBuf,
    /// Unit of the coordinates; default `mm`.
    #[serde(default = "millimetres")]
    pub unit: LengthUnit,
    /// Standard error of one point, per axis [mm].
    pub sigma_mm: f64,
    /// The column of the tracker's times; without it rows are dwells in their order.
    pub time: Option<String>,
    /// The dwell of the first row, or of the first point in time, from 0; found by the nominal arm when absent.
    pub first_dwell: Option<usize>,
}

fn millimetres() -> LengthUnit {
    LengthUnit::Mm
}
