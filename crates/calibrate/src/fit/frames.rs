//! Frames that nobody could know: which they are, and a fit of these alone from their closed-form start.

use crate::fit::alignment::closed_form_start;
use crate::fit::minimise::minimise_objective;
use crate::objective::frame_names::{frame_of, is_free, touched_frames};
use crate::objective::model_problem::ModelProblem;
use crate::objective::problem::Problem;
use crate::objective::remembered::{self, Looked, Remembered};
use crate::objective::whitened::Whitened;
use crate::{CalibrateError, FitConfig, Objective};
use armcal_core::{Observation, Parameter};
use armcal_model::{Model, ModelResidual};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Closed-form start: nominal, with the estimated frames placed onto the observations.
///
/// A frame without observations, or all boards together with the base when nothing ties them to the world, stays at
/// nominal. Deterministic.
pub fn align_frames(
    model: &Model,
    observations: &[Observation],
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    Ok(closed_form_start(&problem, config, model.nominal(), &|_| true))
}

/// The parameter vector with only [`Role::EstimatedFrame`] parameters fitted: what the arm would do with nominal
/// geometry if every frame were known.
pub fn fit_frames(
    model: &Model,
    observations: &[Observation],
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    fit_on(&ModelProblem::new(model, observations, config)?, config)
}

/// The same from given values of all parameters, for those frames `which` accepts; the arm stays as `start` has it.
pub fn fit_frames_from(
    model: &Model,
    observations: &[Observation],
    start: Vec<f64>,
    config: &FitConfig,
    which: &dyn Fn(&Parameter) -> bool,
) -> Result<Vec<f64>, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    let touched = of_observations(&problem);
    fit_some(&problem, start, config, &|p| which(p) && touched(p))
}

/// [`fit_frames`] on observations already checked.
pub(crate) fn fit_on(problem: &ModelProblem<'_>, config: &FitConfig) -> Result<Vec<f64>, CalibrateError> {
    fit_some(problem, problem.model().nominal(), config, &of_observations(problem))
}

/// A problem where its frames ended, as fits of them to most of its observations will ask of it; none where no frame is free.
pub(crate) fn evaluate_frames(
    problem: &ModelProblem<'_>,
    values: &[f64],
    config: &FitConfig,
) -> Result<Option<Arc<Looked>>, CalibrateError> {
    let free = of_observations(problem);
    let any = problem.parameters().iter().any(&free);
    any.then(|| remembered::evaluate_problem(problem, values, &free, config)).transpose()
}

/// [`fit_on`] from where the frames of more observations ended, those among them: to the same minimum, only the way is shorter.
/// Of very many, first with the derivative where that was `looked` at: errors of a nominal arm are large, so that what it changes
/// on the way counts, and the last steps are exact.
pub(crate) fn fit_on_fewer(
    problem: &ModelProblem<'_>,
    of_more: &[f64],
    looked: Option<&Looked>,
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    let free = of_observations(problem);
    let mut start = problem.model().nominal();
    let known = problem.parameters().iter().zip(of_more).zip(&mut start).filter(|((p, _), _)| free(p));
    known.for_each(|((_, value), start)| *start = *value);
    let mut sigma_scale = None;
    let looked = looked.filter(|_| !config.every_step);
    if let Some(about) = looked.and_then(|looked| Remembered::about(problem, looked)) {
        let (near, scale) = solve_frames(&about, (&start, None), config, &free)?;
        (start, sigma_scale) = (near, Some(scale));
    }
    Ok(solve_frames(problem, (&start, sigma_scale), config, &free)?.0)
}

/// Whether a parameter places a frame that the observations of a problem say something about.
fn of_observations(problem: &ModelProblem<'_>) -> impl Fn(&Parameter) -> bool + use<> {
    let touched: BTreeSet<String> =
        touched_frames(problem.model(), problem.observations()).into_iter().collect();
    move |p| is_free(p) && touched.contains(frame_of(p))
}

/// Fits only the estimated-frame parameters `which` accepts, the others at `start`.
pub(crate) fn fit_some(
    problem: &ModelProblem<'_>,
    start: Vec<f64>,
    config: &FitConfig,
    which: &dyn Fn(&Parameter) -> bool,
) -> Result<Vec<f64>, CalibrateError> {
    let free = |p: &Parameter| is_free(p) && which(p);
    let start = closed_form_start(problem, config, start, &free);
    if let Some(most_m) = config.give_up_above_m {
        let (mut sum_m, observations) = (0.0, problem.observations());
        let mut add = |_: &Observation, residual: ModelResidual| sum_m += residual.position_m.norm();
        problem.model().residuals(&start, observations, false, &mut add);
        let mean_m = sum_m / observations.len().max(1) as f64;
        if mean_m > most_m {
            return Err(CalibrateError::GivenUp { mean_m });
        }
    }
    Ok(solve_frames(problem, (&start, None), config, &free)?.0)
}

/// The frames `free` where the solver ends with them, the others at the start; with the scale of the residuals in units of the
/// declared noise, which the start comes with where it is known roughly.
fn solve_frames(
    problem: &dyn Problem,
    (start, sigma_scale): (&Vec<f64>, Option<f64>),
    config: &FitConfig,
    free: &dyn Fn(&Parameter) -> bool,
) -> Result<(Vec<f64>, f64), CalibrateError> {
    config.check()?;
    if problem.blocks() == 0 || !problem.parameters().iter().any(free) {
        return Ok((start.clone(), sigma_scale.unwrap_or(1.0)));
    }
    let white = Whitened::new(Box::new(problem), start, free, config)?;
    // Frames are never the subject of eq. 4; they are fitted robustly under it.
    let objective = if config.objective == Objective::Paper { Objective::Robust } else { config.objective };
    let solved = minimise_objective(&white, sigma_scale, &FitConfig { objective, ..config.clone() })?;
    Ok((white.parameters_at(&solved.at.x), solved.sigma_scale))
}
