//! One scenario through the tool: what it says, what its suggestion does to held-out points, and the truth to judge by.

use crate::error::ScoreError;
use armcal_calibrate::{Calibration, FitConfig, HoldoutConfig, calibrate};
use armcal_config::{ConfigError, Pipeline};
use armcal_core::Observation;
use armcal_diagnose::{Calibrated, Diagnosis, DiagnosisConfig, Verdict, diagnose};
use armcal_lab::planted::seal;
use armcal_lab::scenario::{Hidden, Scenario};
use armcal_lab::{LabError, Nominal, Truth};
use armcal_model::{Chain, EffectSpec, Frame, Frames, Knowledge, Model, Session};
use armcal_recording::input;
use armcal_stages::Silent;
use serde::Serialize;
use std::path::Path;

/// Groups of cavities held out in turn.
const FOLDS: usize = 5;

/// What the tool said about a scenario.
#[derive(Debug, Clone, Serialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// Its names.
    pub names: Vec<String>,
    /// Its probability, where it has one.
    pub probability: Option<f64>,
    /// The sets behind them, one for each effect found.
    pub sets: Vec<Vec<String>>,
    /// The probability of each set.
    pub set_probabilities: Vec<f64>,
    /// Where and over what the unlisted enters.
    pub unknown: Option<(String, String)>,
    /// What `armcal add suggested` would add.
    pub suggested: Vec<String>,
    /// Mean error on held-out points before and after adding it, and the floor that the declared noise sets [mm].
    pub before_mm: f64,
    /// After adding it.
    pub after_mm: f64,
    /// What the declared noise alone gives.
    pub floor_mm: f64,
    /// Dwells it was based on.
    pub dwells: usize,
    /// Time of the diagnosis [s].
    #[serde(skip)]
    pub seconds: f64,
    /// Time of the calibration with its hold-out [s].
    #[serde(skip)]
    pub calibration_seconds: f64,
}

/// The observations handed over as the pipeline would have made them, their noise declared so many times as large.
pub fn answer_observed(scenario: &Scenario, noise_factor: f64) -> Result<(Answer, Vec<Hidden>), ScoreError> {
    let observed = scenario.observe()?.declaring(noise_factor);
    let (answer, _) = diagnose_observations(&observed.nominal, &observed.observations)?;
    Ok((answer, observed.truth.hidden))
}

/// What is told of observations of a nominal arm.
pub(super) fn diagnose_observations(
    nominal: &Nominal,
    observations: &[Observation],
) -> Result<(Answer, Diagnosis), ScoreError> {
    let model = nominal_model(nominal)?;
    let (fit, session) = (FitConfig::default(), Session::of(observations));
    let holdout = match observations.iter().any(|o| o.cavity().is_some()) {
        true => HoldoutConfig::CavityFolds { k: FOLDS },
        false => HoldoutConfig::default(),
    };
    let begin = std::time::Instant::now();
    let calibration = calibrate(&model, observations, &fit, &holdout)?;
    let calibration_seconds = begin.elapsed().as_secs_f64();
    let begin = std::time::Instant::now();
    let calibrated = Calibrated {
        model: &model,
        calibration: &calibration,
        observations,
        session: &session,
        fit: &fit,
        holdout: &holdout,
    };
    let diagnosis = diagnose(&calibrated, &DiagnosisConfig::default())?;
    let seconds = begin.elapsed().as_secs_f64();
    let answer = answer_of_diagnosis(&diagnosis, &calibrated)?;
    Ok((Answer { seconds, calibration_seconds, ..answer }, diagnosis))
}

/// Recordings on disk and the whole pipeline; the truth lies in another folder and is read last.
pub fn answer_recorded(scenario: &Scenario) -> Result<(Answer, Vec<Hidden>), ScoreError> {
    let folder = |source| LabError::Folder { path: std::env::temp_dir(), source };
    let (open, closed) = (tempfile::tempdir().map_err(folder)?, tempfile::tempdir().map_err(folder)?);
    let place = seal(scenario, open.path(), &closed.path().join("truth.json"))?;
    let pipeline = Pipeline::load(&place.pipeline)?;
    let settled = armcal_pipeline::settle(&pipeline, &Silent)?;
    if let Some(mistake) = settled.setup.mistakes().next() {
        let told = answer_of_mistake(mistake.code.as_str(), &settled.fitted.calibration);
        return Ok((told, read_truth(&place.truth)?.hidden));
    }
    let begin = std::time::Instant::now();
    let diagnosis = settled.diagnose(&pipeline, &Silent)?.ok_or(ScoreError::NotDiagnosed)?;
    let seconds = begin.elapsed().as_secs_f64();
    let of_geometry = Calibrated { model: &settled.fitted.geometry, ..settled.fitted.calibrated(&pipeline) };
    Ok((
        Answer { seconds, ..answer_of_diagnosis(&diagnosis, &of_geometry)? },
        read_truth(&place.truth)?.hidden,
    ))
}

/// A mistake of the setup that nobody made is a name, and wrong.
fn answer_of_mistake(code: &str, calibration: &Calibration) -> Answer {
    let held_out_mm = calibration.judged().fitted.mean_m * 1e3;
    Answer {
        verdict: Verdict::Identified,
        names: vec![format!("setup: {code}")],
        probability: None,
        sets: vec![vec![format!("setup: {code}")]],
        set_probabilities: Vec::new(),
        unknown: None,
        suggested: Vec::new(),
        before_mm: held_out_mm,
        after_mm: held_out_mm,
        floor_mm: calibration.noise_floor_m * 1e3,
        dwells: calibration.residuals.len(),
        seconds: 0.0,
        calibration_seconds: 0.0,
    }
}

fn read_truth(path: &Path) -> Result<Truth, ScoreError> {
    let text = input::read_to_string(path, input::Kind::Data).map_err(|source| ConfigError::ReadFile {
        what: "truth",
        path: path.to_owned(),
        source,
    })?;
    serde_json::from_str(&text).map_err(ScoreError::Json)
}

/// The answer to a diagnosis, and what its suggestion does to the held-out points.
fn answer_of_diagnosis(diagnosis: &Diagnosis, calibrated: &Calibrated<'_>) -> Result<Answer, ScoreError> {
    let Calibrated { model, calibration: before, observations, session, fit, holdout } = calibrated;
    let suggested = diagnosis.suggested(model.chain().joint_names())?;
    let after = match suggested.is_empty() {
        true => None,
        false => Some(calibrate(&model.with_effects(&suggested, session)?, observations, fit, holdout)?),
    };
    let held_out_mm = |c: &Calibration| c.judged().fitted.mean_m * 1e3;
    Ok(Answer {
        verdict: diagnosis.verdict,
        names: diagnosis.names.clone(),
        probability: diagnosis.probability,
        sets: diagnosis.effects.iter().map(|e| e.set.clone()).collect(),
        set_probabilities: diagnosis.effects.iter().map(|e| e.probability).collect(),
        unknown: diagnosis.unknown.as_ref().map(|u| (u.channel.to_string(), u.driver.to_string())),
        suggested: suggested.iter().map(EffectSpec::to_string).collect(),
        before_mm: held_out_mm(before),
        after_mm: held_out_mm(after.as_ref().unwrap_or(before)),
        floor_mm: before.noise_floor_m * 1e3,
        dwells: before.residuals.len(),
        seconds: 0.0,
        calibration_seconds: 0.0,
    })
}

/// The model that a pipeline would start from.
pub fn nominal_model(nominal: &Nominal) -> Result<Model, ScoreError> {
    let frame =
        |name: &str, pose, knowledge| Frame { name: name.into(), pose, knowledge, free_rotation: false };
    let (sigma_m, sigma_rad) = (nominal.base_sigma_m, nominal.base_sigma_rad);
    let boards = nominal
        .boards
        .iter()
        .map(|b| frame(&format!("board.{}", b.recording), b.world_from_board, Knowledge::Given));
    let base = frame("base", nominal.world_from_base, Knowledge::Measured { sigma_m, sigma_rad });
    let frames = Frames {
        base: Frame { free_rotation: true, ..base },
        tip: frame("tip", nominal.link_from_tip, Knowledge::Given),
        markers: Vec::new(),
        boards: boards.collect(),
    };
    let chain = Chain::from_dh_toml(&nominal.dh_toml, Path::new("arm.toml"))?;
    Ok(Model::new(chain, frames)?)
}
