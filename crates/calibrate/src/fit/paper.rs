//! Eq. 4 of the paper, as published: `min E = sum_j |X_j - X'_j(DH')|` within the bounds, and `E <= k a`.
//!
//! `E` is both the objective and what is limited, so the limit can be met exactly when the minimum meets it: the
//! minimum is computed within the bounds and compared with `k a`.
//!
//! Sequential convex programming: around the current point every distance is the norm of an affine function, so the
//! model of E is a sum of norms, whose minimum within bounds and a trust region is a second-order cone programme
//! (clarabel). Where eq. 4 has many minimisers (two parallel axes), a quadratic term of a few nanometres decides for
//! the one nearest nominal. It has no noise model and no weights; unlike `fmincon`, the paper's solver, it needs no
//! derivative of a norm at zero, where a distance that is fitted exactly has none.

use crate::objective::problem::Linearised;
use crate::objective::whitened::Whitened;
use crate::{CalibrateError, FitConfig, PaperObjective, Status};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver as _, SolverStatus, SupportedConeT};
use nalgebra::DVector;

/// Weight [mm] of the tie-breaker `|x|^2 / 2`, x in units of the prior.
const TIE_BREAKER_MM: f64 = 1e-6;
/// Converged when the model promises less than this share of E.
const RELATIVE_TOLERANCE: f64 = 1e-8;
/// Smallest trust region, in units of the prior.
const SMALLEST_REGION: f64 = 1e-9;
/// Accuracy of the convex solver at a bound, in units of the prior.
const BOUND_TOLERANCE: f64 = 1e-6;

/// Minimiser of eq. 4 within the bounds.
pub(crate) struct PaperSolution {
    pub x: DVector<f64>,
    pub objective: PaperObjective,
    pub status: Status,
    pub iterations: usize,
}

/// Minimises eq. 4 from the start of `white`.
pub(crate) fn minimise(white: &Whitened<'_>, config: &FitConfig) -> Result<PaperSolution, CalibrateError> {
    let mut x = white.start();
    let mut value = objective_mm(white, &x)?;
    let mut region = 1.0;
    let (mut status, mut iterations) = (Status::IterationLimit, 0);
    'outer: while iterations < config.max_iterations {
        config.stop.check()?;
        iterations += 1;
        let blocks = white.distances(&x)?;
        loop {
            let step = solve_subproblem(white, &x, &blocks, region, iterations)?;
            let predicted = value - model_mm(&x, &blocks, &step);
            if predicted <= RELATIVE_TOLERANCE * value || region < SMALLEST_REGION {
                status = Status::Converged;
                break 'outer;
            }
            let trial = &x + &step;
            let trial_value = objective_mm(white, &trial).unwrap_or(f64::INFINITY);
            let gain = (value - trial_value) / predicted;
            if gain < 0.25 {
                region = 0.25 * step.amax().min(region);
            } else if gain > 0.75 && step.amax() > 0.9 * region {
                region *= 2.0;
            }
            if gain > 1e-4 {
                (x, value) = (trial, trial_value);
                break;
            }
        }
    }
    let sum_of_distances_m: f64 = white.distance_norms(&x)?.iter().sum();
    let limit_m = config.average_accuracy_mm.map_or(f64::INFINITY, |a| a * 1e-3 * white.blocks() as f64);
    let objective = PaperObjective { sum_of_distances_m, limit_m, feasible: sum_of_distances_m <= limit_m };
    Ok(PaperSolution { x, objective, status, iterations })
}

fn objective_mm(white: &Whitened<'_>, x: &DVector<f64>) -> Result<f64, CalibrateError> {
    let sum: f64 = white.distance_norms(x)?.iter().sum();
    Ok(1e3 * sum + 0.5 * TIE_BREAKER_MM * x.norm_squared())
}

fn model_mm(x: &DVector<f64>, blocks: &[Linearised], step: &DVector<f64>) -> f64 {
    let sum: f64 = blocks.iter().map(|(r, j)| (r + j * step).norm()).sum();
    1e3 * sum + 0.5 * TIE_BREAKER_MM * (x + step).norm_squared()
}

/// `min sum_j t_j + tie-breaker` over (d, t), `|r_j + J_j d| <= t_j`, d within bounds and trust region [mm].
fn solve_subproblem(
    white: &Whitened<'_>,
    x: &DVector<f64>,
    blocks: &[Linearised],
    region: f64,
    iteration: usize,
) -> Result<DVector<f64>, CalibrateError> {
    let (n, k) = (white.axes.len(), blocks.len());
    let mut programme = ConeProgramme::default();
    for (j, (residual, jacobian)) in blocks.iter().enumerate() {
        programme.entry(programme.rows(), n + j, -1.0);
        programme.right.push(0.0);
        for r in 0..residual.len() {
            let row = programme.rows();
            (0..n).for_each(|c| programme.entry(row, c, -1e3 * jacobian[(r, c)]));
            programme.right.push(1e3 * residual[r]);
        }
        programme.cones.push(SupportedConeT::SecondOrderConeT(1 + residual.len()));
    }
    for (c, axis) in white.axes.iter().enumerate() {
        for (sign, limit) in [(1.0, (axis.upper - x[c]).min(region)), (-1.0, (x[c] - axis.lower).min(region))]
        {
            programme.entry(programme.rows(), c, sign);
            programme.right.push(limit);
        }
    }
    programme.cones.push(SupportedConeT::NonnegativeConeT(2 * n));
    let linear: Vec<f64> = (0..n + k).map(|c| if c < n { TIE_BREAKER_MM * x[c] } else { 1.0 }).collect();
    let diagonal: Vec<usize> = (0..n).collect();
    let quadratic =
        CscMatrix::new_from_triplets(n + k, n + k, diagonal.clone(), diagonal, vec![TIE_BREAKER_MM; n]);
    let solution = programme.solve(&quadratic, &linear, iteration)?;
    Ok(DVector::from_fn(n, |c, _| {
        let axis = &white.axes[c];
        onto_bound(x[c] + solution[c].clamp(-region, region), axis.lower, axis.upper) - x[c]
    }))
}

/// Interior points stop a hair before or behind a bound: what is that near to it is on it.
fn onto_bound(x: f64, lower: f64, upper: f64) -> f64 {
    if x <= lower + BOUND_TOLERANCE {
        lower
    } else if x >= upper - BOUND_TOLERANCE {
        upper
    } else {
        x
    }
}

/// `A v + s = b`, s in the cones.
#[derive(Default)]
struct ConeProgramme {
    row: Vec<usize>,
    column: Vec<usize>,
    value: Vec<f64>,
    right: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl ConeProgramme {
    fn rows(&self) -> usize {
        self.right.len()
    }

    fn entry(&mut self, row: usize, column: usize, value: f64) {
        if value != 0.0 {
            self.row.push(row);
            self.column.push(column);
            self.value.push(value);
        }
    }

    fn solve(
        self,
        quadratic: &CscMatrix<f64>,
        linear: &[f64],
        iteration: usize,
    ) -> Result<Vec<f64>, CalibrateError> {
        let failed = |status: String| CalibrateError::Subproblem { iteration, status };
        let rows = self.rows();
        let matrix = CscMatrix::new_from_triplets(rows, linear.len(), self.row, self.column, self.value);
        let settings = DefaultSettings { verbose: false, ..DefaultSettings::default() };
        let mut solver = DefaultSolver::new(quadratic, linear, &matrix, &self.right, &self.cones, settings)
            .map_err(|e| failed(e.to_string()))?;
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress
                if solver.solution.x.iter().all(|v| v.is_finite()) =>
            {
                Ok(solver.solution.x)
            }
            status => Err(failed(format!("{status:?}"))),
        }
    }
}
