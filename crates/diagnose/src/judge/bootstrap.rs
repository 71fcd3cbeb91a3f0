//! The gate: a wild cluster bootstrap with the maximum over all candidates and scans (notes 4.5).
//!
//! ```text
//! e*_g = w_g (I - H_gg)^(-1/2) e~_g,  w_g = +-1,   T_k = -ln p(F_k),   p_adj = (1 + #{max T* >= T_k}) / (B + 1)
//! ```
//!
//! (Djogbenou, MacKinnon, Nielsen, QED 1383; Westfall and Young 1993.) With `c_kg = B_k,g' (I - H_gg)^(-1/2) e~_g`
//! for an orthonormal basis `B_k` of the projected candidate, all scores of all resamplings are `C W`, W being [`Signs`].
//! `B_k = (G - Q Q'G) A^(-1/2)` is never put together: what is asked of it are products with `G` and `Q`.

use crate::config::DiagnosisConfig;
use crate::problem::projection::{Gram, Projection, gram_eigen};
use crate::problem::{Columns, DwellRow};
use armcal_calibrate::tails::ln_f_tail;
use armcal_calibrate::{Signs, gram};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Candidates whose scores are drawn in one product.
const BLOCK: usize = 32;

/// One candidate in the projected space.
#[derive(Debug, Clone)]
pub(crate) struct Direction<'a> {
    /// Its columns as the data have them, times this factor.
    columns: (&'a Columns, f64),
    /// `A^(-1/2)`: what makes them orthonormal once the geometry is projected out.
    root: DMatrix<f64>,
    /// `Q'G A^(-1/2)`.
    spent: DMatrix<f64>,
    /// Score `S = |A^(-1/2) G~'e~|^2` (formula 6).
    pub score: f64,
}

impl<'a> Direction<'a> {
    /// From columns times a factor, and the products of these.
    pub fn new(columns: &'a Columns, factor: f64, gram: &Gram) -> Direction<'a> {
        let (w, v) = gram_eigen(&gram.a, gram.raw.max());
        let keep: Vec<usize> = (0..w.len()).filter(|k| w[*k] > 0.0).collect();
        let mut root = DMatrix::zeros(v.nrows(), keep.len());
        for (c, k) in keep.iter().enumerate() {
            root.set_column(c, &(v.column(*k) / w[*k].sqrt()));
        }
        let score = root.tr_mul(&gram.g).norm_squared();
        Direction { columns: (columns, factor), spent: &gram.spent * &root, root, score }
    }

    /// Rank.
    pub fn rank(&self) -> usize {
        self.root.ncols()
    }

    /// Column g: `B_g' u_g`; `spent` has `Q_g' u_g`.
    fn contributions(&self, drawn: &Drawn<'_>, spent: &DMatrix<f64>) -> DMatrix<f64> {
        let (columns, factor) = self.columns;
        let own = drawn.of(columns);
        self.root.tr_mul(&own) * factor - self.spent.tr_mul(spent)
    }
}

/// `u_g = (I - H_gg)^(-1/2) e_g` of every cluster of dwells.
struct Drawn<'a> {
    dwells: &'a [DwellRow],
    clusters: &'a [Vec<usize>],
    /// All of them, in the rows of the data.
    u: DVector<f64>,
}

impl Drawn<'_> {
    /// What columns say of `u` cluster by cluster: m x clusters.
    fn of(&self, columns: &Columns) -> DMatrix<f64> {
        if let Columns::Dense(own) = columns {
            return self.of_clusters(own);
        }
        let mut of_all = DMatrix::zeros(columns.len(), self.clusters.len());
        match (columns, columns.factors()) {
            (_, Some((base, basis))) => {
                let (with, m) = (self.of_dwells(base), basis.ncols());
                for (mut column, dwells) in of_all.column_iter_mut().zip(self.clusters) {
                    for (k, value) in column.iter_mut().enumerate() {
                        *value = dwells.iter().map(|d| with[(*d, k / m)] * basis[(*d, k % m)]).sum();
                    }
                }
            }
            (Columns::Together(parts), None) => {
                let mut at = 0;
                for part in parts {
                    of_all.rows_mut(at, part.len()).copy_from(&self.of(part));
                    at += part.len();
                }
            }
            (_, None) => of_all.copy_from(&self.of_clusters(&columns.dense(self.dwells, 1.0))),
        }
        of_all
    }

    /// What columns say of `u` dwell by dwell: dwells x m.
    fn of_dwells(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut with = DMatrix::zeros(self.dwells.len(), columns.ncols());
        for (column, mut with) in columns.column_iter().zip(with.column_iter_mut()) {
            for (with, dwell) in with.iter_mut().zip(self.dwells) {
                *with = dwell.range().map(|row| column[row] * self.u[row]).sum();
            }
        }
        with
    }

    /// The same cluster by cluster: m x clusters.
    fn of_clusters(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let with = self.of_dwells(columns);
        DMatrix::from_fn(columns.ncols(), self.clusters.len(), |k, g| {
            self.clusters[g].iter().map(|d| with[(*d, k)]).sum()
        })
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
fn neg_ln_p(s: f64, m: f64, rss: f64, dof: f64) -> f64 {
    let left = (rss - s).max(1e-12 * rss) / (dof - m).max(1.0);
    -ln_f_tail(s / m / left, m, (dof - m).max(1.0))
}

/// Bootstraps all candidates together. `clusters` names the dwells of each cluster.
pub(crate) fn wild_cluster(
    projection: &Projection,
    candidates: &[Direction<'_>],
    (dwells, clusters): (&[DwellRow], &[Vec<usize>]),
    config: &DiagnosisConfig,
) -> Vec<Significance> {
    let (rss, dof) = (projection.rss, projection.dof());
    let residual = projection.projected_residual();
    let ranks: Vec<usize> = candidates.iter().map(Direction::rank).collect();
    let scores: Vec<f64> = candidates.iter().map(|c| c.score).collect();
    let observed: Vec<f64> = scores
        .iter()
        .zip(&ranks)
        .map(|(s, m)| if *m == 0 { 0.0 } else { neg_ln_p(*s, *m as f64, rss, dof) })
        .collect();
    let mut drawn = Drawn { dwells, clusters, u: DVector::zeros(residual.len()) };
    let mut power = DMatrix::zeros(1, clusters.len());
    for (g, members) in clusters.iter().enumerate() {
        let rows: Vec<usize> = members.iter().flat_map(|d| dwells[*d].range()).collect();
        let u = leverage_adjusted_residual(projection, &residual, &rows);
        power[(0, g)] = u.norm_squared();
        rows.iter().zip(u.iter()).for_each(|(row, u)| drawn.u[*row] = *u);
    }
    let signs = Signs::new(clusters.len(), config.flips());
    let of_geometry = drawn.of_clusters(&projection.q);
    let spent = signs.times(&of_geometry);
    let total = signs.squared_times(&power);
    let left: Vec<f64> =
        spent.column_iter().zip(total.iter()).map(|(c, t)| (t - c.norm_squared()).max(1e-12)).collect();

    let mut exceed = vec![0usize; candidates.len()];
    // Largest score over candidates of the same rank is enough for the maximum of T.
    let mut top: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    let present: Vec<usize> = (0..candidates.len()).filter(|k| ranks[*k] > 0).collect();
    // Many small transforms are one large one.
    for block in present.chunks(BLOCK) {
        let width = block.iter().map(|k| ranks[*k]).sum();
        let mut stacked = DMatrix::zeros(width, clusters.len());
        let mut at = 0;
        for k in block {
            let own = candidates[*k].contributions(&drawn, &of_geometry);
            stacked.rows_mut(at, ranks[*k]).copy_from(&own);
            at += ranks[*k];
        }
        let drawn = signs.times(&stacked);
        let mut at = 0;
        for &k in block {
            let best = top.entry(ranks[k]).or_insert_with(|| vec![0.0; config.resamplings]);
            let share = scores[k] / rss;
            let each = drawn.as_slice().chunks_exact(width).zip(&left).zip(best);
            for ((drawn, left), best) in each {
                let drawn_share = drawn[at..at + ranks[k]].iter().map(|v| v * v).sum::<f64>() / left;
                exceed[k] += usize::from(drawn_share >= share);
                *best = best.max(drawn_share);
            }
            at += ranks[k];
        }
    }
    let maximum: Vec<f64> = (0..config.resamplings)
        .map(|b| top.iter().map(|(m, best)| neg_ln_p(best[b], *m as f64, 1.0, dof)).fold(0.0, f64::max))
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
fn leverage_adjusted_residual(
    projection: &Projection,
    residual: &DVector<f64>,
    rows: &[usize],
) -> DVector<f64> {
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
