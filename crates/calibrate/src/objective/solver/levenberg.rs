//! Levenberg-Marquardt with bounds: every step is the exact minimiser of the damped quadratic model within the box.

use super::{Cost, Curvature, Quadratic, bounded_qp};
use crate::config::Stop;
use crate::objective::axes::Point;
use crate::{CalibrateError, Status};
use nalgebra::DVector;

/// When to stop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Settings<'a> {
    /// Limit of accepted steps.
    pub max_iterations: usize,
    /// Converged when `sqrt(d'Hd)` falls below this: a step of that many standard deviations of the estimate.
    pub step_tolerance: f64,
    /// Asked at every step.
    pub stop: &'a Stop,
}

/// A last step of no more standard deviations of the estimate may end where the linearised problem has it. That is less than the
/// tolerance of convergence: who goes on from there does not learn what a fresh linearisation would say.
const NEGLIGIBLE: f64 = 1e-7;

/// Where the iteration ended.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub at: Point,
    /// Curvature at the last point it was computed at: the solution or one step before it.
    pub hessian: Curvature,
    pub status: Status,
    pub iterations: usize,
}

/// Minimises `cost` from `start`.
///
/// Marquardt's scaling by the largest curvature seen; damping by the ratio of actual to predicted decrease (Madsen,
/// Nielsen and Tingleff 2004, with a factor of ten instead of three on the way down). The test of convergence has no
/// unit: the step in the metric of the Hessian, that is, in standard deviations of the estimate. A trial point at
/// which the cost is not finite counts as a failed step; the start is evaluated by the caller. An error says that nobody waits
/// any more.
pub(crate) fn minimise(
    cost: &dyn Cost,
    start: Point,
    settings: Settings<'_>,
) -> Result<Solution, CalibrateError> {
    let (lower, upper) = (cost.lower(), cost.upper());
    let mut at = start;
    let mut model = cost.model(&at);
    let mut damping = model.damping.clone();
    let (mut mu, mut growth) = (1e-8, 10.0);
    for iterations in 0..settings.max_iterations {
        settings.stop.check()?;
        damping.zip_apply(&model.damping, |d, new| *d = d.max(new));
        loop {
            let damped = model.hessian.damped(&(&damping * mu));
            let step = bounded_qp::minimise(&damped, &model.gradient, &(&lower - &at.x), &(&upper - &at.x));
            let Some(step) = step.filter(|d| d.iter().all(|v| v.is_finite())) else {
                mu *= growth;
                if mu > 1e20 {
                    return Ok(solution_at(at, model, Status::IterationLimit, iterations));
                }
                continue;
            };
            let curvature = step.dot(&model.hessian.times(&step));
            let predicted = -model.gradient.dot(&step) - 0.5 * curvature;
            let rounding = 16.0 * f64::EPSILON * model.value.abs();
            let done = curvature.sqrt() <= settings.step_tolerance || predicted <= rounding;
            let x = snap_to_bounds(&at.x + step, &lower, &upper);
            if done && curvature.sqrt() <= NEGLIGIBLE && cost.ends_straight() {
                return Ok(solution_at(cost.moved(at, x), model, Status::Converged, iterations + 1));
            }
            let trial = cost.at(x).ok();
            let value = trial.as_ref().map_or(f64::INFINITY, |trial| cost.value(trial));
            let gain = (model.value - value) / predicted;
            if done {
                // Costs at two points this close differ by less than their rounding: only what more than the tolerated
                // step is worth says that the last step was wrong.
                let tolerated = rounding.max(0.5 * settings.step_tolerance.powi(2));
                let end = trial.filter(|_| value - model.value <= tolerated).unwrap_or(at);
                return Ok(solution_at(end, model, Status::Converged, iterations + 1));
            }
            if let Some(trial) = trial.filter(|_| gain > 1e-4) {
                mu = if gain > 0.5 { (0.1 * mu).max(1e-15) } else { mu };
                growth = 10.0;
                at = trial;
                break;
            }
            mu *= growth;
            growth *= 2.0;
            if !mu.is_finite() {
                return Ok(solution_at(at, model, Status::IterationLimit, iterations));
            }
        }
        model = cost.model(&at);
    }
    Ok(solution_at(at, model, Status::IterationLimit, settings.max_iterations))
}

fn solution_at(at: Point, model: Quadratic, status: Status, iterations: usize) -> Solution {
    Solution { at, hessian: model.hessian, status, iterations }
}

/// Puts what is at a bound up to rounding onto the bound.
fn snap_to_bounds(x: DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(x.len(), |i, _| {
        let near = |bound: f64| bound.is_finite() && (x[i] - bound).abs() <= 1e-13 * (1.0 + bound.abs());
        if near(lower[i]) || x[i] < lower[i] {
            lower[i]
        } else if near(upper[i]) || x[i] > upper[i] {
            upper[i]
        } else {
            x[i]
        }
    })
}
