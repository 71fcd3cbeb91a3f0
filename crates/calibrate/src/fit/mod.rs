//! One fit: from start values to estimates with intervals.

pub(crate) mod alignment;
pub(crate) mod ended;
pub(crate) mod export;
pub(crate) mod fit_problem;
pub(crate) mod fit_warnings;
pub(crate) mod frames;
pub(crate) mod minimise;
pub(crate) mod nominal;
pub(crate) mod paper;
pub(crate) mod priors;
pub(crate) mod rigid_fit;
pub(crate) mod wider;

use crate::fit::fit_problem::fit_problem;
use crate::objective::model_problem::ModelProblem;
use crate::outcome::Fit;
use crate::{CalibrateError, FitConfig};
use armcal_core::Observation;
use armcal_model::Model;

/// Fits all free parameters of a model: frames that nobody knew first (closed form, then alone), then everything.
pub fn fit(model: &Model, observations: &[Observation], config: &FitConfig) -> Result<Fit, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    let start = frames::fit_on(&problem, config)?;
    fit_problem(&problem, &start, &|p| p.free, config)
}
