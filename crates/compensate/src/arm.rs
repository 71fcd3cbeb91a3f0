//! A model with its parameters, asked about a target.

use crate::Past;
use armcal_core::Observation;
use armcal_model::{Model, ModelResidual};
use nalgebra::DMatrix;

/// A model and its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm<'a> {
    /// The model.
    pub model: &'a Model,
    /// A value for each of its parameters.
    pub values: Vec<f64>,
}

impl Arm<'_> {
    pub(crate) fn linearised(
        &self,
        target: &Observation,
        past: &Past,
        q: &[f64],
    ) -> (ModelResidual, DMatrix<f64>) {
        self.model.residual_with_joint_jacobian(&self.values, &observation_at(target, past, q))
    }

    /// What is left to the target after this past: distance [m] and rotation [rad].
    pub(crate) fn left(&self, target: &Observation, past: &Past, q: &[f64]) -> (f64, f64) {
        let residual = self.model.residual(&self.values, &observation_at(target, past, q));
        (residual.position_m.norm(), residual.rotation_rad.map_or(0.0, |r| r.norm()))
    }
}

/// The target with readings and their past.
pub(crate) fn observation_at(target: &Observation, past: &Past, q: &[f64]) -> Observation {
    let mut o = target.clone();
    past.clone().into_observation(q, &mut o);
    o
}
