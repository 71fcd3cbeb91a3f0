//! The minimum of an objective, and the scale of its residuals.

use crate::fit::paper;
use crate::objective::axes::Point;
use crate::objective::robust::{RobustCost, median_scale, proposal2_scale};
use crate::objective::solver::{self, Curvature, Settings};
use crate::objective::whitened::Whitened;
use crate::outcome::covariance::Covariance;
use crate::outcome::{PaperObjective, Status};
use crate::precision::statistics;
use crate::{CalibrateError, FitConfig, Objective, Scale};
use nalgebra::DVector;

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
/// Huber's constant whose asymptotics stand in for those of the sum of norms (its limit c -> 0 divides by zero at
/// a point that is fitted exactly).
const PAPER_HUBER_C: f64 = 0.25;

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
    pub fn unmoved(white: &Whitened<'_>, sigma_scale: f64) -> Result<Solved, CalibrateError> {
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

impl solver::Solution {
    /// Directions fitted by the data, from the curvature of the last step.
    fn fitted_directions(&self, white: &Whitened<'_>) -> f64 {
        let covariance = self.hessian.inverse(1.0, &DVector::zeros(white.axes.len()));
        let of = |c: Covariance| statistics::fitted_directions(&c.variances(), &white.axes);
        covariance.map_or(white.axes.len() as f64, of)
    }
}
