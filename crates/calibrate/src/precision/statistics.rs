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
use crate::objective::axes::{Axis, Point};
use crate::objective::robust::RobustCost;
use crate::objective::solver::{Arrow, Curvature};
use crate::outcome::covariance::Covariance;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Posterior standard deviation, in units of the prior's, from which on the prior decides.
const PRIOR_DECIDES: f64 = 0.25;

/// More parameters than this are taken apart group by group.
const MOST_DENSE: usize = 300;

/// Uncertainty of the free parameters, in units of x.
#[derive(Debug, Clone)]
pub(crate) struct Uncertainty {
    /// Posterior covariance.
    pub covariance: Covariance,
    /// Its diagonal.
    pub variances: DVector<f64>,
    /// Half width of a 95 % interval in standard deviations.
    pub t95: f64,
    pub determined: Vec<bool>,
    /// Directions in which the data know more than the prior.
    pub rank: usize,
    /// The others.
    pub undetermined: Vec<Weak>,
}

/// Directions over some of the axes that the data do not determine.
#[derive(Debug, Clone)]
pub(crate) struct Weak {
    pub axes: Vec<usize>,
    /// Information of the data over these axes.
    pub information: DMatrix<f64>,
    /// Orthonormal, one column each.
    pub basis: DMatrix<f64>,
    /// Whether parameters of single recordings may move along.
    pub followed: bool,
}

/// Uncertainty at a solution; `squares` is J'J of the whitened Jacobian.
pub(crate) fn uncertainty(
    cost: &RobustCost<'_, '_>,
    at: &Point,
    squares: &Curvature,
    name: &dyn Fn(usize) -> String,
) -> Result<Uncertainty, CalibrateError> {
    let axes = &cost.white.axes;
    let declared = posterior_covariance(squares, axes, cost.sigma_scale.powi(2).recip(), name)?;
    let fitted = fitted_directions(&declared.variances(), axes);
    let freedom = (cost.white.rows() as f64 - fitted).max(1.0);
    let variance = residual_variance(cost, at, freedom);
    let covariance = posterior_covariance(squares, axes, variance.recip(), name)?;
    let variances = covariance.variances();
    let determined = variances.iter().map(|variance| variance.sqrt() < PRIOR_DECIDES).collect();
    let undetermined = weak_directions(squares, variance);
    let rank = axes.len() - undetermined.iter().map(|weak| weak.basis.ncols()).sum::<usize>();
    Ok(Uncertainty { covariance, variances, t95: t95(freedom), determined, rank, undetermined })
}

/// `p = tr(D C) = n - tr(P C)`.
pub(crate) fn fitted_directions(variances: &DVector<f64>, axes: &[Axis]) -> f64 {
    let prior: f64 = axes.iter().zip(variances.iter()).map(|(a, variance)| a.precision * variance).sum();
    axes.len() as f64 - prior
}

/// 97.5 % quantile of Student's t.
pub(crate) fn t95(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |t| t.inverse_cdf(0.975))
}

fn residual_variance(cost: &RobustCost<'_, '_>, at: &Point, freedom: f64) -> f64 {
    let white = cost.white;
    let (mut psi_square, mut curvature) = (0.0, 0.0);
    for (j, u) in cost.norms(at).into_iter().enumerate() {
        psi_square += (cost.loss(j).weight(u) * u).powi(2);
        curvature += cost.loss(j).mean_curvature(u, white.dimension(j)) * white.dimension(j) as f64;
    }
    let mean_curvature = curvature / white.rows() as f64;
    (cost.sigma_scale.powi(2) * psi_square / freedom / mean_curvature.powi(2)).max(1.0)
}

/// `(squares * data + P)^-1`.
pub(crate) fn posterior_covariance(
    squares: &Curvature,
    axes: &[Axis],
    data: f64,
    name: &dyn Fn(usize) -> String,
) -> Result<Covariance, CalibrateError> {
    let precision = DVector::from_iterator(axes.len(), axes.iter().map(|a| a.precision));
    squares.inverse(data, &precision).ok_or_else(|| CalibrateError::Singular {
        doing: "posterior covariance",
        worst: name(axes[(squares.diagonal() * data + precision).imin()].index),
    })
}

/// The directions that the data do not determine.
fn weak_directions(squares: &Curvature, variance: f64) -> Vec<Weak> {
    let information = match squares {
        Curvature::Dense(gram) => gram / variance,
        Curvature::Arrow(arrow) if arrow.structure().axis_count() <= MOST_DENSE => {
            arrow.dense_squares() / variance
        }
        Curvature::Arrow(arrow) => return weak_by_group(arrow, variance),
    };
    let axes = (0..information.nrows()).collect();
    let basis = split_directions(&information).1;
    vec![Weak { axes, information, basis, followed: false }]
}

/// The same where the matrix is too large to be taken apart as a whole: what single groups leave open of their own
/// parameters, then what all leave open of the shared ones.
///
/// The count of eigenvalues of D up to 1 is that of D - 1 up to 0, and that is the sum of the counts of its diagonal
/// blocks and of the Schur complement of these (Haynsworth 1968): the number of directions is that of the dense
/// matrix. The directions themselves are those of the blocks, and over the shared parameters those that become weak once
/// every group's own ones may follow.
fn weak_by_group(arrow: &Arrow, variance: f64) -> Vec<Weak> {
    let structure = arrow.structure();
    let count = structure.shared.len();
    let mut schur = -DMatrix::identity(count, count);
    let mut found = Vec::new();
    for (group, own_axes) in structure.groups.iter().map(|g| &g.own).enumerate() {
        let [own, mixed, shared] = arrow.squares(group).map(|squares| squares / variance);
        schur += shared;
        if own_axes.is_empty() {
            continue;
        }
        let eigen = own.clone().symmetric_eigen();
        let turned = eigen.eigenvectors.tr_mul(&mixed);
        for (k, value) in eigen.eigenvalues.iter().enumerate() {
            let above = value - 1.0;
            let away = if above.abs() < f64::EPSILON { -f64::EPSILON } else { above };
            schur -= turned.row(k).tr_mul(&turned.row(k)) / away;
        }
        let basis = split_directions(&own).1;
        if basis.ncols() > 0 {
            found.push(Weak { axes: own_axes.clone(), information: own, basis, followed: false });
        }
    }
    let information = schur + DMatrix::identity(count, count);
    let basis = split_directions(&information).1;
    if basis.ncols() > 0 {
        found.push(Weak { axes: structure.shared.clone(), information, basis, followed: true });
    }
    found
}

/// Splits parameter space into the directions the data determine (counted) and the others (spanned).
fn split_directions(information: &DMatrix<f64>) -> (usize, DMatrix<f64>) {
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
    fn groups_count_the_weak_directions_of_the_whole() {
        use crate::objective::solver::gram_root;
        use crate::objective::structure::{Group, Structure};
        use rand::RngExt as _;
        for seed in 0..40 {
            let mut rng = crate::tests::rig::rng(seed);
            // Four shared axes, then three groups of two, of which some directions are barely seen.
            let own = |k: usize| vec![4 + 2 * k, 5 + 2 * k];
            let group = |k: usize| Group { blocks: k..k + 1, own: own(k), columns: vec![None; 6] };
            let structure = Structure { groups: (0..3).map(group).collect(), shared: (0..4).collect() };
            let triangles = (0..3).map(|_| {
                let sizes = DVector::from_fn(6, |_, _| 10_f64.powf(rng.random_range(-2.0..2.0)));
                let rows = DMatrix::from_fn(rng.random_range(1..9), 6, |_, _| rng.random_range(-1.0..1.0));
                gram_root(rows * DMatrix::from_diagonal(&sizes))
            });
            let arrow = Arrow::new(structure.into(), triangles.collect(), DVector::zeros(10));
            let whole = split_directions(&arrow.dense_squares()).1.ncols();
            let by_group: usize = weak_by_group(&arrow, 1.0).iter().map(|weak| weak.basis.ncols()).sum();
            assert_eq!(by_group, whole, "seed {seed}");
            assert!((1..10).contains(&whole));
        }
    }

    #[test]
    fn weak_directions_are_those_below_the_prior() {
        let information = DMatrix::from_row_slice(2, 2, &[50.0, 50.0, 50.0, 50.0]);
        let (rank, weak) = split_directions(&information);
        assert_eq!((rank, weak.ncols()), (1, 1));
        assert!((weak[(0, 0)] + weak[(1, 0)]).abs() < 1e-12);
    }
}
