//! What cannot be told apart (notes 3 and 4.12, formula 10), and what the data could not have shown (4.1).

use crate::problem::projection::{Gram, Projection, gram_eigen};
use crate::problem::{Columns, Problem};
use armcal_calibrate::tails::{Z_80, Z_975};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, Normal};
use std::ops::Range;

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
    (0..a.nrows()).for_each(|k| a[(k, k)] += crate::problem::EFFECT_PRECISION * variance);
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
    let (w, _) = gram_eigen(&gram.a, gram.raw.max());
    let size = w.sum() / w.len().max(1) as f64;
    if size > 0.0 { (z + Z_80) * (variance / size).sqrt() } else { f64::INFINITY }
}

/// Half width of a 95 % interval for a standard error.
pub(crate) fn half_width(sigma: f64) -> f64 {
    Z_975 * sigma
}

/// What columns can make in the projected space: the eigenvalues and eigenvectors of their products.
#[derive(Debug, Clone)]
struct Reach(DVector<f64>, DMatrix<f64>);

impl Reach {
    /// Of columns, by their products.
    fn of(gram: &Gram) -> Reach {
        let (w, v) = gram_eigen(&gram.a, gram.raw.max());
        Reach(w, v)
    }

    /// Cosine between a signature of this squared length and the closest that these columns can make, given their products with
    /// it, both projected.
    fn cosine(&self, power: f64, cross: &DVector<f64>) -> f64 {
        if power <= 0.0 {
            return 1.0;
        }
        let Reach(w, v) = self;
        let t = v.tr_mul(cross);
        let shared: f64 = w.iter().zip(t.iter()).filter(|(w, _)| **w > 0.0).map(|(w, t)| t * t / w).sum();
        (shared / power).clamp(0.0, 1.0).sqrt()
    }
}

/// What columns make at some coefficients, geometry projected out.
pub(crate) struct Signature {
    rows: DVector<f64>,
    spent: DVector<f64>,
    /// Its squared length.
    power: f64,
}

impl Signature {
    /// Of whitened columns, whose products these are.
    pub fn new(columns: &DMatrix<f64>, gram: &Gram, theta: &DVector<f64>) -> Signature {
        let power = theta.dot(&(&gram.a * theta)).max(0.0);
        Signature { rows: columns * theta, spent: &gram.spent * theta, power }
    }

    /// Compares it with everything that other whitened columns, whose products these are, can do.
    pub fn cosine(&self, columns: &DMatrix<f64>, gram: &Gram) -> f64 {
        let cross = columns.tr_mul(&self.rows) - gram.spent.tr_mul(&self.spent);
        Reach::of(gram).cosine(self.power, &cross)
    }
}

/// Several sets of columns, and their products with each other.
#[derive(Debug, Clone)]
pub(crate) struct Crossed {
    /// The columns of each set among all.
    sets: Vec<Range<usize>>,
    /// Products of all columns.
    all: Gram,
    reach: Vec<Reach>,
}

impl Crossed {
    /// Of sets of columns, times a factor that gives them the units of the weighing.
    pub fn of(columns: &[&Columns], problem: &Problem, factor: f64, base: &Projection) -> Crossed {
        let mut stacked = DMatrix::zeros(problem.rows(), columns.iter().map(|own| own.len()).sum());
        let mut sets = Vec::with_capacity(columns.len());
        let mut at = 0;
        for own in columns {
            stacked.columns_mut(at, own.len()).copy_from(&own.dense(&problem.dwells, factor));
            sets.push(at..at + own.len());
            at += own.len();
        }
        let all = base.gram(&stacked);
        let mut crossed = Crossed { sets, all, reach: Vec::new() };
        crossed.reach = (0..columns.len()).map(|k| Reach::of(&crossed.gram(k))).collect();
        crossed
    }

    /// Products of one of them.
    fn gram(&self, k: usize) -> Gram {
        let Range { start, .. } = self.sets[k];
        let m = self.sets[k].len();
        Gram {
            a: self.all.a.view((start, start), (m, m)).into_owned(),
            g: self.all.g.rows(start, m).into_owned(),
            raw: self.all.raw.rows(start, m).into_owned(),
            spent: self.all.spent.columns(start, m).into_owned(),
        }
    }

    /// Compares `k` at coefficients `theta` with everything `l` can do.
    pub fn cosine(&self, k: usize, theta: &DVector<f64>, l: usize) -> f64 {
        let block = |l: usize| {
            self.all
                .a
                .view((self.sets[l].start, self.sets[k].start), (self.sets[l].len(), self.sets[k].len()))
        };
        let power = theta.dot(&(block(k) * theta)).max(0.0);
        self.reach[l].cosine(power, &(block(l) * theta))
    }
}
