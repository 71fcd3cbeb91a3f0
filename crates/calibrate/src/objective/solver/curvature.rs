//! The matrix of a quadratic model: dense, or in the shape of an arrow where groups have unknowns of their own.

use super::arrow::Arrow;
use super::blocked::{cholesky, inverse};
use crate::outcome::covariance::Covariance;
use nalgebra::{DMatrix, DVector};

/// A symmetric positive semidefinite matrix that can be solved with.
#[derive(Debug, Clone)]
pub(crate) enum Curvature {
    Dense(DMatrix<f64>),
    Arrow(Arrow),
}

impl Curvature {
    /// `H + diag(by)`.
    pub fn damped(&self, by: &DVector<f64>) -> Curvature {
        match self {
            Curvature::Dense(h) => Curvature::Dense(h + DMatrix::from_diagonal(by)),
            Curvature::Arrow(arrow) => Curvature::Arrow(arrow.damped(by)),
        }
    }

    /// `H d`.
    pub fn times(&self, d: &DVector<f64>) -> DVector<f64> {
        match self {
            Curvature::Dense(h) => h * d,
            Curvature::Arrow(arrow) => arrow.times(d),
        }
    }

    /// `H d = right` over the unknowns that are not held, the others zero; `None` where H is not positive definite.
    pub fn solve_free(&self, right: &DVector<f64>, held: &[bool]) -> Option<DVector<f64>> {
        let Curvature::Dense(h) = self else { return self.arrow()?.solve_free(right, held) };
        let free: Vec<usize> = (0..right.len()).filter(|&i| !held[i]).collect();
        let block = DMatrix::from_fn(free.len(), free.len(), |r, c| h[(free[r], free[c])]);
        let solution = cholesky(block)?.solve(&DVector::from_fn(free.len(), |r, _| right[free[r]]));
        let mut all = DVector::zeros(right.len());
        free.iter().zip(solution.iter()).for_each(|(&i, value)| all[i] = *value);
        Some(all)
    }

    /// `(data H + diag(by))^-1`; `None` where that is not positive definite. (Of an arrow, only the squares of its rows
    /// are multiplied, not a diagonal it was damped by.)
    pub fn inverse(&self, data: f64, by: &DVector<f64>) -> Option<Covariance> {
        match self {
            Curvature::Dense(h) => {
                let mut sum = h * data;
                (0..by.len()).for_each(|k| sum[(k, k)] += by[k]);
                Some(inverse(&cholesky(sum)?)?.into())
            }
            Curvature::Arrow(arrow) => arrow.damped(by).inverse(data),
        }
    }

    /// The arrow, if it is one.
    pub fn arrow(&self) -> Option<&Arrow> {
        match self {
            Curvature::Dense(_) => None,
            Curvature::Arrow(arrow) => Some(arrow),
        }
    }

    /// Diagonal of the data's squares.
    pub fn diagonal(&self) -> DVector<f64> {
        match self {
            Curvature::Dense(h) => h.diagonal(),
            Curvature::Arrow(arrow) => arrow.square_diagonal(),
        }
    }
}
