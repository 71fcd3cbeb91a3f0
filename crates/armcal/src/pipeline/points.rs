//! `points` of a recording: what a laser tracker exported beside it.

use super::Pipeline;
use crate::error::Error;
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

impl Pipeline {
    /// Whether a sensor sees the tip, on a stream or point by point.
    pub fn tip_is_tracked(&self) -> bool {
        self.streams.tip.is_some() || self.recordings.iter().any(|r| r.points.is_some())
    }
}

/// Points that contradict the rest.
pub(super) fn check(
    pipeline: &Pipeline,
    fail: &dyn Fn(&str, String) -> Result<(), Error>,
) -> Result<(), Error> {
    for (name, points) in pipeline.recordings.iter().filter_map(|r| Some((r.name(), r.points.as_ref()?))) {
        let key = format!("recordings.{name}.points");
        if pipeline.streams.tip.is_some() {
            return fail(&key, "says where the tip was, and so does [streams.tip]: leave one out".into());
        }
        if !(points.sigma_mm > 0.0 && points.sigma_mm.is_finite()) {
            return fail(&key, format!("sigma_mm must be positive, not {}", points.sigma_mm));
        }
    }
    Ok(())
}
