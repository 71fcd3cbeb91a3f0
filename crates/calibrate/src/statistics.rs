//! What the data say about the parameters once the fit has converged.
//!
//! With J the whitened Jacobian in units of the prior and k^2 the variance of one whitened residual,
//!
//! | | |
//! |---|---|
//! | information of the data | `D = J'J / k^2` |
//! | posterior covariance | `C = (D + P)^-1`, P the prior precision |
//! | residual variance | `k^2 = max(1, s^2 [sum |psi|^2 / (N - p)] / [mean psi']^2)` (Huber 1981, section 7.6) |
//! | fitted directions | `p = tr(D (D + P)^-1)` |
//!
//! k^2 scales the *data* only: a prior does not become vaguer because the model fits badly, so a direction that
//! nothing determines keeps its prior's width. k^2 is never below 1: residuals larger than declared prove that noise or
//! model is worse than declared; smaller ones may as well come from errors shared between dwells (a cavity visited
//! twice), so they do not earn narrower intervals. Intervals use Student's t with N - p degrees of freedom.
//!
//! A parameter is **determined** when its posterior standard deviation is less than a quarter of what the prior left open
//! (of 20 mm or 4 deg for a frame about which nothing was known). Its interval is honest about its partners all the
//! same: the zero of joint 1 is as wide as the yaw of a measured base leaves it.

use crate::CalibrateError;
use crate::products::inner;
use crate::robust::RobustCost;
use crate::whitened::Axis;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Posterior standard deviation, in units of the prior's, from which on the prior decides.
const PRIOR_DECIDES: f64 = 0.25;

/// Uncertainty of the free parameters, in units of x.
#[derive(Debug, Clone)]
pub(crate) struct Uncertainty {
    /// Posterior covariance.
    pub covariance: DMatrix<f64>,
    /// Information of the data.
    pub information: DMatrix<f64>,
    /// Half width of a 95 % interval in standard deviations.
    pub t95: f64,
    pub determined: Vec<bool>,
    /// Directions in which the data know more than the prior.
    pub rank: usize,
    /// Orthonormal basis of the others, one column each.
    pub undetermined: DMatrix<f64>,
}

/// Uncertainty at a solution with whitened residual and Jacobian.
pub(crate) fn uncertainty(
    cost: &RobustCost<'_, '_>,
    residual: &DVector<f64>,
    jacobian: &DMatrix<f64>,
    name: &dyn Fn(usize) -> String,
) -> Result<Uncertainty, CalibrateError> {
    let axes = &cost.white.axes;
    let gram = inner(jacobian, jacobian);
    let declared = posterior(&gram, axes, cost.sigma_scale.powi(2).recip(), name)?;
    let fitted = fitted_directions(&declared, axes);
    let freedom = (cost.white.rows() as f64 - fitted).max(1.0);
    let variance = residual_variance(cost, residual, freedom);
    let covariance = posterior(&gram, axes, variance.recip(), name)?;
    let determined = (0..axes.len()).map(|k| covariance[(k, k)].sqrt() < PRIOR_DECIDES).collect();
    let information = gram / variance;
    let (rank, undetermined) = split(&information);
    Ok(Uncertainty { covariance, information, t95: t95(freedom), determined, rank, undetermined })
}

/// `p = tr(D C) = n - tr(P C)`.
pub(crate) fn fitted_directions(covariance: &DMatrix<f64>, axes: &[Axis]) -> f64 {
    let prior: f64 = axes.iter().enumerate().map(|(k, a)| a.precision * covariance[(k, k)]).sum();
    axes.len() as f64 - prior
}

/// 97.5 % quantile of Student's t.
pub(crate) fn t95(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
}

fn residual_variance(cost: &RobustCost<'_, '_>, residual: &DVector<f64>, freedom: f64) -> f64 {
    let white = cost.white;
    let (mut psi_square, mut curvature) = (0.0, 0.0);
    for (j, u) in cost.norms(residual).into_iter().enumerate() {
        psi_square += (cost.loss(j).weight(u) * u).powi(2);
        curvature += cost.loss(j).mean_curvature(u, white.dimension(j)) * white.dimension(j) as f64;
    }
    let mean_curvature = curvature / white.rows() as f64;
    (cost.sigma_scale.powi(2) * psi_square / freedom / mean_curvature.powi(2)).max(1.0)
}

/// `(gram * data + P)^-1`.
fn posterior(
    gram: &DMatrix<f64>,
    axes: &[Axis],
    data: f64,
    name: &dyn Fn(usize) -> String,
) -> Result<DMatrix<f64>, CalibrateError> {
    let mut hessian = gram * data;
    for (k, a) in axes.iter().enumerate() {
        hessian[(k, k)] += a.precision;
    }
    let diagonal = hessian.diagonal();
    hessian.cholesky().map(|c| c.inverse()).ok_or_else(|| CalibrateError::Singular {
        doing: "posterior covariance",
        worst: name(axes[diagonal.imin()].index),
    })
}

/// Splits parameter space into the directions the data determine (counted) and the others (spanned).
fn split(information: &DMatrix<f64>) -> (usize, DMatrix<f64>) {
    let eigen = information.clone().symmetric_eigen();
    let mut weak: Vec<usize> =
        (0..eigen.eigenvalues.len()).filter(|&i| eigen.eigenvalues[i] <= 1.0).collect();
    weak.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let basis = DMatrix::from_fn(information.nrows(), weak.len(), |r, c| eigen.eigenvectors[(r, weak[c])]);
    (information.nrows() - weak.len(), basis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_quantiles_match_the_table() {
        // scipy.stats.t.ppf(0.975, [1, 10, 500]) = 12.7062047, 2.2281389, 1.9647198
        for (freedom, expected) in [(1.0, 12.706_204_7), (10.0, 2.228_138_9), (500.0, 1.964_719_8)] {
            assert!((t95(freedom) - expected).abs() < 1e-6, "{freedom}: {}", t95(freedom));
        }
    }

    #[test]
    fn weak_directions_are_those_below_the_prior() {
        let information = DMatrix::from_row_slice(2, 2, &[50.0, 50.0, 50.0, 50.0]);
        let (rank, weak) = split(&information);
        assert_eq!((rank, weak.ncols()), (1, 1));
        assert!((weak[(0, 0)] + weak[(1, 0)]).abs() < 1e-12);
    }
}
