//! Evidence of a term with a physical amplitude prior, noise variance marginalised (notes 4.6, formula 8).

use crate::config::DiagnosisConfig;
use crate::grams::each_gram;
use crate::noise::Noise;
use crate::problem::{Columns, Problem};
use crate::projection::{Gram, Projection, cholesky_upper, eigen};
use crate::special::ln_sum_exp;
use crate::whitener::Whitener;
use nalgebra::{DMatrix, DVector};

/// Above this many columns a factor for each amplitude is cheaper than one eigen-decomposition.
const EIGEN_COLUMNS: usize = 12;

/// What columns promise to explain, before they are weighed in full: from `[x_k' r, |x_k|^2]` of each column and the
/// residual, both whitened, `sum_k (x_k' r)^2 / (1 + |x_k|^2)`, the fall of the squared residual if they were independent
/// and the geometry took nothing of them over.
pub(crate) fn promise(columns: impl Iterator<Item = [f64; 2]>) -> f64 {
    columns.map(|[with_residual, square]| with_residual.powi(2) / (1.0 + square)).sum()
}

/// The problem under one alternative of the noise.
#[derive(Debug, Clone)]
pub(crate) struct Metric {
    /// Which noise.
    pub noise: Noise,
    /// Whitening by it.
    pub whitener: Whitener,
    /// Geometry projected out.
    pub projection: Projection,
    /// ln of prior x evidence, relative to the white alternative.
    pub ln_weight: f64,
}

impl Metric {
    /// Products of columns (declared-noise whitened) under this noise.
    pub fn gram(&self, columns: &DMatrix<f64>) -> Gram {
        let mut white = columns.clone();
        self.whitener.apply(&mut white);
        self.projection.gram(&white)
    }

    /// Columns whitened by this noise, not projected.
    pub fn whitened(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        self.whitener.apply(&mut columns);
        columns
    }

    /// ln Bayes factor of a term against its absence under this noise.
    pub fn ln_bayes(&self, gram: &Gram, config: &DiagnosisConfig) -> f64 {
        ln_bayes(gram, self.projection.rss, self.projection.dof(), config)
    }
}

impl Metric {
    pub(crate) fn new(noise: Noise, amplitude: f64, problem: &Problem, scale: f64) -> Metric {
        let whitener = Whitener::new(noise, amplitude, problem);
        let mut residual = DMatrix::from_column_slice(problem.rows(), 1, problem.residual.as_slice());
        let mut geometry = problem.geometry.clone();
        whitener.apply(&mut residual);
        whitener.apply(&mut geometry);
        let (precision, offset) = (&problem.geometry_precision, &problem.geometry_offset);
        let projection = Projection::new(geometry / scale, precision, offset, residual.column(0) / scale);
        Metric { noise, whitener, projection, ln_weight: 0.0 }
    }

    /// ln of its prior times the evidence of nothing in it, against white noise.
    pub(crate) fn weighed(self, prior: f64, white: Option<&Metric>, config: &DiagnosisConfig) -> Metric {
        let p = &self.projection;
        let white = white.map_or(p, |m| &m.projection);
        let ln_weight = ln_weight(prior, [self.whitener.ln_det, p.ln_det, p.rss], white, config);
        Metric { ln_weight, ..self }
    }
}

/// ln of the prior of a noise times the evidence of nothing in it, against white noise: from ln of the determinants of its
/// covariance and of what the geometry's freedom costs in it, and the squared residual that it leaves.
pub(crate) fn ln_weight(
    prior: f64,
    [noise_ln_det, geometry_ln_det, rss]: [f64; 3],
    white: &Projection,
    config: &DiagnosisConfig,
) -> f64 {
    let nu = config.noise_prior_dof;
    prior.ln()
        - 0.5 * (noise_ln_det + geometry_ln_det - white.ln_det)
        - 0.5 * (nu + white.dof()) * ((nu + rss) / (nu + white.rss)).ln()
}

/// `ln mean_a B(a)` with
/// `ln B(a) = -1/2 ln det(I + a^2 A) - (nu0 + nu)/2 ln[(nu0 + RSS(a)) / (nu0 + RSS)]`,
/// `RSS(a) = RSS - g'(A + a^-2 I)^-1 g`.
pub(crate) fn ln_bayes(gram: &Gram, rss: f64, dof: f64, config: &DiagnosisConfig) -> f64 {
    let scales = &config.amplitude_scales;
    let parts = penalised(gram, scales)
        .into_iter()
        .map(|(ln_det, drop)| one_amplitude(ln_det, drop, rss, dof, config));
    ln_sum_exp(parts) - (scales.len() as f64).ln()
}

/// The amplitude with the largest evidence.
pub(crate) fn best_amplitude(gram: &Gram, rss: f64, dof: f64, config: &DiagnosisConfig) -> f64 {
    let scales = &config.amplitude_scales;
    let parts = penalised(gram, scales)
        .into_iter()
        .map(|(ln_det, drop)| one_amplitude(ln_det, drop, rss, dof, config));
    let best = parts.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i);
    scales.get(best).copied().unwrap_or(1.0)
}

fn one_amplitude(ln_det: f64, drop: f64, rss: f64, dof: f64, config: &DiagnosisConfig) -> f64 {
    let nu0 = config.noise_prior_dof;
    let left = (rss - drop).max(1e-9 * rss);
    -0.5 * ln_det - 0.5 * (nu0 + dof) * ((nu0 + left) / (nu0 + rss)).ln()
}

/// For each amplitude: `ln det(I + a^2 A)` and `g'(A + a^-2 I)^-1 g`.
fn penalised(gram: &Gram, scales: &[f64]) -> Vec<(f64, f64)> {
    let m = gram.g.len();
    if m <= EIGEN_COLUMNS {
        let (w, v) = eigen(&gram.a, gram.raw.max());
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

/// ln (weight x Bayes factor) of every term in every metric. `result[term][metric]`.
pub(crate) fn over_noise(
    terms: &[&Columns],
    problem: &Problem,
    scale: f64,
    metrics: &[Metric],
    config: &DiagnosisConfig,
) -> Vec<Vec<f64>> {
    let mut result = vec![vec![0.0; metrics.len()]; terms.len()];
    for (k, metric) in metrics.iter().enumerate() {
        each_gram(terms, problem, 1.0 / scale, metric, &mut |term, gram| {
            result[term][k] = metric.ln_weight + metric.ln_bayes(gram, config);
        });
    }
    result
}

/// Posterior mean and covariance (noise variance 1) of a term's coefficients at amplitude `a`.
pub(crate) fn coefficients(gram: &Gram, a: f64) -> (DVector<f64>, DMatrix<f64>) {
    let mut m = gram.a.clone();
    (0..m.nrows()).for_each(|k| m[(k, k)] += 1.0 / (a * a));
    let factor = cholesky_upper(m);
    let n = factor.nrows();
    let inverse =
        factor.solve_upper_triangular(&DMatrix::identity(n, n)).unwrap_or_else(|| DMatrix::identity(n, n));
    let covariance = &inverse * inverse.transpose();
    (&covariance * &gram.g, covariance)
}
