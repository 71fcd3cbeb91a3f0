//! A calibrated arm as `summary.json` tells it: the accepted result, and the one to be judged.

use crate::error::CheckError;
use armcal_core::{Pose, RollPitchYaw};
use armcal_recording::input;
use armcal_report::summary_json;
use armcal_result::summary::SCHEMA;
use armcal_result::{Run, SUMMARY, StoredRun};
use serde::Deserialize;
use std::path::Path;

/// The parts of a summary that are compared.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Calibrated {
    schema: String,
    /// Name of its pipeline.
    pub pipeline: String,
    fit: Fit,
    frames: Vec<FrameEntry>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Fit {
    parameters: Vec<FittedParameter>,
}

/// One parameter, SI.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct FittedParameter {
    /// Its name.
    pub name: String,
    /// `m`, `rad`, ...
    pub unit: String,
    /// After the fit.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Whether it lies on a bound.
    pub at_bound: bool,
    /// `robot`, `effect`, `known_frame`, `estimated_frame`.
    pub role: String,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct FrameEntry {
    frame: String,
    xyz_m: [f64; 3],
    rpy_deg: [f64; 3],
}

/// A frame with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedFrame {
    /// Where it is in its parent.
    pub pose: Pose,
    /// Standard deviation of its position, all axes together [m].
    pub sigma_m: f64,
    /// Standard deviation of its rotation, all axes together [rad].
    pub sigma_rad: f64,
}

impl Calibrated {
    /// Reads a `summary.json`, the one in a `run.mcap`, or that of a folder of results.
    pub fn open(path: &Path) -> Result<Calibrated, CheckError> {
        let bad = |problem: String| CheckError::BadReference { path: path.to_owned(), problem };
        let calibrated: Result<Calibrated, _> = if path.extension().is_some_and(|e| e == "mcap") {
            serde_json::from_value(StoredRun::open(path)?.summary)
        } else {
            let file = if path.is_dir() { path.join(SUMMARY) } else { path.to_owned() };
            let text = input::read_to_string(&file, input::Kind::Data)
                .map_err(|e| bad(format!("cannot be read: {e}")))?;
            serde_json::from_str(&text)
        };
        let calibrated =
            calibrated.map_err(|e| bad(format!("is not a summary that this version wrote: {e}")))?;
        if calibrated.schema != SCHEMA {
            return Err(bad(format!("has the schema `{}` instead of `{SCHEMA}`", calibrated.schema)));
        }
        Ok(calibrated)
    }

    /// The result to be judged.
    pub fn of(run: &Run) -> Result<Calibrated, CheckError> {
        serde_json::from_str(&summary_json(run)?).map_err(CheckError::Json)
    }

    /// Parameters of the robot and of its effects; frames are compared as frames.
    pub fn of_arm(&self) -> impl Iterator<Item = &FittedParameter> {
        self.fit.parameters.iter().filter(|p| !p.role.ends_with("_frame"))
    }

    /// Names of the frames: `base`, `tip`, `board.normal`.
    pub fn frame_names(&self) -> impl Iterator<Item = &str> {
        self.frames.iter().map(|f| f.frame.as_str())
    }

    /// A frame by name.
    pub fn frame(&self, name: &str) -> Option<FittedFrame> {
        let entry = self.frames.iter().find(|f| f.frame == name)?;
        let pose = RollPitchYaw { xyz_m: entry.xyz_m, rpy_deg: entry.rpy_deg }.into();
        let sigma = |quantities: [&str; 3]| {
            let of = |q: &str| self.fit.parameters.iter().find(|p| p.name == format!("{name}.{q}"));
            quantities.into_iter().filter_map(of).map(|p| p.sigma.powi(2)).sum::<f64>().sqrt()
        };
        Some(FittedFrame { pose, sigma_m: sigma(["x", "y", "z"]), sigma_rad: sigma(["rx", "ry", "rz"]) })
    }
}
