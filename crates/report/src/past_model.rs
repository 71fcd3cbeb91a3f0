//! The calibrated model of an earlier run, read back from what is attached to its `run.mcap`.

use crate::past_run::result_file;
use crate::session_summary::SessionSummary;
use armcal_core::{Pose, RollPitchYaw};
use armcal_model::Session;
use armcal_recording::{Recording, RecordingError};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What a calibration said about an arm, wherever the arm is used next.
#[derive(Debug, Clone, PartialEq)]
pub struct PastModel {
    /// The `run.mcap`.
    pub path: PathBuf,
    /// Text of its pipeline, which names the effects.
    pub pipeline_text: String,
    /// Hashes of the files it was calibrated on.
    pub inputs_sha256: BTreeSet<String>,
    /// What the effects refer to.
    pub session: Session,
    /// Every parameter by name, SI.
    pub parameters: BTreeMap<String, PastValue>,
    /// Pose of the base in the world before the fit.
    pub nominal_base: Pose,
    /// The same after it.
    pub fitted_base: Pose,
}

/// A parameter before and after the fit.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct PastValue {
    /// Before [SI].
    pub nominal: f64,
    /// After [SI].
    pub value: f64,
    /// Posterior standard deviation [SI]; 0 for a fixed one.
    pub sigma: f64,
}

/// Why a calibrated model cannot be read back.
#[derive(Debug, thiserror::Error)]
pub enum PastModelError {
    /// The file is not there or not an MCAP.
    #[error("reading the result {}: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<RecordingError>,
    },
    /// An attachment is missing or not what it should be.
    #[error(
        "the result {} has no usable attachment {name}: {why}; run `armcal run` again with this version",
        path.display()
    )]
    Attachment {
        /// The file.
        path: PathBuf,
        /// Name of the attachment.
        name: &'static str,
        /// What is wrong with it.
        why: String,
    },
}

#[derive(Deserialize)]
struct ParameterFile {
    parameters: Vec<Entry>,
    frames: Vec<FrameEntry>,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    #[serde(flatten)]
    value: PastValue,
}

#[derive(Deserialize)]
struct FrameEntry {
    frame: String,
    xyz_m: [f64; 3],
    rpy_deg: [f64; 3],
}

#[derive(Deserialize)]
struct SummaryFile {
    session: SessionSummary,
    recordings: Vec<RecordingEntry>,
}

#[derive(Deserialize)]
struct RecordingEntry {
    files: Vec<FileEntry>,
}

#[derive(Deserialize)]
struct FileEntry {
    sha256: String,
}

impl PastModel {
    /// Reads `run.mcap`, given itself or the folder it is in.
    pub fn open(path: &Path) -> Result<PastModel, PastModelError> {
        let path = result_file(path);
        let recording = Recording::open(std::slice::from_ref(&path))
            .map_err(|source| PastModelError::Open { path: path.clone(), source: Box::new(source) })?;
        let fail = |name, why| PastModelError::Attachment { path: path.clone(), name, why };
        let attachments = recording.attachments();
        let text = |name: &'static str| {
            let found = attachments.iter().find(|a| a.name == name);
            let bytes = found.ok_or_else(|| fail(name, "it is not there".into()))?.data;
            std::str::from_utf8(bytes).map(str::to_owned).map_err(|e| fail(name, e.to_string()))
        };
        let pipeline_text = text("armcal/pipeline.toml")?;
        let name = "armcal/parameters.toml";
        let file: ParameterFile = toml::from_str(&text(name)?).map_err(|e| fail(name, e.to_string()))?;
        let parameters: BTreeMap<String, PastValue> =
            file.parameters.into_iter().map(|e| (e.name, e.value)).collect();
        let base = file.frames.iter().find(|f| f.frame == "base");
        let base = base.ok_or_else(|| fail(name, "it has no frame `base`".into()))?;
        let fitted_base = Pose::from(RollPitchYaw { xyz_m: base.xyz_m, rpy_deg: base.rpy_deg });
        let nominal_base = before_the_fit(&fitted_base, &parameters);
        let name = "armcal/summary.json";
        let summary: SummaryFile =
            serde_json::from_str(&text(name)?).map_err(|e| fail(name, e.to_string()))?;
        let session = summary.session.into();
        let inputs_sha256 = summary.recordings.into_iter().flat_map(|r| r.files).map(|f| f.sha256).collect();
        Ok(PastModel { pipeline_text, inputs_sha256, session, parameters, nominal_base, fitted_base, path })
    }
}

/// The base as it was known before: positions are written down, the rotation is `R_fitted Exp(-r)`, r the parameters.
fn before_the_fit(fitted: &Pose, parameters: &BTreeMap<String, PastValue>) -> Pose {
    let of = |quantity: &str| parameters.get(&format!("base.{quantity}"));
    let fitted_m = fitted.translation.vector;
    let position_m = ["x", "y", "z"].map(|q| of(q).map(|v| v.nominal));
    let turned_rad = ["rx", "ry", "rz"].map(|q| of(q).map_or(0.0, |v| v.value - v.nominal));
    let position_m = Vector3::from_fn(|k, _| position_m[k].unwrap_or(fitted_m[k]));
    let back = UnitQuaternion::new(-Vector3::from(turned_rad));
    Pose::from_parts(position_m.into(), fitted.rotation * back)
}
