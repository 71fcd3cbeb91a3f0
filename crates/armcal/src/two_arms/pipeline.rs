//! The pipeline file of two arms with a model file each, and what it becomes: a pipeline like any other.

use super::ClosedChainSection;
use crate::check::CheckSection;
use crate::error::Error;
use crate::pipeline::{
    FrameSection, LoadEntry, ModelSection, ParameterOverride, Pipeline, RecordingEntry, recording_name,
};
use crate::pool::PoolSection;
use crate::stages::frames::{frame, override_parameters};
use armcal_calibrate::{FitConfig, HoldoutConfig};
use armcal_diagnose::DiagnosisConfig;
use armcal_dwell::DwellConfig;
use armcal_model::{Chain, EffectSpec, EffectTable, Model};
use armcal_recording::{JointStream, Streams};
use armcal_report::{OutputConfig, VerifyConfig};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The two arms of a pipeline.
#[derive(Debug, Clone)]
pub struct TwoArms {
    /// The arms.
    pub arms: [ArmSection; 2],
}

/// A pipeline of two arms, as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    data: Option<String>,
    /// Each with both arms in it.
    #[serde(default)]
    recordings: Vec<RecordingPaths>,
    arms: Vec<ArmSection>,
    closed_chain: ClosedChainSection,
    #[serde(default)]
    dwell: DwellConfig,
    /// Changes to single parameters, by their names with the arm's prefix.
    #[serde(default)]
    parameters: Vec<ParameterOverride>,
    /// Physical effects, joints by their names with the arm's prefix or numbered through both arms.
    #[serde(default)]
    effects: Vec<EffectTable>,
    #[serde(default)]
    fit: FitConfig,
    #[serde(default)]
    holdout: HoldoutConfig,
    #[serde(default)]
    pool: PoolSection,
    #[serde(default)]
    diagnosis: DiagnosisConfig,
    #[serde(default)]
    verify: VerifyConfig,
    #[serde(default)]
    check: CheckSection,
    #[serde(default)]
    output: OutputConfig,
}

/// One recording.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordingPaths {
    name: Option<String>,
    paths: Vec<PathBuf>,
    /// What hangs at the tips.
    #[serde(default)]
    loads: Vec<LoadEntry>,
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

impl TwoArms {
    /// Reads and checks the text of a pipeline of two arms; its paths are not resolved yet.
    ///
    /// # Errors
    /// A text that is none, with the place; what contradicts itself.
    pub fn parse(path: &Path, text: &str) -> Result<Pipeline, Error> {
        let file: File = toml::from_str(text)
            .map_err(|source| Error::PipelineSyntax { path: path.to_owned(), source: Box::new(source) })?;
        let problem = |key: &str, problem| Error::PipelineContradiction {
            path: path.to_owned(),
            key: key.into(),
            problem,
        };
        let count = file.arms.len();
        let arms = <[ArmSection; 2]>::try_from(file.arms).map_err(|_| {
            problem("arms", format!("has {count} entries; a closed chain is made of two [[arms]]"))
        })?;
        let two = TwoArms { arms };
        if let Some((key, said)) = two.contradiction() {
            return Err(problem(key, said));
        }
        let [first, _] = &two.arms;
        let entry = |r: RecordingPaths| {
            let name = Some(recording_name(r.name.as_ref(), &r.paths));
            RecordingEntry {
                name,
                paths: r.paths,
                tilt: Default::default(),
                load_kg: 0.0,
                loads: r.loads,
                points: None,
            }
        };
        Ok(Pipeline {
            name: file.name,
            data: file.data,
            recordings: file.recordings.into_iter().map(entry).collect(),
            streams: two.streams(),
            dwell: file.dwell,
            closed_chain: Some(file.closed_chain),
            model: first.model.clone(),
            parameters: file.parameters,
            effects: file.effects,
            fit: file.fit,
            holdout: file.holdout,
            pool: file.pool,
            diagnosis: file.diagnosis,
            verify: file.verify,
            check: file.check,
            output: file.output,
            two_arms: Some(two),
            ..Pipeline::default()
        })
    }

    /// What to read of both arms.
    fn streams(&self) -> Streams {
        let of = |arm: &ArmSection| JointStream { arm: Some(arm.name.clone()), ..arm.joints.clone() };
        Streams { joints: self.arms.iter().map(of).collect(), ..Streams::default() }
    }

    /// Both nominal arms in one world, their chains read already.
    pub fn model(&self, chain: &Chain) -> Result<Model, Error> {
        let frames = |arm: &ArmSection| armcal_model::ArmFrames {
            base: frame(&format!("{}.base", arm.name), &arm.base, true),
            tip: frame(&format!("{}.tip", arm.name), &arm.tip, false),
        };
        let all = self.arms.iter().map(frames).collect();
        let mut model = Model::of_arms(chain.clone(), all)?;
        for (arm, of_chain) in self.arms.iter().zip(chain.arms()) {
            let named = |p: &ParameterOverride| ParameterOverride {
                name: of_chain.parameter_among_all(&p.name),
                ..p.clone()
            };
            let own: Vec<ParameterOverride> = arm.parameters.iter().map(named).collect();
            override_parameters(&mut model, &own)?;
        }
        Ok(model)
    }

    /// The effects of both arms, then those of the pipeline.
    pub fn effect_specs(&self, pipeline: &Pipeline, model: &Model) -> Result<Vec<EffectSpec>, Error> {
        let mut specs = Vec::new();
        for (at, (arm, of_chain)) in self.arms.iter().zip(model.chain().arms()).enumerate() {
            for table in &arm.effects {
                let own = table.spec(of_chain.chain.joint_names())?;
                specs.push(of_chain.effect_among_all(at + 1, own)?);
            }
        }
        let joints = model.chain().joint_names();
        let of_all = pipeline.effects.iter().map(|table| table.spec(joints));
        specs.extend(of_all.collect::<Result<Vec<_>, _>>()?);
        Ok(specs)
    }

    /// What serde cannot see.
    fn contradiction(&self) -> Option<(&'static str, String)> {
        let arms = &self.arms;
        // They name files.
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_');
        let taken = ["parameters", "pipeline", "calibrated"];
        let is_file_name = |name: &str| !name.is_empty() && !taken.contains(&name) && name.chars().all(plain);
        if let Some(arm) = arms.iter().find(|arm| !is_file_name(&arm.name)) {
            return Some(("arms.name", format!("`{}` cannot be the name of a file of results", arm.name)));
        }
        if arms[0].joints.topic == arms[1].joints.topic && arms[0].joints.names == arms[1].joints.names {
            return Some((
                "arms.joints",
                "is the same for both arms; give each its own topic, or its own joint names on a topic they share".into(),
            ));
        }
        None
    }
}
