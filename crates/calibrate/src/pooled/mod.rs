//! One arm in many recordings: what is shared, and what each recording has for itself.
//!
//! Shared are the arm's geometry, its effects, the tip, and the base where the camera stays. A recording's own are the
//! pose of its board and what the user declares: [`PooledModel::new`] gives every recording a copy of these parameters,
//! named `<recording>.<parameter>`, with its own start, bounds and prior. Each recording is predicted by a model of its
//! own that knows the shared parameters and its copies, and nothing of the others; [`Problem::known`] tells the solver,
//! which eliminates the copies recording by recording.
//!
//! The objective is that of one fit to all recordings, so that its optimum is the same.
//!
//! [`Problem::known`]: crate::problem::Problem::known

use crate::{CalibrateError, Calibration, FitConfig, HoldoutConfig, Objective, calibration};
use armcal_core::{Observation, Parameter, Pose};
use armcal_model::Model;
use std::collections::BTreeSet;

/// A model whose parameters are partly shared by all recordings and partly each recording's own.
#[derive(Debug, Clone, PartialEq)]
pub struct PooledModel {
    model: Model,
    /// Those of the model, then the copies, recording by recording.
    parameters: Vec<Parameter>,
    views: Vec<View>,
}

/// The model as one recording knows it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct View {
    pub model: Model,
    /// Index of each of its parameters in the pooled vector.
    pub index: Vec<usize>,
}

/// A recording to be pooled.
#[derive(Debug, Clone, PartialEq)]
pub struct PooledRecording {
    /// Its name: prefix of its own parameters.
    pub name: String,
    /// Where a base of its own starts (world_from_base); at the model's where nothing is said.
    pub base_in_world: Option<Pose>,
}

impl PooledModel {
    /// Pools recordings over `model`, whose boards are those of the recordings, in their order. `own` are names or globs of
    /// further parameters that each recording has for itself, such as `joint1.theta` or `base.*`.
    ///
    /// # Errors
    /// A pattern that matches no parameter, one that is fixed, or a board, which is a recording's own anyway.
    pub fn new(
        model: Model,
        recordings: &[PooledRecording],
        own: &[String],
    ) -> Result<PooledModel, CalibrateError> {
        let own = own_indices(&model, own)?;
        let mut parameters = model.parameters().to_vec();
        let mut views = Vec::with_capacity(recordings.len());
        for (at, recording) in recordings.iter().enumerate() {
            let (mut local, mut index) = model.in_recording(at);
            if let Some(base_in_world) = recording.base_in_world {
                local.set_base_start(base_in_world);
            }
            for (place, global) in index.iter_mut().enumerate().filter(|(_, global)| own.contains(global)) {
                let parameter = &local.parameters()[place];
                *global = parameters.len();
                parameters.push(Parameter {
                    name: format!("{}.{}", recording.name, parameter.name),
                    meaning: format!("{}, in {}", parameter.meaning, recording.name),
                    ..parameter.clone()
                });
            }
            views.push(View { model: local, index });
        }
        let mut names = BTreeSet::new();
        if let Some(twice) = parameters.iter().find(|p| !names.insert(p.name.as_str())) {
            let why = "names two parameters of the pool: give one of the recordings another name".into();
            return Err(CalibrateError::BadParameter { name: twice.name.clone(), why });
        }
        for &index in &own {
            parameters[index].free = false;
            parameters[index].meaning += " (each recording has its own)";
        }
        let mut model = model;
        for &index in &own {
            let name = model.parameters()[index].name.clone();
            model.set_parameter(&name, |p| p.free = false)?;
        }
        Ok(PooledModel { model, parameters, views })
    }

    /// The model with the boards of all recordings; what each recording has for itself is fixed in it.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Every parameter: those of [`PooledModel::model`], then the copies.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The model of one recording alone, with its parameters out of the pooled vector `p`; `None` for no recording of
    /// the pool.
    pub fn in_recording(&self, recording: usize, p: &[f64]) -> Option<(&Model, Vec<f64>)> {
        let view = self.views.get(recording)?;
        Some((&view.model, view.index.iter().map(|&i| p[i]).collect()))
    }

    /// Indices of the parameters that a recording has for itself: its board's, then its copies.
    pub fn own_parameters(&self, recording: usize) -> Vec<usize> {
        let Some(view) = self.views.get(recording) else { return Vec::new() };
        // What is shared, every other recording knows too.
        let other = self.views.iter().enumerate().find(|(at, _)| *at != recording);
        let shared: BTreeSet<usize> = other.into_iter().flat_map(|(_, view)| view.index.clone()).collect();
        let board = self.model.board_parameters(recording);
        let is_own = |i: &usize| !shared.contains(i) && (board.contains(i) || self.is_copy(*i));
        view.index.iter().copied().filter(is_own).collect()
    }

    pub(crate) fn views(&self) -> &[View] {
        &self.views
    }

    /// Whether a parameter is the copy that one recording has of a parameter of the model.
    pub(crate) fn is_copy(&self, index: usize) -> bool {
        index >= self.model.parameters().len()
    }
}

/// Calibrates a pool of recordings and judges it on the observations held out. The optimum is that of
/// [`calibrate`](crate::calibrate) on the same observations; work and memory grow with the number of recordings.
///
/// A recording that is held out as a whole has its own parameters fitted to its dwells, with the shared ones frozen: where
/// the board stood on that day is not the arm's doing.
///
/// # Errors
/// As for one fit; and `objective = "paper"`, a sum of distances, which has no normal equations to eliminate from.
pub fn calibrate_pooled(
    pool: &PooledModel,
    observations: &[Observation],
    config: &FitConfig,
    holdout: &HoldoutConfig,
) -> Result<Calibration, CalibrateError> {
    if config.objective == Objective::Paper {
        return Err(CalibrateError::BadConfig {
            key: "fit.objective",
            value: "\"paper\"".into(),
            why: "the sum of distances is not solved recording by recording; give \"robust\" or \"least-squares\""
                .into(),
        });
    }
    if let Some([_, late]) = observations.array_windows().find(|[a, b]| a.dwell.recording > b.dwell.recording)
    {
        return Err(CalibrateError::Mismatch {
            observation: late.dwell.to_string(),
            why: "stands behind a later recording: a pool needs the observations in the order of the recordings"
                .into(),
        });
    }
    calibration::calibrate_scene(pool.into(), observations, config, holdout)
}

fn own_indices(model: &Model, patterns: &[String]) -> Result<BTreeSet<usize>, CalibrateError> {
    let mut own = BTreeSet::new();
    for pattern in patterns {
        for index in model.matching(pattern)? {
            let p = &model.parameters()[index];
            let bad = |why: &str| CalibrateError::BadParameter { name: p.name.clone(), why: why.into() };
            if p.name.starts_with("board.") {
                return Err(bad("a board is its recording's own anyway; take it out of pool.per_recording"));
            }
            if !p.free {
                return Err(bad("is fixed, so no recording can have its own; free it under [[parameters]]"));
            }
            own.insert(index);
        }
    }
    Ok(own)
}
