//! What a calibration returns.

pub(crate) mod covariance;

use crate::outcome::covariance::Covariance;
use armcal_core::{Code, DwellId, ErrorStats, Observation, Parameter, Warning};
use nalgebra::Vector3;

/// One parameter after the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The parameter as the model declared it; with the prior that was learnt where it declared none.
    pub parameter: Parameter,
    /// Value after the fit, SI.
    pub value: f64,
    /// Posterior standard deviation, SI; 0 for a fixed parameter.
    pub sigma: f64,
    /// 95 % interval, SI.
    pub ci95: [f64; 2],
    /// Whether the data, rather than the prior, decides its value.
    pub determined: bool,
    /// Whether the value lies on one of its bounds.
    pub at_bound: bool,
}

/// A combination of parameters the data say nothing about; the prior keeps it at nominal.
#[derive(Debug, Clone, PartialEq)]
pub struct UndeterminedDirection {
    /// Parameters that take part, with their share in the (unit) direction, largest first.
    pub shares: Vec<(String, f64)>,
    /// The same in physical words.
    pub text: String,
}

/// How the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// Converged to tolerance.
    Converged,
    /// Ran out of iterations; the best point is returned.
    IterationLimit,
}

/// Eq. 4 of the paper: `E = sum |X_j - X'_j|` against its limit `k a`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperObjective {
    /// `E` at the solution [m].
    pub sum_of_distances_m: f64,
    /// `k a` [m].
    pub limit_m: f64,
    /// Whether `E <= k a` can be met within the bounds.
    pub feasible: bool,
}

/// One fit to one set of observations.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Objective in words: `robust least squares (Huber)`, `sum of distances (eq. 4)`.
    pub objective: String,
    /// All parameters, free and fixed, in the model's order.
    pub estimates: Vec<Estimate>,
    /// Posterior covariance of all parameters (fixed rows zero), model order, SI.
    pub covariance: Covariance,
    /// Robust weight of each observation, 1 = fully trusted.
    pub weights: Vec<f64>,
    /// Square root of the reduced chi-square: 1 when the declared noise is right.
    pub sigma_scale: f64,
    /// Number of parameter directions the data determine.
    pub rank: usize,
    /// The directions they do not.
    pub undetermined: Vec<UndeterminedDirection>,
    /// Eq. 4 with its constraint, when that objective was asked for.
    pub paper: Option<PaperObjective>,
    /// How the iteration ended.
    pub status: Status,
    /// Iterations used.
    pub iterations: usize,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl Fit {
    /// The parameter vector in the model's order.
    pub fn values(&self) -> Vec<f64> {
        self.estimates.iter().map(|e| e.value).collect()
    }

    /// What was said of fewer equations than free parameters, which then follow anything.
    pub fn too_few_dwells(&self) -> Option<&Warning> {
        self.warnings.iter().find(|warning| warning.code == Code::TooFewDwells)
    }
}

/// One observation before and after; held-out ones are predicted by a fit that never saw them.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// The dwell.
    pub dwell: DwellId,
    /// Whether the fit that predicted it did not see it.
    pub held_out: bool,
    /// Measured minus predicted with nominal robot parameters, estimated frames fitted [m].
    pub nominal_m: Vector3<f64>,
    /// Measured minus predicted with the fitted parameters [m].
    pub fitted_m: Vector3<f64>,
    /// The same, whitened by the observation's covariance.
    pub whitened: Vector3<f64>,
    /// Robust weight in the fit; 1 for a held-out observation.
    pub weight: f64,
    /// Norm expected from the declared noise alone [m].
    pub expected_norm_m: f64,
}

/// Errors of one side of the hold-out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SideErrors {
    /// With nominal robot parameters, estimated frames fitted.
    pub nominal: ErrorStats,
    /// With the fitted parameters.
    pub fitted: ErrorStats,
}

/// The whole calibration: the final fit and what it does to points it saw and points it did not.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The fit whose parameters are written out.
    pub fit: Fit,
    /// Parameters that gave the nominal errors: robot nominal, estimated frames fitted.
    pub nominal_values: Vec<f64>,
    /// Every observation, in the order given.
    pub residuals: Vec<Residual>,
    /// Errors on points the fit saw.
    pub train: SideErrors,
    /// Errors on points it did not; zero observations when nothing was held out.
    pub holdout: SideErrors,
    /// Mean error expected from the declared noise alone, over the held-out points (or, without
    /// hold-out, over the training points) [m].
    pub noise_floor_m: f64,
    /// How much larger than the floor errors on held-out points are expected to be though nothing is missing, because n
    /// rows do not determine p parameters exactly: `sqrt(1 + p/n)` (Akaike, Ann. Inst. Stat. Math. 22, 1970: the final
    /// prediction error), mean over the turns. 1 where nothing was held out.
    pub prediction_factor: f64,
    /// How much less certain each parameter is in the turn of the hold-out that says the least of it, in the order of
    /// `fit.estimates`: its standard deviation there over that of `fit`; empty where nothing was held out in turns.
    pub turn_sigma_ratio: Vec<f64>,
    /// [`Calibration::nominal_values`] as each turn of the hold-out has them.
    pub turn_nominal_values: Vec<Vec<f64>>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

impl Calibration {
    /// Whether anything was held out: then the calibration is judged by that side, else by the side it was fitted to.
    pub fn held_out(&self) -> bool {
        self.holdout.fitted.n > 0
    }

    /// The side by which the calibration is judged: [`Calibration::noise_floor_m`] is that of its points.
    pub fn judged(&self) -> &SideErrors {
        if self.held_out() { &self.holdout } else { &self.train }
    }

    /// Mean error of the judged side over the mean error that the declared noise alone would give. Infinite where no
    /// noise is declared.
    pub fn times_floor(&self) -> f64 {
        self.judged().fitted.mean_m / self.noise_floor_m
    }

    /// How many times the floor the errors are; of a hold-out that cannot learn an effect, those of the fitted side.
    pub fn left_over(&self) -> f64 {
        match self.held_out() && self.train.fitted.n > 0 {
            true => self.times_floor().min(self.train.fitted.mean_m / self.noise_floor_m),
            false => self.times_floor(),
        }
    }

    /// The residuals of the judged side.
    pub fn judged_residuals(&self) -> impl Iterator<Item = &Residual> {
        let held_out = self.held_out();
        self.residuals.iter().filter(move |r| r.held_out == held_out)
    }

    /// The same, each with what was observed; `observations` are those of the calibration, in the order of its residuals.
    pub fn judged_pairs<'a>(
        &'a self,
        observations: &'a [Observation],
    ) -> impl Iterator<Item = (&'a Residual, &'a Observation)> {
        let held_out = self.held_out();
        self.residuals.iter().zip(observations).filter(move |(r, _)| r.held_out == held_out)
    }
}
