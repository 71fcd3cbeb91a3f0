//! Minimisation of a smooth cost within bounds. One solver for both shapes of problem: `curvature` is a dense matrix,
//! or an arrow (`arrow`) where recordings have parameters of their own.
//!
//! **Why not `basin` (3.2.0), which notes/dependencies.md chose.** It was tried as planned and stays as the oracle of
//! this crate's tests (`tests/solvers.rs`), but is not the product's solver, for three reasons. (1) Its loss is per
//! scalar residual; a loss per 3-vector needs an outer reweighting loop, and every outer round pays for fresh
//! Jacobians, which are most of the cost of a fit. (2) Both its bounded methods are interior: they approach a bound but
//! never reach it, so "at its bound" would need a tolerance. (3) On 198 observations of the paper's arm with one active
//! bound, same run, release: this module 10 ms including the search for the scale; basin, given the scale, 1.5 s by the
//! trust-region-reflective method (a Jacobi SVD of the tall Jacobian at every iteration; same minimum to 1e-9) and 42
//! ms by the bounded LM, which stopped 2.6e-3 above the minimum.

mod arrow;
mod blocked;
mod bounded_qp;
mod curvature;
mod levenberg;

pub(crate) use arrow::{Arrow, gram_root, is_tall, root_of};
pub(crate) use curvature::Curvature;
pub(crate) use levenberg::{Settings, Solution, minimise};

use crate::CalibrateError;
use crate::objective::axes::Point;
use nalgebra::DVector;

/// A cost with its second-order model.
pub(crate) trait Cost {
    /// What is known at x: evaluated once, whatever is asked of it.
    fn at(&self, x: DVector<f64>) -> Result<Point, CalibrateError>;
    /// Whether a last, negligible step may be taken as [`Cost::moved`] has it.
    fn ends_straight(&self) -> bool;
    /// A point moved to x along its linearisation.
    fn moved(&self, at: Point, x: DVector<f64>) -> Point;
    /// Value there.
    fn value(&self, at: &Point) -> f64;
    /// Value, gradient and a positive semidefinite approximation of the Hessian there.
    fn model(&self, at: &Point) -> Quadratic;
    /// Lower bound of every x.
    fn lower(&self) -> DVector<f64>;
    /// Upper bound of every x.
    fn upper(&self) -> DVector<f64>;
}

/// Second-order model of a cost at a point.
#[derive(Debug, Clone)]
pub(crate) struct Quadratic {
    pub value: f64,
    pub gradient: DVector<f64>,
    pub hessian: Curvature,
    /// Positive diagonal by which Levenberg's damping is scaled.
    pub damping: DVector<f64>,
}
