//! The fit as linear algebra: whitened residuals and derivatives at given parameters, for whoever judges a fit.

use crate::model_problem::ModelProblem;
use crate::whitened::Whitened;
use crate::{CalibrateError, FitConfig};
use armcal_core::Observation;
use armcal_model::Model;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// A model linearised at given parameters, in units of noise and prior.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// The free parameters, one for each column.
    pub axes: Vec<LinearAxis>,
    /// Rows of each observation: 3 of position, or 6 with orientation.
    pub rows: Vec<Range<usize>>,
    /// Whitened measured - predicted: N(0, 1) rows when the model is complete and the declared noise right.
    pub residual: DVector<f64>,
    /// d residual / d x, x the parameters in units of [`LinearAxis::scale`].
    pub jacobian: DMatrix<f64>,
    /// Inverse of the lower Cholesky factor of each observation's covariance: whitened = this x raw.
    pub whitener: Vec<DMatrix<f64>>,
}

/// One free parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearAxis {
    /// Index in the model's parameter vector.
    pub index: usize,
    /// SI per unit of x: the prior's standard deviation where there is one.
    pub scale: f64,
    /// Prior precision in units of x: 1 with a prior, less where nothing is known beforehand.
    pub precision: f64,
    /// x at the given parameters: their distance from the centre of the prior.
    pub offset: f64,
}

/// Linearises all free parameters of `model` at `values` (all parameters, model order).
pub fn linearise(
    model: &Model,
    observations: &[Observation],
    values: &[f64],
    config: &FitConfig,
) -> Result<Linearisation, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    let rows = problem.rows_of_each();
    let white = Whitened::new(Box::new(problem), values, &|p| p.free, config)?;
    let at = white.at(white.start())?;
    let axis = |(a, x): (&crate::whitened::Axis, &f64)| LinearAxis {
        index: a.index,
        scale: a.scale,
        precision: a.precision,
        offset: *x,
    };
    Ok(Linearisation {
        axes: white.axes.iter().zip(at.x.iter()).map(axis).collect(),
        rows,
        jacobian: white.jacobian(&at),
        residual: at.residual,
        whitener: white.into_whitener(),
    })
}
