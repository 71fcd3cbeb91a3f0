//! The very objective the robust fit minimises, as a plain least-squares problem, for a cross-check by other solvers.
//!
//! A loss on the norm of a vector is no loss per row, so each block is stretched: `f_j = e_j sqrt(2 rho(u)) / u` with
//! u its norm, whence `|f|^2 / 2 = rho(u)`. The prior rows follow. `scipy.optimize.least_squares(f, x0, f', bounds)`
//! with the linear loss then has the same minimum.

use crate::fit::frames;
use crate::fit::minimise::minimise_objective;
use crate::objective::axes::Point;
use crate::objective::model_problem::ModelProblem;
use crate::objective::robust::RobustCost;
use crate::objective::whitened::Whitened;
use crate::outcome::Fit;
use crate::{CalibrateError, FitConfig, Objective};
use armcal_core::Observation;
use armcal_model::Model;
use nalgebra::{DMatrix, DVector};

/// `min |f(x)|^2 / 2` over `lower <= x <= upper`, x the free parameters in units of their prior.
pub struct WhitenedProblem<'a> {
    white: Whitened<'a>,
    config: FitConfig,
    sigma_scale: f64,
}

/// The least-squares problem behind [`fit`](crate::fit()), at the residual scale that fit settles on. Eq. 4 is no least
/// squares: with `objective = "paper"` the problem is the plain weighted one.
pub fn whitened_problem<'a>(
    model: &'a Model,
    observations: &'a [Observation],
    config: &FitConfig,
) -> Result<WhitenedProblem<'a>, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    let start = frames::fit_on(&problem, config)?;
    let mut config = config.clone();
    if config.objective == Objective::Paper {
        config.objective = Objective::LeastSquares;
    }
    config.check()?;
    let white = Whitened::new(Box::new(problem), &start, &|p| p.free, &config)?;
    let sigma_scale = minimise_objective(&white, None, &config)?.sigma_scale;
    Ok(WhitenedProblem { white, config, sigma_scale })
}

impl WhitenedProblem<'_> {
    /// Names of x, in order.
    pub fn names(&self) -> Vec<String> {
        self.white.axes.iter().map(|a| self.white.problem.parameters()[a.index].name.clone()).collect()
    }

    /// Start of the fit.
    pub fn start(&self) -> DVector<f64> {
        self.white.start()
    }

    /// Lower bounds.
    pub fn lower(&self) -> DVector<f64> {
        DVector::from_iterator(self.white.axes.len(), self.white.axes.iter().map(|a| a.lower))
    }

    /// Upper bounds.
    pub fn upper(&self) -> DVector<f64> {
        DVector::from_iterator(self.white.axes.len(), self.white.axes.iter().map(|a| a.upper))
    }

    /// SI value per unit of x, and SI value at x = 0.
    pub fn scale_and_centre(&self) -> Vec<(f64, f64)> {
        self.white.axes.iter().map(|a| (a.scale, a.centre)).collect()
    }

    /// s of the objective.
    pub fn sigma_scale(&self) -> f64 {
        self.sigma_scale
    }

    /// All parameters of the model at x, SI.
    pub fn parameters_at(&self, x: &DVector<f64>) -> Vec<f64> {
        self.white.parameters_at(x)
    }

    /// x of a fit.
    pub fn x_of(&self, fit: &Fit) -> DVector<f64> {
        let axes = &self.white.axes;
        DVector::from_iterator(
            axes.len(),
            axes.iter().map(|a| (fit.estimates[a.index].value - a.centre) / a.scale),
        )
    }

    /// f(x): whitened rows of the observations, then one row for each prior.
    pub fn residual(&self, x: &DVector<f64>) -> Result<DVector<f64>, CalibrateError> {
        Ok(self.evaluate(&self.white.at(x.clone())?).0)
    }

    /// df/dx.
    pub fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, CalibrateError> {
        Ok(self.evaluate(&self.white.at(x.clone())?).1)
    }

    fn evaluate(&self, point: &Point) -> (DVector<f64>, DMatrix<f64>) {
        let (mut residual, mut jacobian) = (point.residual.clone(), self.white.jacobian(point));
        let (rows, n) = (residual.len(), point.x.len());
        let cost = RobustCost::new(&self.white, &self.config, self.sigma_scale);
        for (j, u) in cost.norms(point).into_iter().enumerate() {
            let (at, count, loss) = (self.white.offsets[j], self.white.dimension(j), cost.loss(j));
            let root = (2.0 * loss.rho(u)).sqrt();
            // Across the residual it stretches by `stretch`, along it by the derivative of sqrt(2 rho).
            let stretch = if u > 0.0 { root / u } else { 1.0 };
            let along = if u > 0.0 { loss.weight(u) * u / root } else { 1.0 };
            let direction = residual.rows(at, count).normalize();
            let block = jacobian.rows(at, count) * (stretch / self.sigma_scale);
            let radial = (direction.transpose() * &block) * (along / stretch - 1.0);
            let turned = if u > 0.0 { &block + &direction * radial } else { block };
            jacobian.rows_mut(at, count).copy_from(&turned);
            residual.rows_mut(at, count).scale_mut(stretch / self.sigma_scale);
        }
        let mut all = DVector::zeros(rows + n);
        all.rows_mut(0, rows).copy_from(&residual);
        let mut derivative = DMatrix::zeros(rows + n, n);
        derivative.rows_mut(0, rows).copy_from(&jacobian);
        for (k, a) in self.white.axes.iter().enumerate() {
            all[rows + k] = a.precision.sqrt() * point.x[k];
            derivative[(rows + k, k)] = a.precision.sqrt();
        }
        (all, derivative)
    }
}
