//! A problem with other priors and bounds.

use crate::objective::problem::{Problem, Told, as_beneath};
use crate::objective::rows::Kept;
use armcal_core::Parameter;
use armcal_model::Asked;
use nalgebra::DMatrix;
use std::ops::Range;

/// A problem with other priors and bounds.
pub(crate) struct WithPriors<'a> {
    pub problem: &'a dyn Problem,
    pub parameters: Vec<Parameter>,
}

impl Problem for WithPriors<'_> {
    as_beneath!(self => self.problem);

    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn linearised_each(&self, blocks: Range<usize>, p: &[f64], asked: &Asked<'_>, each: &mut Told<'_>) {
        self.problem.linearised_each(blocks, p, asked, each);
    }

    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        self.problem.covariance(block, p)
    }

    fn straight(&self) -> Option<&Kept> {
        self.problem.straight()
    }
}
