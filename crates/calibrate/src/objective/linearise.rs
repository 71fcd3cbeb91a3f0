//! The fit as linear algebra: whitened residuals and derivatives at given parameters, for whoever judges a fit.

use crate::objective::axes::{Axis, Point};
use crate::objective::model_problem::ModelProblem;
use crate::objective::whitened::Whitened;
use crate::{CalibrateError, FitConfig, Objective};
use armcal_core::{Observation, Parameter};
use armcal_model::Model;
use nalgebra::{DMatrix, DVector, Matrix3xX};
use std::collections::BTreeSet;
use std::ops::Range;

/// A model linearised at given parameters, in units of noise and prior.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// The free parameters, one for each column.
    pub axes: Vec<LinearAxis>,
    /// Rows of each observation: 3 of position, or 6 with orientation.
    pub rows: Vec<Range<usize>>,
    /// What the raw rows of each observation are in the world: 3 x its rows, times them a displacement [m].
    pub to_metres: Vec<Matrix3xX<f64>>,
    /// The observations by pose: what was measured in one dwell shares its noise.
    pub poses: Vec<LinearPose>,
    /// Whitened measured - predicted: N(0, 1) rows when the model is complete and the declared noise right.
    pub residual: DVector<f64>,
    /// d residual / d x, x the parameters in units of [`LinearAxis::scale`].
    pub jacobian: DMatrix<f64>,
}

/// What was measured of one pose.
#[derive(Debug, Clone)]
pub struct LinearPose {
    /// Its observations: one, or one of each feature that was seen.
    pub observations: Range<usize>,
    /// Their rows.
    pub rows: Range<usize>,
    /// Inverse of the lower Cholesky factor of the rows' covariance: whitened = this x raw.
    pub whitener: DMatrix<f64>,
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
    // Whatever was minimised, rows of one pose share the noise of its readings.
    let config = &FitConfig { objective: Objective::Robust, ..config.clone() };
    let problem = ModelProblem::new(model, observations, config)?;
    let rows = problem.rows_of_each();
    let to_metres = (0..observations.len()).map(|i| problem.to_metres(i, values)).collect();
    let runs = problem.runs().to_vec();
    let white = Whitened::new(Box::new(problem), values, &|p| p.free, config)?;
    let at = white.at(white.start())?;
    let pose = |(observations, whitener): (Range<usize>, DMatrix<f64>)| {
        let rows = rows[observations.start].start..rows[observations.end - 1].end;
        LinearPose { observations, rows, whitener }
    };
    Ok(Linearisation {
        axes: axes(&white, &at),
        to_metres,
        jacobian: white.jacobian(&at),
        residual: at.residual,
        poses: runs.into_iter().zip(white.into_whitener()).map(pose).collect(),
        rows,
    })
}

fn axes(white: &Whitened<'_>, at: &Point) -> Vec<LinearAxis> {
    let axis = |(a, x): (&Axis, &f64)| LinearAxis {
        index: a.index,
        scale: a.scale,
        precision: a.precision,
        offset: *x,
    };
    white.axes.iter().zip(at.x.iter()).map(axis).collect()
}

/// Of a model that is longer than one that was linearised on the same observations, at the same values and in the same noise:
/// the free parameters behind the first `known`, and the derivatives by them.
pub fn linearise_more(
    shorter: &Linearisation,
    model: &Model,
    observations: &[Observation],
    (values, known): (&[f64], usize),
    config: &FitConfig,
) -> Result<(Vec<LinearAxis>, DMatrix<f64>), CalibrateError> {
    let config = &FitConfig { objective: Objective::Robust, ..config.clone() };
    let more: BTreeSet<&str> =
        model.parameters()[known..].iter().filter(|p| p.free).map(|p| p.name.as_str()).collect();
    if more.is_empty() {
        return Ok((Vec::new(), DMatrix::zeros(shorter.residual.len(), 0)));
    }
    let problem = ModelProblem::new(model, observations, config)?;
    let whitener = shorter.poses.iter().map(|pose| pose.whitener.clone()).collect();
    let free = |p: &Parameter| more.contains(p.name.as_str());
    let white = Whitened::in_noise(Box::new(problem), values, &free, whitener, config)?;
    let at = white.at(white.start())?;
    Ok((axes(&white, &at), white.jacobian(&at)))
}
