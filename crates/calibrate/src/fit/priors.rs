//! How far the arm is from nominal where nobody declared it: the scale of each kind of parameter, learnt from the data.
//!
//! Lengths, angles between axes and joint zeros of one arm are each drawn from `N(nominal, s^2)` with one s a kind. The s
//! that makes the data most probable satisfies, with the posterior variances v of the parameters of a kind in units of s,
//!
//! ```text
//! s_new^2 = s^2 sum x_k^2 / sum (1 - v_k)
//! ```
//!
//! (MacKay, Bayesian Interpolation, Neural Computation 4, 1992, eq. 2.17 and 2.18); where the data hardly know the kind,
//! one step of expectation-maximisation, `s_new^2 = s^2 sum (x_k^2 + v_k) / n`, which never overshoots. The default prior
//! is the widest it becomes. Bounds that the arm goes beyond are [`crate::fit::wider`]'s matter.

use crate::fit::minimise::{Solved, minimise_objective};
use crate::fit::wider::fit_wider_bounds;
use crate::objective::axes::Axis;
use crate::objective::problem::Problem;
use crate::objective::whitened::Whitened;
use crate::objective::with_priors::WithPriors;
use crate::outcome::Estimate;
use crate::precision::statistics::posterior_covariance;
use crate::{CalibrateError, FitConfig, Objective};
use armcal_core::{Code, Parameter, ParameterKind, Severity, Stage, Warning};
use std::collections::BTreeMap;

/// Rounds of fit and scale.
const ROUNDS: usize = 30;
/// Relative change of a scale below which it is kept.
const TOLERANCE: f64 = 0.01;
/// A scale changes by no more than this factor in one round.
const LARGEST_STEP: f64 = 5.0;
/// Smallest share of the default prior.
const SMALLEST: f64 = 1e-3;
/// Parameters of a kind that the data must know before the fast formula is used.
const WELL_KNOWN: f64 = 1.0;

/// Scale of each kind of prior, as a share of the default one.
pub(crate) type PriorScales = BTreeMap<ParameterKind, f64>;

/// The scales that a fit learnt: of each of its estimates beside the same parameter with its default prior.
pub(crate) fn scales_of<'a>(fit: impl Iterator<Item = (&'a Estimate, &'a Parameter)>) -> PriorScales {
    let scale = |(e, default): (&Estimate, &Parameter)| {
        Some((default.assumed?, e.parameter.prior_sigma? / default.prior_sigma?))
    };
    fit.filter(|(e, _)| e.parameter.free).filter_map(scale).collect()
}

/// Whether [`fit_learnt_scales`] fits with scales that another fit learnt, whatever the fit with the default priors is.
pub(crate) fn begins_with(white: &Whitened<'_>, scales: &PriorScales, config: &FitConfig) -> bool {
    !scales.is_empty() && are_learnt(white, config)
}

fn are_learnt(white: &Whitened<'_>, config: &FitConfig) -> bool {
    let is_assumed = |axis: &Axis| white.problem.parameters()[axis.index].assumed.is_some();
    config.learn_priors && config.objective != Objective::Paper && white.axes.iter().any(is_assumed)
}

/// A problem with its priors, as far as nobody declared them, at scales of the default ones.
pub(crate) fn scale_priors<'a>(problem: &'a dyn Problem, scales: &PriorScales) -> Box<dyn Problem + 'a> {
    if scales.is_empty() {
        return Box::new(problem);
    }
    let mut parameters = problem.parameters().to_vec();
    for p in &mut parameters {
        let scale = p.assumed.and_then(|kind| scales.get(&kind));
        p.prior_sigma = p.prior_sigma.map(|sigma| sigma * scale.unwrap_or(&1.0));
    }
    Box::new(WithPriors { problem, parameters })
}

/// A fit with priors as narrow as the data ask for, from a fit with priors at some scales of the default ones and from the scales
/// that a fit to nearly the same data learnt; none where all are declared.
pub(crate) fn fit_learnt_scales<'a>(
    problem: &'a dyn Problem,
    (white, solved, begun): (&Whitened<'_>, &Solved, &PriorScales),
    near: Option<&PriorScales>,
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<Option<(Whitened<'a>, Solved)>, CalibrateError> {
    if !are_learnt(white, config) {
        return Ok(None);
    }
    let mut scales = PriorScales::new();
    let mut latest: Option<(Whitened<'a>, Solved)> = None;
    let mut proposed = near.filter(|scales| !scales.is_empty()).cloned();
    for _ in 0..ROUNDS {
        let (white, solved) = latest.as_ref().map_or((white, solved), |(white, solved)| (white, solved));
        let next = match proposed.take() {
            Some(scales) => scales,
            None => update_scales(if scales.is_empty() { begun } else { &scales }, white, solved)?,
        };
        let kept = |(kind, scale): (&ParameterKind, &f64)| {
            scales.get(kind).is_some_and(|old| (scale / old - 1.0).abs() < TOLERANCE)
        };
        if next.iter().all(kept) {
            break;
        }
        scales = next;
        let start = white.parameters_at(&solved.at.x);
        let again = Whitened::new(scale_priors(problem, &scales), &start, free, config)?;
        let mut better = minimise_objective(&again, Some(solved.sigma_scale), config)?;
        better.iterations += solved.iterations;
        latest = Some((again, better));
    }
    let (white, solved) = latest.as_ref().map_or((white, solved), |(white, solved)| (white, solved));
    let wider = fit_wider_bounds(problem, (white, solved), free, config)?;
    Ok(wider.or(latest))
}

/// The scale of each kind as the fit at these scales has it.
fn update_scales(
    scales: &PriorScales,
    white: &Whitened<'_>,
    solved: &Solved,
) -> Result<PriorScales, CalibrateError> {
    let parameters = white.problem.parameters();
    let name = |index: usize| parameters[index].name.clone();
    let data = solved.sigma_scale.powi(-2);
    let variances = posterior_covariance(&white.squares(&solved.at), &white.axes, data, &name)?.variances();
    // Of each kind: how many, those known, and squares of offsets and of standard deviations.
    let mut sums: BTreeMap<ParameterKind, [f64; 4]> = BTreeMap::new();
    for ((axis, x), variance) in white.axes.iter().zip(solved.at.x.iter()).zip(variances.iter()) {
        let Some(kind) = parameters[axis.index].assumed else { continue };
        let sum = sums.entry(kind).or_default();
        *sum = [sum[0] + 1.0, sum[1] + 1.0 - variance, sum[2] + x * x, sum[3] + variance];
    }
    let scale = |(kind, [n, known, square, variance]): (ParameterKind, [f64; 4])| {
        let factor = if known > WELL_KNOWN { square / known } else { (square + variance) / n };
        let factor = factor.sqrt().clamp(LARGEST_STEP.recip(), LARGEST_STEP);
        let old = scales.get(&kind).copied().unwrap_or(1.0);
        (kind, (old * factor).clamp(SMALLEST, 1.0))
    };
    Ok(sums.into_iter().map(scale).collect())
}

/// What was learnt, in words.
pub(crate) fn learnt_notice(white: &Whitened<'_>) -> Option<Warning> {
    let parameters = white.axes.iter().map(|a| &white.problem.parameters()[a.index]);
    let kinds: BTreeMap<ParameterKind, String> = parameters
        .filter_map(|p| {
            let sigma = p.unit.to_display(p.prior_sigma?);
            Some((p.assumed?, format!("{} {:.2} {}", p.assumed?.words(), sigma, p.unit.display_symbol())))
        })
        .collect();
    let widths: Vec<&str> = kinds.values().map(String::as_str).collect();
    let message = format!(
        "how far this arm may be from nominal was not declared; the data say (standard deviations): {}; [model.deviation] or \
         the model's [deviation] declare other priors",
        widths.join(", ")
    );
    let subject = "priors".to_owned();
    (!kinds.is_empty())
        .then(|| Warning::new(Severity::Notice, Stage::Calibrate, Code::PriorsLearnt, subject, message))
}

#[cfg(test)]
#[path = "../tests/priors.rs"]
mod tests;
