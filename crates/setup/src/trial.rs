//! One trial: the inputs of a calibration, one of them changed, fitted quickly, and how badly that fits.

use super::spread::spread_m;
use armcal_calibrate::{HoldoutConfig, Objective};
use armcal_core::Parameter;
use armcal_stages::associated::Associated;
use armcal_stages::{Change, Fitted, Inputs};
use armcal_table::Place;
use std::collections::BTreeSet;

/// An error of this many times its expectation is as bad as no error at all: a dwell that finds no place counts as much.
const CAP: f64 = 300.0;
/// What is wrong need not converge.
const MOST_ITERATIONS: usize = 25;
/// Dwells that still change their places after so many rounds have none.
const MOST_ROUNDS: usize = 3;
/// The effect that is no mechanism: hundreds of amplitudes that take whatever a joint's angle goes with.
const CURVE: &str = "error_curve";
/// Dwells that take part in trials; of more, as many are drawn evenly over time.
const MOST_DWELLS: usize = 150;

/// How badly inputs fit.
#[derive(Debug, Clone, Copy)]
pub struct Misfit {
    /// Mean over all dwells of the logarithm of error over expectation, saturating at both ends: a factor of e in every
    /// error is 1.
    pub log: f64,
    /// Mean error of the dwells that were used [m]; infinite where nothing could be fitted.
    pub mean_m: f64,
    /// Mean error that noise would give [m].
    pub floor_m: f64,
    /// How far what was measured spreads, as [`spread_m`] has it [m].
    pub spread_m: f64,
    /// Dwells that were used.
    pub used: usize,
    /// Dwells that sit in a cavity.
    pub seated: usize,
    /// Dwells at the board for which no cavity was found, though no more than one could be.
    pub homeless: usize,
}

/// The logarithm of an error over its expectation, flat at both ends.
fn saturating_log(ratio: f64) -> f64 {
    0.5 * (1.0 + ratio.min(CAP).powi(2)).ln()
}

impl Misfit {
    /// Of inputs that cannot be fitted.
    pub fn of_nothing() -> Misfit {
        let log = saturating_log(CAP);
        Misfit { log, mean_m: f64::INFINITY, floor_m: 0.0, spread_m: 1.0, used: 0, seated: 0, homeless: 0 }
    }

    /// Mean error over the floor.
    pub fn times_floor(&self) -> f64 {
        self.mean_m / self.floor_m
    }

    /// Mean error over the spread of what was measured; infinite where that is one point. Whatever shrinks all data shrinks
    /// all errors: of changes that rescale, this alone says whether anything fits better.
    pub fn of_spread(&self) -> f64 {
        self.mean_m / self.spread_m
    }
}

/// The bounds that a calibration had to widen.
fn widened_bounds(fitted: &Fitted) -> Vec<Change> {
    let assumed = fitted.model.parameters().iter();
    let taken = fitted.calibration.fit.estimates.iter().map(|e| &e.parameter);
    let width = |p: &Parameter| p.upper - p.lower;
    assumed
        .zip(taken)
        .filter(|(assumed, taken)| width(taken) > width(assumed))
        .map(|(assumed, taken)| Change::widened(&taken.name, width(taken) / width(assumed)))
        .collect()
}

/// Inputs with a plain robust fit to everything, nothing held out, priors as they come, no curves that follow any
/// error of a joint, and not more dwells than decide; bounds that nobody declared are as wide as the calibration, where
/// there is one, found them.
pub fn for_trials(inputs: &Inputs, calibrated: Option<&Fitted>) -> Inputs {
    let mut inputs = inputs.clone();
    inputs.changes.extend(calibrated.into_iter().flat_map(widened_bounds));
    inputs.pipeline.holdout = HoldoutConfig::None;
    if inputs.pipeline.fit.objective == Objective::Paper {
        inputs.pipeline.fit.objective = Objective::Robust;
    }
    inputs.pipeline.fit.learn_priors = false;
    inputs.pipeline.effects.retain(|effect| effect.kind != CURVE);
    inputs.pipeline.fit.max_iterations = inputs.pipeline.fit.max_iterations.min(MOST_ITERATIONS);
    inputs.most_rounds = inputs.most_rounds.min(MOST_ROUNDS);
    inputs.known = Associated::nothing_yet(inputs.seen.len());
    let total: usize = inputs.seen.iter().map(|s| s.dwells.len()).sum();
    let share = MOST_DWELLS as f64 / total.max(1) as f64;
    if share < 1.0 {
        for seen in &mut inputs.seen {
            let mut due = 0.0;
            seen.dwells.retain(|_| {
                due += share;
                let taken = due >= 1.0;
                due -= f64::from(taken);
                taken
            });
        }
    }
    inputs
}

/// How badly a fit of these inputs fits.
pub fn compute_misfit(inputs: &Inputs, fitted: &Fitted) -> Misfit {
    let used: BTreeSet<_> = fitted.observations.iter().map(|o| o.dwell).collect();
    let residuals = &fitted.calibration.residuals;
    let of_used: f64 = residuals.iter().map(|r| saturating_log(r.fitted_m.norm() / r.expected_norm_m)).sum();
    let total = inputs.dwells().count();
    let unused = total.saturating_sub(used.len()) as f64;
    let n = residuals.len().max(1) as f64;
    let places = |of: &dyn Fn(&Place) -> bool| fitted.places().filter(|place| of(place)).count();
    Misfit {
        log: (of_used + unused * saturating_log(CAP)) / total.max(1) as f64,
        mean_m: residuals.iter().map(|r| r.fitted_m.norm()).sum::<f64>() / n,
        floor_m: residuals.iter().map(|r| r.expected_norm_m).sum::<f64>() / n,
        spread_m: spread_m(&fitted.observations),
        used: used.len(),
        seated: places(&|place| matches!(place, Place::Seated { .. })),
        homeless: places(&|place| matches!(place, Place::Unassigned { .. } | Place::Ambiguous { .. })),
    }
}
