//! The pipeline file of two arms.

use crate::error::Error;
use crate::pipeline::{FramePose, FrameSection, ModelSection, ParameterOverride, recording_name};
use armcal_calibrate::{Closure, FitConfig, HoldoutConfig, LengthKnowledge};
use armcal_dwell::DwellConfig;
use armcal_model::EffectTable;
use armcal_recording::{JointStream, input, resolve};
use armcal_report::OutputConfig;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A pipeline of two arms, as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClosedPipeline {
    /// Name shown in every output.
    pub name: String,
    /// The recordings, each with both arms in it.
    pub recordings: Vec<RecordingPaths>,
    /// The two arms.
    pub arms: Vec<ArmSection>,
    /// How their tips are joined.
    pub closed_chain: ClosedChainSection,
    /// What counts as standing still.
    #[serde(default)]
    pub dwell: DwellConfig,
    /// Objective and loss.
    #[serde(default)]
    pub fit: FitConfig,
    /// What the fit must not see.
    #[serde(default)]
    pub holdout: HoldoutConfig,
    /// What is written.
    #[serde(default)]
    pub output: OutputConfig,
    /// Folder of the pipeline file.
    #[serde(skip)]
    pub folder: PathBuf,
    /// The file's text, carried into the results.
    #[serde(skip)]
    pub text: String,
}

/// One recording.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingPaths {
    /// Name used in outputs; the stem of the first file when absent.
    pub name: Option<String>,
    /// Its files: one, or the parts of a split bag.
    pub paths: Vec<PathBuf>,
}

/// One arm.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmSection {
    /// Its name, the prefix of its parameters.
    pub name: String,
    /// Its joint stream.
    pub joints: JointStream,
    /// Its nominal model.
    pub model: ModelSection,
    /// Its base in the common world. `at` counts for every `pose`; `"measured"` takes it with `sigma_mm`, `sigma_deg`.
    #[serde(default)]
    pub base: FrameSection,
    /// The joined point on its last link.
    #[serde(default)]
    pub tip: FrameSection,
    /// Changes to single parameters, by their names without the arm's prefix.
    #[serde(default)]
    pub parameters: Vec<ParameterOverride>,
    /// Physical effects beyond geometry.
    #[serde(default)]
    pub effects: Vec<EffectTable>,
}

/// How the tips are joined.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClosedChainSection {
    /// `"same-point"` or `"rigid-link"`.
    pub kind: ClosureKind,
    /// With a rigid link: the distance of the two tips [mm].
    pub length_mm: Option<f64>,
    /// How well that is known: `"given"` (default), `"measured"` with `length_sigma_mm`, `"estimated"`.
    #[serde(default)]
    pub length: FramePose,
    /// Standard error of a measured length [mm].
    #[serde(default)]
    pub length_sigma_mm: f64,
    /// How far apart the joined points may be all the same, 1 sigma per axis [mm]; default 0.1.
    #[serde(default = "default_sigma_mm")]
    pub sigma_mm: f64,
    /// Dwells in which the nominal arms have their tips further from closing than this are not joined [mm]; default 100.
    #[serde(default = "default_max_gap_mm")]
    pub max_gap_mm: f64,
}

/// How tips can be joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClosureKind {
    /// Both in one point.
    SamePoint,
    /// On a rigid link with a ball joint at either end.
    RigidLink,
}

fn default_sigma_mm() -> f64 {
    0.1
}

fn default_max_gap_mm() -> f64 {
    100.0
}

impl RecordingPaths {
    /// The recording's name.
    pub fn name(&self) -> String {
        recording_name(self.name.as_ref(), &self.paths)
    }
}

impl ClosedChainSection {
    /// The closure in SI.
    pub fn closure(&self) -> Closure {
        match (self.kind, self.length_mm) {
            (ClosureKind::RigidLink, Some(length_mm)) => Closure::RigidLink {
                length_m: length_mm * 1e-3,
                knowledge: match self.length {
                    FramePose::Given => LengthKnowledge::Given,
                    FramePose::Measured => LengthKnowledge::Measured { sigma_m: self.length_sigma_mm * 1e-3 },
                    FramePose::Estimated => LengthKnowledge::Estimated,
                },
            },
            _ => Closure::SamePoint,
        }
    }
}

impl ClosedPipeline {
    /// Reads and checks the text of a pipeline whose relative paths start in `folder`.
    pub fn parse(path: &Path, text: String, folder: &Path) -> Result<ClosedPipeline, Error> {
        let mut pipeline: ClosedPipeline = toml::from_str(&text)
            .map_err(|source| Error::PipelineSyntax { path: path.to_owned(), source: Box::new(source) })?;
        pipeline.folder = folder.to_owned();
        pipeline.text = text;
        let models = pipeline.arms.iter().flat_map(|arm| [&arm.model.dh, &arm.model.urdf]).flatten();
        let named = pipeline.recordings.iter().flat_map(|recording| &recording.paths).chain(models);
        named.for_each(|path| input::note(&resolve(folder, path)));
        let said = pipeline.contradiction();
        said.map_or(Ok(pipeline), |(key, problem)| {
            Err(Error::PipelineContradiction { path: path.to_owned(), key: key.into(), problem })
        })
    }

    /// What serde cannot see.
    fn contradiction(&self) -> Option<(&'static str, String)> {
        let (arms, chain) = (self.arms.len(), &self.closed_chain);
        if arms != 2 {
            return Some(("arms", format!("has {arms} entries; a closed chain is made of two [[arms]]")));
        }
        // They name files.
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
        let is_file_name = |name: &str| !name.is_empty() && name != "parameters" && name.chars().all(plain);
        if let Some(arm) = self.arms.iter().find(|arm| !is_file_name(&arm.name)) {
            return Some(("arms.name", format!("`{}` cannot be the name of a file of results", arm.name)));
        }
        if self.arms[0].joints.topic == self.arms[1].joints.topic
            && self.arms[0].joints.names == self.arms[1].joints.names
        {
            return Some((
                "arms.joints",
                "is the same for both arms; give each its own topic, or its own joint names on a topic they share".into(),
            ));
        }
        if self.recordings.is_empty() || self.recordings.iter().any(|r| r.paths.is_empty()) {
            return Some(("recordings", "needs at least one recording, each with paths = [...]".into()));
        }
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if !positive(chain.sigma_mm) {
            return Some((
                "closed_chain.sigma_mm",
                "must be above zero: no joint holds a point exactly".into(),
            ));
        }
        if !positive(chain.max_gap_mm) {
            return Some(("closed_chain.max_gap_mm", "must be above zero".into()));
        }
        match (chain.kind, chain.length_mm) {
            (ClosureKind::RigidLink, None) => Some((
                "closed_chain.length_mm",
                "is missing; a rigid link has a length, even if it is estimated".into(),
            )),
            (ClosureKind::SamePoint, Some(_)) => Some((
                "closed_chain.length_mm",
                "has no meaning for tips in one point; use kind = \"rigid-link\" or remove it".into(),
            )),
            _ => None,
        }
    }
}
