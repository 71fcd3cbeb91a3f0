//! What cannot be told apart (notes 3 and 4.12, formula 10), and what the data could not have shown (4.1).

use crate::projection::{Gram, Projection, eigen};
use crate::special::{Z_80, Z_975};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};

/// What one candidate looks like in the projected space, before it is added.
#[derive(Debug, Clone)]
pub(crate) struct OneStep {
    /// Estimate in typical sizes.
    pub estimate: DVector<f64>,
    /// Its covariance (noise variance as given).
    pub covariance: DMatrix<f64>,
    /// Share of the squared signature that the geometry takes over.
    pub absorbed: f64,
}

/// One-step estimate `(A + P)^-1 g` with a weak prior of ten typical sizes, so that what is invisible stays at 0 with a
/// wide interval.
pub(crate) fn one_step(gram: &Gram, variance: f64) -> OneStep {
    let mut a = gram.a.clone();
    (0..a.nrows()).for_each(|k| a[(k, k)] += crate::crossval::EFFECT_PRECISION * variance);
    let n = a.nrows();
    let inverse = a.try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
    let raw: f64 = gram.raw.sum();
    let absorbed = if raw > 0.0 { (1.0 - gram.a.trace() / raw).clamp(0.0, 1.0) } else { 1.0 };
    OneStep { estimate: &inverse * &gram.g, covariance: inverse * variance, absorbed }
}

/// Smallest amplitude, in typical sizes, seen with 80 % power at family-wise 1 % among `count` candidates:
/// `sqrt(lambda*) / |G~ v|`, `lambda* = (z(1 - alpha/2K) + z(0.8))^2`, v the typical direction.
pub(crate) fn smallest_seen(gram: &Gram, variance: f64, count: usize) -> f64 {
    let z = Normal::standard().inverse_cdf(1.0 - 0.01 / (2.0 * count.max(1) as f64));
    let (w, _) = eigen(&gram.a, gram.raw.max());
    let size = w.sum() / w.len().max(1) as f64;
    if size > 0.0 { (z + Z_80) * (variance / size).sqrt() } else { f64::INFINITY }
}

/// Half width of a 95 % interval for a standard error.
pub(crate) fn half_width(sigma: f64) -> f64 {
    Z_975 * sigma
}

/// How alike two candidates are, k at its fitted size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Likeness {
    /// Cosine between k's fitted signature and the closest one the other can make.
    pub cosine: f64,
    /// `|(I - B_l B_l') G~_k theta|^2 / variance`: twice the expected log-likelihood ratio.
    pub delta: f64,
}

/// Compares `k` at coefficients `theta` with everything `l` can do, both projected.
pub(crate) fn likeness(
    projection: &Projection,
    k: &DMatrix<f64>,
    theta: &DVector<f64>,
    l: &DMatrix<f64>,
    variance: f64,
) -> Likeness {
    let signature = DMatrix::from_column_slice(k.nrows(), 1, (k * theta).as_slice());
    let power = projection.cross(&signature, &signature)[(0, 0)].max(0.0);
    let cross = projection.cross(l, &signature);
    let gram = projection.gram(l);
    let (w, v) = eigen(&gram.a, gram.raw.max());
    let t = v.tr_mul(&cross);
    let shared: f64 = w.iter().zip(t.iter()).filter(|(w, _)| **w > 0.0).map(|(w, t)| t * t / w).sum();
    if power <= 0.0 {
        return Likeness { cosine: 1.0, delta: 0.0 };
    }
    Likeness { cosine: (shared / power).clamp(0.0, 1.0).sqrt(), delta: (power - shared).max(0.0) / variance }
}
