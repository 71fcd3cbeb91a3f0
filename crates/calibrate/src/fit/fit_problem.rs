//! The fit of any problem in blocks: with its noise and its priors, to estimates with intervals.

use crate::fit::minimise::{Solved, minimise_objective};
use crate::fit::priors::{self, PriorScales};
use crate::fit::{fit_warnings, wider};
use crate::objective::problem::Problem;
use crate::objective::remembered::{Looked, Remembered, evaluate_problem};
use crate::objective::robust::{RobustCost, proposal2_scale};
use crate::objective::whitened::Whitened;
use crate::outcome::covariance::Covariance;
use crate::outcome::{Estimate, Fit};
use crate::precision::statistics::{self, Uncertainty};
use crate::precision::undetermined;
use crate::{CalibrateError, FitConfig, Objective};
use armcal_core::{Parameter, Role, Warning};
use nalgebra::DVector;
use std::sync::Arc;

/// Rounds of fit and noise, and the change of a parameter, in units of its prior, that ends them.
const NOISE_ROUNDS: usize = 8;
const NOISE_TOLERANCE: f64 = 1e-3;

/// Fits the parameters `free` of any problem in blocks, from `start` (all parameters).
pub fn fit_problem(
    problem: &dyn Problem,
    start: &[f64],
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<Fit, CalibrateError> {
    fit_where_priors(problem, (start, &PriorScales::new()), free, config)
}

/// The same where priors, as far as they are learnt, begin at these scales of the default ones.
pub(crate) fn fit_where_priors(
    problem: &dyn Problem,
    start: (&[f64], &PriorScales),
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<Fit, CalibrateError> {
    fit_from(&Remembered::new(problem, None), start, None, free, config)
}

/// [`fit_problem`] from where another fit ended, at the scales it found: the same minimum in a few steps when most of the
/// blocks are the same. It is asked for values and weights alone: what it does not determine is not looked for. Not for
/// eq. 4, which ends anywhere within its limit, so that the start is part of the answer.
pub(crate) fn fit_near(
    problem: &dyn Problem,
    mut near: Near,
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<Fit, CalibrateError> {
    let looked = near.looked.take();
    let mut known = looked.clone().filter(|_| !config.every_step);
    let mut start = near.values.clone();
    // A derivative that stays all the way: that where the other fit ended, then that where the first one led.
    for is_renewed in [false, true] {
        if is_renewed {
            known = Some(Arc::unwrap_or_clone(evaluate_problem(problem, &start, free, config)?));
        }
        let Some(about) = known.as_ref().and_then(|looked| Remembered::about(problem, looked)) else { break };
        let fit = fit_from(&about, (&start, &PriorScales::new()), Some(&near), free, config)?;
        start = fit.values();
        if about.is_straight_to(&start) {
            return Ok(fit);
        }
    }
    let start = (near.values.as_slice(), &PriorScales::new());
    fit_from(&Remembered::new(problem, looked), start, Some(&near), free, config)
}

/// Where another fit ended.
pub(crate) struct Near {
    /// All parameters.
    pub values: Vec<f64>,
    /// Scale of the residuals in units of the declared noise.
    pub sigma_scale: f64,
    /// Scales of the priors that it learnt.
    pub prior_scales: PriorScales,
    /// The problem there, where it is known.
    pub looked: Option<Looked>,
}

fn fit_from(
    problem: &dyn Problem,
    (start, scales): (&[f64], &PriorScales),
    near: Option<&Near>,
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<Fit, CalibrateError> {
    config.check()?;
    // Noise that depends on what is found is found with the default priors.
    let none = PriorScales::new();
    let scales = if problem.noise_depends() { &none } else { scales };
    let declared = Whitened::new(priors::scale_priors(problem, scales), start, free, config)?;
    enough_equations(&declared)?;
    let solved = match near {
        // The first fit that counts is that with the priors which the other one learnt.
        Some(near)
            if priors::begins_with(&declared, &near.prior_scales, config) && !problem.noise_depends() =>
        {
            Solved::unmoved(&declared, near.sigma_scale)?
        }
        _ => minimise_objective(&declared, near.map(|n| n.sigma_scale), config)?,
    };
    let (declared, solved) = with_its_noise(problem, (declared, solved), free, config)?;
    let known = near.map(|n| &n.prior_scales);
    let learnt = priors::fit_learnt_scales(problem, (&declared, &solved, scales), known, free, config)?;
    let of_learnt = |(white, solved): &(Whitened<'_>, Solved)| {
        [priors::learnt_notice(white), wider::widened_notice(problem, white, solved)].into_iter().flatten()
    };
    let said: Vec<Warning> = learnt.iter().flat_map(of_learnt).collect();
    let values = learnt.as_ref().map(|(white, solved)| white.parameters_at(&solved.at.x));
    let (white, solved) = learnt.unwrap_or((declared, solved));
    let (at, squares) = (&solved.at, white.squares(&solved.at));
    let cost = solved.cost(&white, config);
    let name = |index: usize| problem.parameters()[index].name.clone();
    let mut uncertainty = statistics::uncertainty(&cost, at, &squares, &name)?;
    if let (Some(values), None) = (values, near) {
        // What the data determine is asked of them alone: a narrow prior that they taught is no reason to doubt them.
        let wide = Whitened::new(Box::new(problem), &values, free, config)?;
        let at = wide.at(wide.start())?;
        let cost = RobustCost::new(&wide, config, solved.sigma_scale);
        let of_data = statistics::uncertainty(&cost, &at, &wide.squares(&at), &name)?;
        let Uncertainty { determined, rank, undetermined, .. } = of_data;
        uncertainty = Uncertainty { determined, rank, undetermined, ..uncertainty };
    }
    let fitted = statistics::fitted_directions(&uncertainty.variances, &white.axes);
    let weights = match solved.paper {
        Some(_) => vec![1.0; white.blocks()],
        None => cost.weights(at),
    };
    // All that was measured in a dwell is trusted alike.
    let weights = problem.block_of_each().into_iter().map(|block| weights[block]).collect();
    let undetermined = match near {
        Some(_) => Vec::new(),
        None => undetermined::directions(
            &uncertainty.undetermined,
            &white.axes,
            problem.parameters(),
            &problem.symmetries(&white.parameters_at(&solved.at.x)),
        ),
    };
    let mut fit = Fit {
        objective: in_words(config).to_string(),
        estimates: estimates(&white, &solved.at.x, &uncertainty),
        covariance: full_covariance(&white, &uncertainty.covariance),
        weights,
        sigma_scale: proposal2_scale(&cost, at, fitted),
        rank: uncertainty.rank,
        undetermined,
        paper: solved.paper,
        status: solved.status,
        iterations: solved.iterations,
        warnings: Vec::new(),
    };
    fit.warnings = fit_warnings::of_fit(&fit, &white);
    fit.warnings.extend(said);
    Ok(fit)
}

/// The fit again with the noise of what it found, until that changes nothing: where the noise depends on what is estimated,
/// as of a joint that rests anywhere in a gap whose width is.
pub(crate) fn with_its_noise<'a>(
    problem: &'a dyn Problem,
    (mut white, mut solved): (Whitened<'a>, Solved),
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<(Whitened<'a>, Solved), CalibrateError> {
    if !problem.noise_depends() || config.objective == Objective::Paper {
        return Ok((white, solved));
    }
    for _ in 0..NOISE_ROUNDS {
        let values = white.parameters_at(&solved.at.x);
        let again = Whitened::new(Box::new(problem), &values, free, config)?;
        let mut better = minimise_objective(&again, Some(solved.sigma_scale), config)?;
        better.iterations += solved.iterations;
        let found = again.parameters_at(&better.at.x);
        let moved = again.axes.iter().map(|a| (found[a.index] - values[a.index]).abs() / a.scale);
        let settled = moved.fold(0.0, f64::max) < NOISE_TOLERANCE;
        (white, solved) = (again, better);
        if settled {
            break;
        }
    }
    Ok((white, solved))
}

/// Refuses more parameters about which nothing is known than there are equations.
pub(crate) fn enough_equations(white: &Whitened<'_>) -> Result<(), CalibrateError> {
    let parameters = white.problem.parameters();
    let unknown: Vec<&Parameter> = white
        .axes
        .iter()
        .map(|a| &parameters[a.index])
        .filter(|p| {
            p.role != Role::EstimatedFrame && p.prior_sigma.is_none() && !(p.upper - p.lower).is_finite()
        })
        .collect();
    if unknown.len() <= white.rows() {
        return Ok(());
    }
    let names: Vec<&str> = unknown.iter().map(|p| p.name.as_str()).collect();
    Err(CalibrateError::TooFewObservations {
        rows: white.rows(),
        observations: white.blocks(),
        unknown: unknown.len(),
        names: names.join(", "),
        needed: unknown.len().div_ceil(3),
    })
}

fn in_words(config: &FitConfig) -> &'static str {
    match config.objective {
        Objective::Robust => "robust least squares (Huber)",
        Objective::LeastSquares => "least squares",
        Objective::Paper => "sum of distances (eq. 4)",
    }
}

/// Every parameter, free and fixed. Intervals are those without bounds, cut off at them.
fn estimates(white: &Whitened<'_>, x: &DVector<f64>, uncertainty: &Uncertainty) -> Vec<Estimate> {
    let values = white.parameters_at(x);
    let mut estimates: Vec<Estimate> = white
        .problem
        .parameters()
        .iter()
        .zip(values)
        .map(|(parameter, value)| Estimate {
            parameter: parameter.clone(),
            value,
            sigma: 0.0,
            ci95: [value, value],
            determined: false,
            at_bound: false,
        })
        .collect();
    for (k, axis) in white.axes.iter().enumerate() {
        let e = &mut estimates[axis.index];
        e.sigma = axis.scale * uncertainty.variances[k].sqrt();
        let half = uncertainty.t95 * e.sigma;
        e.ci95 = [(e.value - half).max(e.parameter.lower), (e.value + half).min(e.parameter.upper)];
        e.determined = uncertainty.determined[k];
        e.at_bound = e.value <= e.parameter.lower || e.value >= e.parameter.upper;
    }
    estimates
}

/// From units of x to SI, over all parameters.
fn full_covariance(white: &Whitened<'_>, in_x: &Covariance) -> Covariance {
    let to = |axis: usize| (white.axes[axis].index, white.axes[axis].scale);
    in_x.rescaled(white.problem.parameters().len(), &to)
}
