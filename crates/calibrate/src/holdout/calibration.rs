//! The whole calibration: fit, hold-out, errors on both sides.
//!
//! **Hold-out.** With one held-out set, the parameters written are those of the fit that did not see it. With sets held
//! out in turn, every turn predicts its own set, the residuals of all turns are pooled, and the parameters written
//! come from a last fit to everything.
//!
//! A held-out recording may bring a board frame that no other recording shows: a frame nobody could know without its
//! dwells. That frame alone is then fitted on the held-out dwells, with everything else as the training left it; the
//! nominal arm gets the same courtesy.
//!
//! **Nominal errors** are those of nominal robot parameters after fitting only the frames that nobody could know
//! ([`armcal_core::Role::EstimatedFrame`]), on the same sides.

use crate::fit::fit_problem::{Near, fit_near, fit_problem, fit_where_priors};
use crate::fit::fit_warnings;
use crate::fit::frames;
use crate::fit::nominal::{self, Nominal, Start};
use crate::fit::priors::scales_of;
use crate::holdout::{self, Holdout};
use crate::objective::frame_names;
use crate::objective::model_problem::{
    ModelProblem, describe_observation, position_covariance_m2, whiten_position,
};
use crate::objective::noise::expected_norm_m;
use crate::objective::poses::measured_together;
use crate::objective::remembered::{Looked, evaluate_problem, keeps_derivative};
use crate::outcome::{Calibration, Fit, Residual, SideErrors};
use crate::{CalibrateError, FitConfig, HoldoutConfig, Objective};
use armcal_core::{Code, ErrorStats, Observation, Parameter, Role, Severity, Stage, Warning};
use armcal_model::{Model, ModelResidual};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

/// Calibrates `model` on `observations` and judges it on those held out.
pub fn calibrate(
    model: &Model,
    observations: &[Observation],
    config: &FitConfig,
    holdout: &HoldoutConfig,
) -> Result<Calibration, CalibrateError> {
    calibrate_beside(None, model, observations, config, holdout)
}

/// [`calibrate`] where a calibration of the same arm with fewer effects, on the same observations and hold-out, is at hand:
/// effects that do nothing at nominal leave the nominal arm and its frames as they are there, and the fit begins where that one ended.
pub fn calibrate_beside(
    other: Option<&Calibration>,
    model: &Model,
    observations: &[Observation],
    config: &FitConfig,
    holdout: &HoldoutConfig,
) -> Result<Calibration, CalibrateError> {
    let nominal = other.and_then(|other| nominal::of_turns(other, model)).unwrap_or_default();
    config.check()?;
    if observations.is_empty() {
        return Err(CalibrateError::NoObservations { context: String::new() });
    }
    let holdout = holdout::resolve(holdout, observations, &frame_names::board_names(model))?;
    fit_folds(&Judge { model, observations, config, nominal }, &holdout)
}

/// The observations that a hold-out keeps from the fit in each of its turns, as indices in rising order.
///
/// # Errors
/// A hold-out that does not fit these observations.
pub fn holdout_turns(
    model: &Model,
    observations: &[Observation],
    holdout: &HoldoutConfig,
) -> Result<Vec<Vec<usize>>, CalibrateError> {
    Ok(holdout::resolve(holdout, observations, &frame_names::board_names(model))?.turns)
}

/// Fits in the turns of the hold-out and pools their errors.
fn fit_folds(judge: &Judge<'_>, holdout: &Holdout) -> Result<Calibration, CalibrateError> {
    if let (false, [held]) = (holdout.in_turn, holdout.turns.as_slice()) {
        let turn = judge.turn((held, judge.nominal.turns.first()), None)?;
        return assemble_calibration(judge, holdout, std::slice::from_ref(&turn), turn.clone());
    }
    let last = judge.turn((&[], judge.nominal.of_all.as_ref()), None)?;
    // A turn iterates to its own minimum; only its way there is shorter from the minimum of all, and of many dwells the
    // derivative of that is exact enough for it.
    let near = match judge.config.objective {
        Objective::Paper => None,
        _ => Some(judge.look(&last, holdout.turns.len())?),
    };
    let near = near.as_ref();
    // Turns know nothing of each other; of several errors the first one's is told, whichever thread was first.
    let turn = |(k, held): (usize, &Vec<usize>)| judge.turn((held, judge.nominal.turns.get(k)), near);
    let turns: Vec<Result<Fold, CalibrateError>> = holdout.turns.par_iter().enumerate().map(turn).collect();
    let turns = turns.into_iter().collect::<Result<Vec<Fold>, CalibrateError>>()?;
    assemble_calibration(judge, holdout, &turns, last)
}

/// A fit outside a held-out set, completed by the frames that only the held-out set shows.
#[derive(Clone)]
pub(crate) struct Fold {
    pub fit: Fit,
    /// Parameters that give the nominal errors.
    pub nominal_values: Vec<f64>,
    /// Parameters of the fit.
    pub values: Vec<f64>,
    /// Index into the fit's weights of every observation it saw.
    weight_of: Vec<Option<usize>>,
    /// Rows of position that it saw.
    rows: usize,
    pub warnings: Vec<Warning>,
}

impl Fold {
    /// A turn that fitted all of `observations` but those `held` (indices in rising order).
    pub fn new(fit: Fit, nominal_values: Vec<f64>, held: &[usize], observations: &[Observation]) -> Fold {
        let mut seen = 0..;
        let is_held = |i: usize| held.binary_search(&i).is_ok();
        let all = 0..observations.len();
        let weight_of = all.clone().map(|i| if is_held(i) { None } else { seen.next() }).collect();
        let rows = all.filter(|i| !is_held(*i)).map(|i| observations[i].position_rows()).sum();
        Fold { values: fit.values(), fit, nominal_values, weight_of, rows, warnings: Vec::new() }
    }

    /// As [`Calibration::prediction_factor`].
    fn prediction_factor(&self) -> f64 {
        (1.0 + self.fit.rank as f64 / self.rows.max(1) as f64).sqrt()
    }

    /// Robust weight of an observation in the fit; 1 where it did not take part.
    pub fn weight(&self, i: usize) -> f64 {
        self.weight_of[i].map_or(1.0, |at| self.fit.weights[at])
    }
}

/// Residuals and errors of all turns and the last fit.
fn assemble_calibration(
    judge: &Judge<'_>,
    holdout: &Holdout,
    turns: &[Fold],
    last: Fold,
) -> Result<Calibration, CalibrateError> {
    let all: Vec<usize> = (0..judge.observations.len()).collect();
    let held: BTreeSet<usize> = holdout.turns.iter().flatten().copied().collect();
    let seen: Vec<usize> = all.iter().copied().filter(|i| !held.contains(i)).collect();
    let mut placed: Vec<(&usize, Residual)> =
        seen.iter().zip(judge.residuals(&seen, &last, false)?).collect();
    for (held, turn) in holdout.turns.iter().zip(turns) {
        placed.extend(held.iter().zip(judge.residuals(held, turn, true)?));
    }
    placed.sort_by_key(|(place, _)| **place);
    let residuals: Vec<Residual> = placed.into_iter().map(|(_, residual)| residual).collect();
    // In turns, everything is training for the last fit.
    let train = if holdout.in_turn { judge.residuals(&all, &last, false)? } else { Vec::new() };
    let held: Vec<&Residual> = residuals.iter().filter(|r| r.held_out).collect();
    let seen: Vec<&Residual> =
        train.iter().chain(residuals.iter().filter(|r| !r.held_out && !holdout.in_turn)).collect();
    let judged = if held.is_empty() { &seen } else { &held };
    let noise_floor_m = judged.iter().map(|r| r.expected_norm_m).sum::<f64>() / judged.len() as f64;
    let (train, holdout_errors) = (side_errors(&seen), side_errors(&held));
    let prediction_factor = match held.is_empty() {
        true => 1.0,
        false => turns.iter().map(Fold::prediction_factor).sum::<f64>() / turns.len() as f64,
    };
    let mut warnings = last.fit.warnings.clone();
    let of_turns: Vec<&Warning> =
        holdout.warnings.iter().chain(turns.iter().flat_map(|t| &t.warnings)).collect();
    for warning in of_turns {
        if !warnings.contains(warning) {
            warnings.push(warning.clone());
        }
    }
    let turn_sigma_ratio = if holdout.in_turn { sigma_ratios(turns, &last) } else { Vec::new() };
    let mut calibration = Calibration {
        fit: last.fit,
        nominal_values: last.nominal_values,
        residuals,
        train,
        holdout: holdout_errors,
        noise_floor_m,
        prediction_factor,
        turn_sigma_ratio,
        turn_nominal_values: turns.iter().map(|turn| turn.nominal_values.clone()).collect(),
        warnings,
    };
    calibration.warnings.extend(fit_warnings::above_floor(&calibration));
    Ok(calibration)
}

/// As [`Calibration::turn_sigma_ratio`]; 1 of a fixed parameter.
fn sigma_ratios(turns: &[Fold], last: &Fold) -> Vec<f64> {
    let ratio = |k: usize, turn: &Fold| turn.fit.estimates[k].sigma / last.fit.estimates[k].sigma;
    let free = |k: &usize| last.fit.estimates[*k].sigma > 0.0;
    let largest = |k: usize| turns.iter().map(|turn| ratio(k, turn)).fold(0.0, f64::max);
    (0..last.fit.estimates.len()).map(|k| if free(&k) { largest(k) } else { 1.0 }).collect()
}

/// The fit to all observations, for turns that begin where it ended.
struct All<'a> {
    last: &'a Fold,
    /// All observations there, for several turns.
    looked: Option<Arc<Looked>>,
    /// The same at the nominal arm in its frames, where no turn knows these and the observations are very many.
    frames: Option<Arc<Looked>>,
}

/// Observations that can be fitted without some of them, and the error of each.
struct Judge<'a> {
    model: &'a Model,
    observations: &'a [Observation],
    config: &'a FitConfig,
    nominal: Nominal,
}

impl Judge<'_> {
    /// Fits without the observations `held`, from nominal or from where the fit ended that saw them too. Where the nominal arm
    /// and its frames are known they are not looked for.
    fn turn(
        &self,
        (held, nominal): (&[usize], Option<&Vec<f64>>),
        near: Option<&All<'_>>,
    ) -> Result<Fold, CalibrateError> {
        let places = |is_held: bool| -> Vec<usize> {
            let all = 0..self.observations.len();
            all.filter(|i| held.binary_search(i).is_ok() == is_held).collect()
        };
        let side = |places: &[usize]| {
            let chosen = places.iter().map(|&i| &self.observations[i]);
            ModelProblem::new(self.model, chosen, self.config)
        };
        let seen = places(false);
        let (train, test) = (side(&seen)?, side(&places(true))?);
        let unseen = self.frames_only_in(&test, &train);
        let names: BTreeSet<&str> = unseen.iter().map(String::as_str).collect();
        let of_unseen = |p: &Parameter| names.contains(frame_names::frame_of(p));
        let same = near.and_then(|_| self.blocks_of(&train, &seen));
        let mut nominal_values = match (nominal, near) {
            (Some(known), _) => known.clone(),
            (None, Some(near)) => {
                let frames = near.frames.as_ref().zip(same.as_ref()).map(|(all, same)| all.of(same));
                frames::fit_on_fewer(&train, &near.last.nominal_values, frames.as_ref(), self.config)?
            }
            (None, None) => frames::fit_on(&train, self.config)?,
        };
        let free = |p: &Parameter| p.free && !of_unseen(p);
        let mut fit = match near {
            Some(near) => {
                let looked = near.looked.as_ref().zip(same.as_ref()).map(|(all, same)| all.of(same));
                let near = Near { looked, ..self.near(&near.last.fit, &nominal_values, &of_unseen) };
                fit_near(&train, near, &free, self.config)?
            }
            None => match self.nominal.start.as_ref().filter(|_| self.config.objective != Objective::Paper) {
                Some(Start { values, prior_scales }) => {
                    let values = self.without(&of_unseen, values, &nominal_values);
                    fit_where_priors(&train, (&values, prior_scales), &free, self.config)?
                }
                None => fit_problem(&train, &nominal_values, &free, self.config)?,
            },
        };
        let mut warnings = Vec::new();
        if !unseen.is_empty() {
            if nominal.is_none() {
                nominal_values = frames::fit_some(&test, nominal_values, self.config, &of_unseen)?;
            }
            let start = frames::fit_some(&test, fit.values(), self.config, &of_unseen)?;
            let frozen = fit_problem(&test, &start, &|p| p.free && of_unseen(p), self.config)?;
            adopt_frames(&mut fit, &frozen, &of_unseen);
            warnings.push(fitted_on_held_out(&unseen));
        }
        Ok(Fold { warnings, ..Fold::new(fit, nominal_values, held, self.observations) })
    }

    /// These observations as a turn predicts them.
    fn residuals(&self, of: &[usize], turn: &Fold, held_out: bool) -> Result<Vec<Residual>, CalibrateError> {
        let observations: Vec<&Observation> = of.iter().map(|i| &self.observations[*i]).collect();
        let at = |p: &[f64]| {
            let mut all = Vec::with_capacity(of.len());
            self.model.residuals(p, &observations, false, &mut |_, residual| all.push(residual));
            all
        };
        let one = |((&i, fitted), nominal): ((&usize, ModelResidual), ModelResidual)| {
            let o = &self.observations[i];
            let covariance = position_covariance_m2(self.model, &turn.values, o);
            let whitened = whiten_position(&fitted, &covariance)
                .ok_or_else(|| CalibrateError::BadCovariance { observation: describe_observation(o) })?;
            Ok(Residual {
                dwell: o.dwell,
                held_out,
                nominal_m: nominal.position_m,
                fitted_m: fitted.position_m,
                whitened,
                weight: if held_out { 1.0 } else { turn.weight(i) },
                expected_norm_m: expected_norm_m(&covariance),
            })
        };
        of.iter().zip(at(&turn.values)).zip(at(&turn.nominal_values)).map(one).collect()
    }

    /// Where a fit ended, as a start; what the turn must not know of is at nominal.
    fn near(&self, fit: &Fit, nominal_values: &[f64], unseen: &dyn Fn(&Parameter) -> bool) -> Near {
        let values = self.without(unseen, &fit.values(), nominal_values);
        let prior_scales = scales_of(fit.estimates.iter().zip(self.model.parameters()));
        Near { values, sigma_scale: fit.sigma_scale, prior_scales, looked: None }
    }

    /// Parameters, those that are `unseen` at nominal.
    fn without(
        &self,
        unseen: &dyn Fn(&Parameter) -> bool,
        values: &[f64],
        nominal_values: &[f64],
    ) -> Vec<f64> {
        let each = self.model.parameters().iter().zip(values).zip(nominal_values);
        each.map(|((p, value), nominal)| if unseen(p) { *nominal } else { *value }).collect()
    }

    /// All observations where the fit to them ended, as turns that begin there will ask of it.
    fn look<'t>(&self, last: &'t Fold, turns: usize) -> Result<All<'t>, CalibrateError> {
        if turns < 2 {
            return Ok(All { last, looked: None, frames: None });
        }
        let problem = ModelProblem::new(self.model, self.observations, self.config)?;
        let looked = evaluate_problem(&problem, &last.values, &|p| p.free, self.config)?;
        let frames = match self.nominal.turns.len() == turns || !keeps_derivative(&problem) {
            true => None,
            false => frames::evaluate_frames(&problem, &last.nominal_values, self.config)?,
        };
        Ok(All { last, looked: Some(looked), frames })
    }

    /// The blocks among those of all that a problem with the observations at these places has; none where its blocks are others.
    fn blocks_of(&self, train: &ModelProblem<'_>, places: &[usize]) -> Option<Vec<usize>> {
        let blocks = measured_together(self.observations);
        let of = |run: &Range<usize>| {
            let block = blocks.binary_search_by_key(&places[run.start], |block| block.start).ok()?;
            (blocks[block].len() == run.len()).then_some(block)
        };
        train.runs().iter().map(of).collect()
    }

    /// Estimated frames (and what else a recording of a pool has for itself, unless it was measured) that `test` says
    /// something about and `train` does not.
    fn frames_only_in(&self, test: &ModelProblem<'_>, train: &ModelProblem<'_>) -> Vec<String> {
        let known: BTreeSet<String> =
            frame_names::touched_frames(self.model, train.observations()).into_iter().collect();
        let unknown = self.model.parameters().iter().filter(|p| p.free && p.role != Role::KnownFrame);
        let unknown: BTreeSet<&str> = unknown.map(frame_names::frame_of).collect();
        frame_names::touched_frames(self.model, test.observations())
            .into_iter()
            .filter(|frame| !known.contains(frame) && unknown.contains(frame.as_str()))
            .collect()
    }
}

/// Takes the parameters of frames fitted on the held-out set into the training fit.
fn adopt_frames(fit: &mut Fit, frozen: &Fit, of_unseen: &dyn Fn(&Parameter) -> bool) {
    let taken: Vec<usize> =
        (0..fit.estimates.len()).filter(|&k| of_unseen(&fit.estimates[k].parameter)).collect();
    for &row in &taken {
        fit.estimates[row] = frozen.estimates[row].clone();
    }
    fit.covariance.adopt(&frozen.covariance);
}

fn fitted_on_held_out(unseen: &[String]) -> Warning {
    let message = "no training dwell shows this frame: it alone was fitted on the held-out dwells, with everything else \
                   as the training left it"
        .to_string();
    Warning::new(Severity::Notice, Stage::Calibrate, Code::FrameFittedOnHoldout, unseen.join(", "), message)
}

fn side_errors(residuals: &[&Residual]) -> SideErrors {
    let norms =
        |of: fn(&Residual) -> Vector3<f64>| -> Vec<f64> { residuals.iter().map(|r| of(r).norm()).collect() };
    SideErrors {
        nominal: ErrorStats::of_norms(&norms(|r| r.nominal_m)),
        fitted: ErrorStats::of_norms(&norms(|r| r.fitted_m)),
    }
}
