//! The pipeline file of two arms, and what it becomes: a pipeline like any other.

use crate::{
    ArmSection, CheckSection, ClosedChainSection, ConfigError, LoadEntry, OutputConfig, ParameterOverride,
    Pipeline, PoolSection, RecordingEntry, TwoArms, VerifyConfig, recording_name,
};
use armcal_calibrate::{FitConfig, HoldoutConfig};
use armcal_diagnose::DiagnosisConfig;
use armcal_dwell::DwellConfig;
use armcal_model::EffectTable;
use serde::Deserialize;
use std::path::{Path, PathBuf};

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

/// Reads and checks the text of a pipeline of two arms; its paths are not resolved yet.
///
/// # Errors
/// A text that is none, with the place; what contradicts itself.
pub fn parse(path: &Path, text: &str) -> Result<Pipeline, ConfigError> {
    let file: File = toml::from_str(text)
        .map_err(|source| ConfigError::Syntax { path: path.to_owned(), source: Box::new(source) })?;
    let problem =
        |key: &str, problem| ConfigError::Contradiction { path: path.to_owned(), key: key.into(), problem };
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
