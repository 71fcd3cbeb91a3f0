//! Classical tests of what a fit leaves (notes 4.11), shown beside the verdict.

use crate::config::DiagnosisConfig;
use crate::drivers::standardised_joints;
use crate::judge::base_fit;
use crate::problem::Problem;
use crate::projection::Rough;
use crate::special::{chi2_tail, ln_f_tail};
use armcal_calibrate::gram;
use kdtree::KdTree;
use kdtree::distance::squared_euclidean;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use std::collections::BTreeMap;

/// Neighbours in Moran's I.
const NEIGHBOURS: usize = 6;

/// Tests of the residuals of the base model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Structure {
    /// P-value of chi-square against the declared noise.
    pub chi2_p: f64,
    /// Lack of fit against replicates, where there are any.
    pub lack_of_fit: Option<LackOfFit>,
    /// Moran's I over neighbours in joint space: do neighbours err alike?
    pub moran: f64,
    /// Its p-value (sign flips).
    pub moran_p: f64,
    /// Correlation of one dwell with the next.
    pub lag1: f64,
    /// Its p-value (normal approximation).
    pub lag1_p: f64,
}

/// Lack of fit against pure error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LackOfFit {
    /// F statistic.
    pub f: f64,
    /// P-value.
    pub p: f64,
    /// Standard deviation of replicates over the declared one.
    pub pure_sigma_ratio: f64,
    /// Degrees of freedom of the replicates.
    pub pure_dof: f64,
}

/// Tests the residuals at the best linear fit.
pub(crate) fn structure(problem: &Problem, config: &DiagnosisConfig) -> Structure {
    let e = &problem.residual - &problem.geometry * base_fit(problem);
    let p_eff = effective_parameters(problem);
    let dof = (e.len() as f64 - p_eff).max(1.0);
    let (moran, moran_p) = moran(problem, &e, config);
    let (lag1, lag1_p) = lag1(problem, &e);
    Structure {
        chi2_p: chi2_tail(e.norm_squared(), dof),
        lack_of_fit: lack_of_fit(problem, &e, p_eff),
        moran,
        moran_p,
        lag1,
        lag1_p,
    }
}

fn effective_parameters(problem: &Problem) -> f64 {
    let (geometry, residual) = (&problem.geometry, &problem.residual);
    let of_residual = (geometry.tr_mul(residual), residual.norm_squared());
    let (precision, offset) = (&problem.geometry_precision, &problem.geometry_offset);
    Rough::new(gram(geometry), of_residual, precision, offset).effective_parameters
}

/// `F = [(SS_E - SS_PE)/(rows of groups - p)] / [SS_PE/df_PE]`, groups: place, recording, approach, load.
fn lack_of_fit(problem: &Problem, e: &DVector<f64>, p_eff: f64) -> Option<LackOfFit> {
    let mut groups: BTreeMap<(usize, &str, Vec<i8>, i64), Vec<usize>> = BTreeMap::new();
    for (i, d) in problem.dwells.iter().enumerate() {
        if let Some(place) = &d.place {
            let approach = d.arrival.iter().map(|s| *s as i8).collect();
            let load = (d.load_kg * 1e3).round() as i64;
            groups.entry((d.id.recording, place, approach, load)).or_default().push(i);
        }
    }
    let (mut pure, mut pure_dof, mut rows) = (0.0, 0.0, 0.0);
    for members in groups.values() {
        let first = &problem.dwells[members[0]];
        let width = members.iter().map(|i| first.rows_as_in(&problem.dwells[*i])).min().unwrap_or(0);
        let part = |i: &usize| e.rows(problem.dwells[*i].first_row, width).into_owned();
        let mean = members.iter().map(part).fold(DVector::zeros(width), |a, b| a + b) / members.len() as f64;
        pure += members.iter().map(|i| (part(i) - &mean).norm_squared()).sum::<f64>();
        pure_dof += (width * (members.len() - 1)) as f64;
        rows += width as f64;
    }
    let lack_dof = rows - p_eff;
    if pure_dof < 6.0 || lack_dof < 1.0 || pure <= 0.0 {
        return None;
    }
    let f = ((e.norm_squared() - pure).max(0.0) / lack_dof) / (pure / pure_dof);
    let p = ln_f_tail(f, lack_dof, pure_dof).exp();
    Some(LackOfFit { f, p, pure_sigma_ratio: (pure / pure_dof).sqrt(), pure_dof })
}

/// Moran's I on residual vectors over nearest neighbours in joint space; null by flipping the sign of whole dwells.
fn moran(problem: &Problem, e: &DVector<f64>, config: &DiagnosisConfig) -> (f64, f64) {
    let n = problem.dwells.len();
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    let count = NEIGHBOURS.min(n.saturating_sub(2)).max(1);
    for (i, near) in nearest(&standardised_joints(problem), count).into_iter().enumerate() {
        for j in near {
            let (a, b) = (&problem.dwells[i], &problem.dwells[j]);
            let width = a.rows_as_in(b);
            pairs.push((i, j, e.rows(a.first_row, width).dot(&e.rows(b.first_row, width))));
        }
    }
    let scale = n as f64 / (pairs.len().max(1) as f64 * e.norm_squared().max(1e-300));
    let observed: f64 = pairs.iter().map(|p| p.2).sum();
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed ^ 0x4d0a);
    let mut above = 0usize;
    let mut signs = vec![1.0; n];
    for _ in 0..config.resamplings {
        signs.iter_mut().for_each(|s| *s = if rng.random::<bool>() { 1.0 } else { -1.0 });
        let drawn: f64 = pairs.iter().map(|(i, j, w)| signs[*i] * signs[*j] * w).sum();
        above += usize::from(drawn >= observed);
    }
    (observed * scale, (1.0 + above as f64) / (config.resamplings as f64 + 1.0))
}

/// So many nearest other rows of each row, the nearest first; of those that are as far, the first.
fn nearest(rows: &DMatrix<f64>, count: usize) -> Vec<Vec<usize>> {
    let points = rows.transpose();
    let at: Vec<&[f64]> = points.as_slice().chunks_exact(points.nrows().max(1)).collect();
    let mut tree = KdTree::new(points.nrows());
    for (i, point) in at.iter().enumerate() {
        // A row that is not finite is no neighbour, and has none.
        let _ = tree.add(*point, i);
    }
    let near = |i: usize| {
        let Some(all) = at.get(i).and_then(|point| tree.iter_nearest(point, &squared_euclidean).ok()) else {
            return Vec::new();
        };
        let mut found: Vec<(f64, usize)> = Vec::with_capacity(count + 1);
        for (square, j) in all.map(|(square, j)| (square, *j)).filter(|(_, j)| *j != i) {
            if found.len() >= count && square > found[found.len() - 1].0 {
                break;
            }
            found.push((square, j));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().take(count).map(|(_, j)| j).collect()
    };
    (0..rows.nrows()).map(near).collect()
}

/// Correlation of each dwell with the next of its recording.
fn lag1(problem: &Problem, e: &DVector<f64>) -> (f64, f64) {
    let mut order: Vec<usize> = (0..problem.dwells.len()).collect();
    order.sort_by_key(|i| problem.dwells[*i].id);
    let (mut product, mut count) = (0.0, 0.0);
    for w in order.windows(2) {
        let (a, b) = (&problem.dwells[w[0]], &problem.dwells[w[1]]);
        if a.id.recording == b.id.recording {
            let width = a.rows_as_in(b);
            product += e.rows(a.first_row, width).dot(&e.rows(b.first_row, width));
            count += width as f64;
        }
    }
    let variance = e.norm_squared() / e.len().max(1) as f64;
    let lag1 = product / (count.max(1.0) * variance.max(1e-300));
    // Square of a normal variable: two-sided.
    (lag1, chi2_tail(lag1 * lag1 * count, 1.0))
}

#[cfg(test)]
mod tests {
    use super::nearest;
    use nalgebra::DMatrix;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_nearest_rows_are_those_that_asking_all_finds() {
        for (rows, columns) in [(1, 2), (2, 1), (7, 3), (200, 1), (300, 6)] {
            let mut rng = ChaCha8Rng::seed_from_u64(rows as u64);
            // Of few values, so that many are as far as one another.
            let all = DMatrix::from_fn(rows, columns, |_, _| f64::from(rng.random_range(-6..6i32)));
            for (i, found) in nearest(&all, 6).into_iter().enumerate() {
                let mut others: Vec<(f64, usize)> = (0..rows)
                    .filter(|j| *j != i)
                    .map(|j| ((all.row(i) - all.row(j)).norm_squared(), j))
                    .collect();
                others.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                let expected: Vec<usize> = others.into_iter().take(6).map(|(_, j)| j).collect();
                assert_eq!(found, expected, "row {i} of {rows} x {columns}");
            }
        }
    }
}
