//! What a solver needs to know about a calibration, and nothing about robots: blocks of residual rows (one block an
//! observation), their exact derivatives, their covariance, and the parameters.

use armcal_core::Parameter;
use nalgebra::{DMatrix, DVector};

/// A weighted nonlinear least-squares problem in blocks.
///
/// Row order within a block: three position rows [m], then, where used, three orientation rows [rad].
pub trait Problem {
    /// All parameters, fixed ones included, in the order of every parameter vector.
    fn parameters(&self) -> &[Parameter];
    /// Number of observations.
    fn blocks(&self) -> usize;
    /// The observation in words, for messages.
    fn name(&self, block: usize) -> String;
    /// Joint readings of the observation [rad], for messages; empty when there are none.
    fn joint_rad(&self, _block: usize) -> &[f64] {
        &[]
    }
    /// Measured minus predicted at parameters `p`.
    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64>;
    /// The same with its derivative, one column per parameter (fixed ones may be zero).
    fn linearised(&self, block: usize, p: &[f64]) -> (DVector<f64>, DMatrix<f64>);
    /// Covariance of the rows of a block at parameters `p`: measurement and propagated encoder noise.
    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64>;
}

impl<P: Problem + ?Sized> Problem for &P {
    fn parameters(&self) -> &[Parameter] {
        (**self).parameters()
    }

    fn blocks(&self) -> usize {
        (**self).blocks()
    }

    fn name(&self, block: usize) -> String {
        (**self).name(block)
    }

    fn joint_rad(&self, block: usize) -> &[f64] {
        (**self).joint_rad(block)
    }

    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        (**self).residual(block, p)
    }

    fn linearised(&self, block: usize, p: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        (**self).linearised(block, p)
    }

    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        (**self).covariance(block, p)
    }
}
