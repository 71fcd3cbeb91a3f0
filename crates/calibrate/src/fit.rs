//! One fit: from start values to estimates with intervals.

use crate::covariance::Covariance;
use crate::model_problem::ModelProblem;
use crate::outcome::{Estimate, Fit, PaperObjective, Status};
use crate::priors::PriorScales;
use crate::problem::Problem;
use crate::remembered::{Looked, Remembered, evaluate_problem};
use crate::robust::{RobustCost, median_scale, proposal2_scale};
use crate::solver::{self, Curvature, Settings};
use crate::statistics::{self, Uncertainty};
use crate::whitened::{Point, Whitened};
use crate::{
    CalibrateError, FitConfig, Objective, Scale, fit_warnings, frames, paper, priors, undetermined, wider,
};
use armcal_core::{Observation, Parameter, Role, Warning};
use armcal_model::Model;
use nalgebra::DVector;
use std::sync::Arc;

/// A step of this many standard deviations of the estimate ends the iteration.
const STEP_TOLERANCE: f64 = 1e-5;
/// The same while the scale of the residuals is still being found.
const ROUGH_STEP_TOLERANCE: f64 = 0.5;
/// Rounds of fit and scale that only look for the scale.
const ROUGH_ROUNDS: usize = 2;
/// The start is judged at this many times its median residual, so that only gross outliers are in the linear part.
const GENEROUS: f64 = 3.0;
/// Relative change of the scale below which it is kept.
const SCALE_TOLERANCE: f64 = 3e-3;
/// Rounds of fit and scale.
const SCALE_ROUNDS: usize = 30;
/// Rounds of fit and noise, and the change of a parameter, in units of its prior, that ends them.
const NOISE_ROUNDS: usize = 8;
const NOISE_TOLERANCE: f64 = 1e-3;
/// Huber's constant whose asymptotics stand in for those of the sum of norms (its limit c -> 0 divides by zero at
/// a point that is fitted exactly).
const PAPER_HUBER_C: f64 = 0.25;

/// Fits all free parameters of a model: frames that nobody knew first (closed form, then alone), then everything.
pub fn fit(model: &Model, observations: &[Observation], config: &FitConfig) -> Result<Fit, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    let start = frames::fit_on(&problem, config)?;
    fit_problem(&problem, &start, &|p| p.free, config)
}

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

/// Where the parameters ended, and the scale the loss was judged at.
pub(crate) struct Solved {
    pub at: Point,
    pub sigma_scale: f64,
    pub paper: Option<PaperObjective>,
    pub status: Status,
    pub iterations: usize,
    /// Curvature of the cost there, where it was minimised by it.
    pub curvature: Option<Curvature>,
}

impl Solved {
    /// Where the problem starts.
    fn unmoved(white: &Whitened<'_>, sigma_scale: f64) -> Result<Solved, CalibrateError> {
        let at = white.at(white.start())?;
        let status = Status::Converged;
        Ok(Solved { at, sigma_scale, paper: None, status, iterations: 0, curvature: None })
    }

    /// The cost that was minimised (for eq. 4: the one that stands in for it in the statistics).
    pub fn cost<'a, 'p>(&self, white: &'a Whitened<'p>, config: &FitConfig) -> RobustCost<'a, 'p> {
        let mut cost = RobustCost::new(white, config, self.sigma_scale);
        if self.paper.is_some() {
            cost.huber_c = Some(PAPER_HUBER_C);
        }
        cost
    }
}

/// Minimises the objective asked for; `sigma_scale` where it is known roughly.
pub(crate) fn minimise_objective(
    white: &Whitened<'_>,
    sigma_scale: Option<f64>,
    config: &FitConfig,
) -> Result<Solved, CalibrateError> {
    if config.objective != Objective::Paper {
        return solve_robust(white, sigma_scale, config);
    }
    let solution = paper::minimise(white, config)?;
    let mut solved = Solved {
        at: white.at(solution.x)?,
        sigma_scale: 1.0,
        paper: Some(solution.objective),
        status: solution.status,
        iterations: solution.iterations,
        curvature: None,
    };
    let cost = solved.cost(white, config);
    solved.sigma_scale = proposal2_scale(&cost, &solved.at, white.axes.len() as f64).max(1.0);
    Ok(solved)
}

/// Alternates between the fit at a scale and the scale of its residuals, never below the declared noise. The first,
/// rough rounds begin with all but gross outliers in the square part of the loss and end with outliers in the linear
/// one; the accurate ones confirm the scale. Where the scale is `known` roughly, so are the parameters: no rough rounds.
fn solve_robust(
    white: &Whitened<'_>,
    known: Option<f64>,
    config: &FitConfig,
) -> Result<Solved, CalibrateError> {
    let estimated = config.objective == Objective::Robust && config.scale == Scale::Estimated;
    let fixed = if estimated { known.map(|scale| scale.max(1.0)) } else { Some(1.0) };
    let mut at = white.at(white.start())?;
    let mut sigma_scale = fixed.unwrap_or_else(|| (GENEROUS * median_scale(white, &at)).max(1.0));
    let mut iterations = 0;
    let mut round = if known.is_some() { ROUGH_ROUNDS } else { 0 };
    loop {
        round += 1;
        let rough = estimated && round <= ROUGH_ROUNDS;
        let step_tolerance = if rough { ROUGH_STEP_TOLERANCE } else { STEP_TOLERANCE };
        let cost = RobustCost { exact_curvature: !rough, ..RobustCost::new(white, config, sigma_scale) };
        let settings = Settings { max_iterations: config.max_iterations, step_tolerance, stop: &config.stop };
        let solution = solver::minimise(&cost, at, settings)?;
        iterations += solution.iterations;
        let fitted = solution.fitted_directions(white);
        at = solution.at;
        let mut next = sigma_scale;
        if estimated {
            next = proposal2_scale(&cost, &at, fitted).max(1.0);
        }
        let settled = (next / sigma_scale - 1.0).abs() < SCALE_TOLERANCE;
        if !rough && (settled || round >= SCALE_ROUNDS) {
            let (status, curvature) = (solution.status, Some(solution.hessian));
            return Ok(Solved { at, sigma_scale, paper: None, status, iterations, curvature });
        }
        sigma_scale = next;
    }
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

impl solver::Solution {
    /// Directions fitted by the data, from the curvature of the last step.
    fn fitted_directions(&self, white: &Whitened<'_>) -> f64 {
        let covariance = self.hessian.inverse(1.0, &DVector::zeros(white.axes.len()));
        let of = |c: Covariance| statistics::fitted_directions(&c.variances(), &white.axes);
        covariance.map_or(white.axes.len() as f64, of)
    }
}
