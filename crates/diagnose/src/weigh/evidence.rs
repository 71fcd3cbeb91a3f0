//! Evidence of a term with a physical amplitude prior, noise variance marginalised (notes 4.6, formula 8).

use crate::config::DiagnosisConfig;
use crate::problem::grams::each_gram;
use crate::problem::projection::{Gram, Projection, cholesky_upper, gram_eigen};
use crate::problem::{Columns, Problem};
use armcal_calibrate::tails::ln_sum_exp;
use nalgebra::{DMatrix, DVector};

/// Above this many columns a factor for each amplitude is cheaper than one eigen-decomposition.
const EIGEN_COLUMNS: usize = 12;

/// What columns promise to explain, before they are weighed in full: from `[x_k' r, |x_k|^2]` of each column and the
/// residual, both whitened, `sum_k (x_k' r)^2 / (1 + |x_k|^2)`, the fall of the squared residual if they were independent
/// and the geometry took nothing of them over.
pub(crate) fn screening_score(columns: impl Iterator<Item = [f64; 2]>) -> f64 {
    columns.map(|[with_residual, square]| with_residual.powi(2) / (1.0 + square)).sum()
}

/// A problem whose residual noise is `scale` times the declared one, its geometry projected out.
pub(crate) fn project_out_geometry(problem: &Problem, scale: f64) -> Projection {
    let (precision, offset) = (&problem.geometry_precision, &problem.geometry_offset);
    Projection::new(&problem.geometry / scale, precision, offset, &problem.residual / scale)
}

/// ln Bayes factor of a term against its absence: `ln mean_a B(a)` with
/// `ln B(a) = -1/2 ln det(I + a^2 A) - (nu0 + nu)/2 ln[(nu0 + RSS(a)) / (nu0 + RSS)]`,
/// `RSS(a) = RSS - g'(A + a^-2 I)^-1 g`.
pub(crate) fn ln_bayes(gram: &Gram, base: &Projection, config: &DiagnosisConfig) -> f64 {
    let of_each = of_amplitudes(gram, base, config);
    let count = of_each.len() as f64;
    ln_sum_exp(of_each) - count.ln()
}

/// The amplitude with the largest evidence.
pub(crate) fn best_amplitude(gram: &Gram, base: &Projection, config: &DiagnosisConfig) -> f64 {
    let of_each = of_amplitudes(gram, base, config);
    let best = of_each.into_iter().zip(&config.amplitude_scales).max_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or(1.0, |(_, amplitude)| *amplitude)
}

/// `ln B(a)` of every amplitude.
fn of_amplitudes(gram: &Gram, base: &Projection, config: &DiagnosisConfig) -> Vec<f64> {
    let (nu0, dof, rss) = (config.noise_prior_dof, base.dof(), base.rss);
    let of = |(ln_det, drop): (f64, f64)| {
        let left = (rss - drop).max(1e-9 * rss);
        -0.5 * ln_det - 0.5 * (nu0 + dof) * ((nu0 + left) / (nu0 + rss)).ln()
    };
    ln_det_and_drop(gram, &config.amplitude_scales).into_iter().map(of).collect()
}

/// For each amplitude: `ln det(I + a^2 A)` and `g'(A + a^-2 I)^-1 g`.
fn ln_det_and_drop(gram: &Gram, scales: &[f64]) -> Vec<(f64, f64)> {
    let m = gram.g.len();
    if m <= EIGEN_COLUMNS {
        let (w, v) = gram_eigen(&gram.a, gram.raw.max());
        let t = v.tr_mul(&gram.g);
        let at = |a: &f64| {
            let ln_det = w.iter().map(|w| (1.0 + a * a * w).ln()).sum();
            let drop = w
                .iter()
                .zip(t.iter())
                .filter(|(w, _)| **w > 0.0)
                .map(|(w, t)| t * t / (w + 1.0 / (a * a)))
                .sum();
            (ln_det, drop)
        };
        return scales.iter().map(at).collect();
    }
    let at = |a: &f64| {
        let mut m = gram.a.clone();
        (0..m.nrows()).for_each(|k| m[(k, k)] += 1.0 / (a * a));
        let factor = cholesky_upper(m);
        let ln_det: f64 = 2.0 * factor.diagonal().iter().map(|v| v.ln()).sum::<f64>()
            + factor.nrows() as f64 * (a * a).ln();
        let solved = factor.tr_solve_upper_triangular(&gram.g).unwrap_or_else(|| gram.g.clone());
        (ln_det, solved.norm_squared())
    };
    scales.iter().map(at).collect()
}

/// The [`ln_bayes`] of every term.
pub(crate) fn of_all(
    terms: &[&Columns],
    problem: &Problem,
    scale: f64,
    base: &Projection,
    config: &DiagnosisConfig,
) -> Vec<f64> {
    let mut result = vec![0.0; terms.len()];
    each_gram(terms, problem, 1.0 / scale, base, &mut |k, gram| result[k] = ln_bayes(gram, base, config));
    result
}

/// Posterior mean and covariance (noise variance 1) of a term's coefficients at amplitude `a`.
pub(crate) fn posterior_coefficients(gram: &Gram, a: f64) -> (DVector<f64>, DMatrix<f64>) {
    let mut m = gram.a.clone();
    (0..m.nrows()).for_each(|k| m[(k, k)] += 1.0 / (a * a));
    let factor = cholesky_upper(m);
    let n = factor.nrows();
    let inverse =
        factor.solve_upper_triangular(&DMatrix::identity(n, n)).unwrap_or_else(|| DMatrix::identity(n, n));
    let covariance = &inverse * inverse.transpose();
    (&covariance * &gram.g, covariance)
}
