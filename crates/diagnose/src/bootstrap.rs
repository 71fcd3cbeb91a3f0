//! The gate: a wild cluster bootstrap with the maximum over all candidates and scans (notes 4.5).
//!
//! ```text
//! e*_g = w_g (I - H_gg)^(-1/2) e~_g,  w_g = +-1,   T_k = -ln p(F_k),   p_adj = (1 + #{max T* >= T_k}) / (B + 1)
//! ```
//!
//! (Djogbenou, MacKinnon, Nielsen, QED 1383; Westfall and Young 1993.) With `c_kg = B_k,g' (I - H_gg)^(-1/2) e~_g`
//! for an orthonormal basis `B_k` of the projected candidate, all scores of all resamplings are one matrix product
//! `C W`. The sign flips come from a counter-based generator, one stream a dataset, so threads do not matter.

use crate::config::DiagnosisConfig;
use crate::projection::{Projection, eigen};
use crate::special::ln_f_tail;
use armcal_calibrate::gram;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Candidates whose scores are drawn in one product.
const BLOCK: usize = 128;

/// One candidate in the projected space.
#[derive(Debug, Clone)]
pub(crate) struct Direction {
    /// Orthonormal columns: data rows of `G~ A^(-1/2)`.
    pub basis: DMatrix<f64>,
    /// Score `S = |A^(-1/2) G~'e~|^2` (formula 6).
    pub score: f64,
}

impl Direction {
    /// From columns as the data have them.
    pub fn new(projection: &Projection, columns: &DMatrix<f64>) -> Direction {
        let gram = projection.gram(columns);
        let (w, v) = eigen(&gram.a, gram.raw.max());
        let keep: Vec<usize> = (0..w.len()).filter(|k| w[*k] > 0.0).collect();
        let mut root = DMatrix::zeros(v.nrows(), keep.len());
        for (c, k) in keep.iter().enumerate() {
            root.set_column(c, &(v.column(*k) / w[*k].sqrt()));
        }
        let score = root.tr_mul(&gram.g).norm_squared();
        Direction { basis: projection.project(columns) * root, score }
    }

    /// Rank.
    pub fn rank(&self) -> usize {
        self.basis.ncols()
    }
}

/// Result for each candidate, in the order given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Significance {
    /// Score `S`.
    pub score: f64,
    /// `-ln p` of its F statistic, not adjusted.
    pub surprise: f64,
    /// Bootstrap p-value of this candidate alone.
    pub p_raw: f64,
    /// Bootstrap p-value against the best of all candidates.
    pub p_adjusted: f64,
}

/// `-ln p` of the F test that a score `s` of rank `m` is noise.
fn surprise(s: f64, m: f64, rss: f64, dof: f64) -> f64 {
    let left = (rss - s).max(1e-12 * rss) / (dof - m).max(1.0);
    -ln_f_tail(s / m / left, m, (dof - m).max(1.0))
}

/// Bootstraps all candidates together. `clusters` names the rows of each cluster.
pub(crate) fn wild_cluster(
    projection: &Projection,
    candidates: &[Direction],
    clusters: &[Vec<usize>],
    config: &DiagnosisConfig,
) -> Vec<Significance> {
    let (rss, dof) = (projection.rss, projection.dof());
    let residual = projection.projected_residual();
    let ranks: Vec<usize> = candidates.iter().map(Direction::rank).collect();
    let scores: Vec<f64> = candidates.iter().map(|c| c.score).collect();
    let observed: Vec<f64> = scores
        .iter()
        .zip(&ranks)
        .map(|(s, m)| if *m == 0 { 0.0 } else { surprise(*s, *m as f64, rss, dof) })
        .collect();
    let corrected: Vec<DVector<f64>> =
        clusters.iter().map(|rows| inflated(projection, &residual, rows)).collect();
    let power = DMatrix::from_fn(1, clusters.len(), |_, g| corrected[g].norm_squared());
    let signs = signs(clusters.len(), config);
    let spent = contributions(&projection.q, clusters, &corrected) * &signs;
    let total = power * signs.map(|w| w * w);
    let left: Vec<f64> =
        spent.column_iter().zip(total.iter()).map(|(c, t)| (t - c.norm_squared()).max(1e-12)).collect();

    let mut exceed = vec![0usize; candidates.len()];
    // Largest score over candidates of the same rank is enough for the maximum of T.
    let mut top: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    let present: Vec<usize> = (0..candidates.len()).filter(|k| ranks[*k] > 0).collect();
    // Many small products are one large one.
    for block in present.chunks(BLOCK) {
        let width = block.iter().map(|k| ranks[*k]).sum();
        let mut stacked = DMatrix::zeros(residual.len(), width);
        let mut at = 0;
        for k in block {
            stacked.columns_mut(at, ranks[*k]).copy_from(&candidates[*k].basis);
            at += ranks[*k];
        }
        let drawn = contributions(&stacked, clusters, &corrected) * &signs;
        let mut at = 0;
        for &k in block {
            let best = top.entry(ranks[k]).or_insert_with(|| vec![0.0; config.resamplings]);
            let share = scores[k] / rss;
            for b in 0..config.resamplings {
                let square: f64 = (at..at + ranks[k]).map(|r| drawn[(r, b)] * drawn[(r, b)]).sum();
                let drawn_share = square / left[b];
                exceed[k] += usize::from(drawn_share >= share);
                best[b] = best[b].max(drawn_share);
            }
            at += ranks[k];
        }
    }
    let maximum: Vec<f64> = (0..config.resamplings)
        .map(|b| top.iter().map(|(m, best)| surprise(best[b], *m as f64, 1.0, dof)).fold(0.0, f64::max))
        .collect();
    let p = |count: usize| (1.0 + count as f64) / (config.resamplings as f64 + 1.0);
    (0..candidates.len())
        .map(|k| {
            let above = maximum.iter().filter(|t| **t >= observed[k]).count();
            let (p_raw, p_adjusted) = if ranks[k] == 0 { (1.0, 1.0) } else { (p(exceed[k]), p(above)) };
            Significance { score: scores[k], surprise: observed[k], p_raw, p_adjusted }
        })
        .collect()
}

/// `(I - H_gg)^(-1/2) e_g`.
fn inflated(projection: &Projection, residual: &DVector<f64>, rows: &[usize]) -> DVector<f64> {
    let e = DVector::from_iterator(rows.len(), rows.iter().map(|r| residual[*r]));
    let q = projection.q.select_rows(rows);
    // H_gg = V diag(h) V' has rank at most min(rows, p).
    let small = if q.nrows() <= q.ncols() { &q * q.transpose() } else { gram(&q) };
    let decomposed = small.symmetric_eigen();
    let vectors = if q.nrows() <= q.ncols() {
        decomposed.eigenvectors
    } else {
        let mut v = &q * decomposed.eigenvectors;
        for (mut column, h) in v.column_iter_mut().zip(decomposed.eigenvalues.iter()) {
            if *h > 1e-12 {
                column /= h.sqrt();
            } else {
                column.fill(0.0);
            }
        }
        v
    };
    let mut t = vectors.tr_mul(&e);
    for (t, h) in t.iter_mut().zip(decomposed.eigenvalues.iter()) {
        // A direction the geometry takes whole has no residual to inflate.
        *t *= if *h > 1e-12 { (1.0 - h).max(1e-3).powf(-0.5) - 1.0 } else { 0.0 };
    }
    e + vectors * t
}

/// Column g: `basis_g' u_g`.
fn contributions(basis: &DMatrix<f64>, clusters: &[Vec<usize>], corrected: &[DVector<f64>]) -> DMatrix<f64> {
    let mut c = DMatrix::zeros(basis.ncols(), clusters.len());
    for (g, (rows, u)) in clusters.iter().zip(corrected).enumerate() {
        for k in 0..basis.ncols() {
            c[(k, g)] = rows.iter().zip(u.iter()).map(|(r, u)| basis[(*r, k)] * u).sum();
        }
    }
    c
}

/// Rademacher signs, or Webb's six points below 12 clusters.
fn signs(clusters: usize, config: &DiagnosisConfig) -> DMatrix<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let webb = [1.5f64, 1.0, 0.5].map(f64::sqrt);
    DMatrix::from_fn(clusters, config.resamplings, |_, _| {
        if clusters < 12 {
            let k = rng.random_range(0..6usize);
            if k < 3 { webb[k] } else { -webb[k - 3] }
        } else if rng.random::<bool>() {
            1.0
        } else {
            -1.0
        }
    })
}
