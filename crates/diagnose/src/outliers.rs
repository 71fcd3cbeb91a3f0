//! Dwells that fit nothing: set aside and reported, never silently (notes 9, DATA SUSPECT).

use crate::config::DiagnosisConfig;
use crate::crossval::{Group, left_out};
use crate::drivers::standardised_joints;
use crate::problem::Problem;
use crate::special::chi2_tail;
use crate::weigh::Weighed;
use armcal_core::robust::median;
use nalgebra::DVector;

/// More suspects than this share are no outliers but structure.
const MAX_SHARE: f64 = 0.1;
/// Suspects that err alike above this mean cosine are structure too.
const MAX_AGREEMENT: f64 = 0.4;
/// Fewest suspects for which that is asked.
const MIN_AGREEING: usize = 4;

/// Dwells whose residual, predicted without them by the most flexible explanation at hand, is as rare as
/// `outlier_sigma`.
pub(crate) fn suspects(problem: &Problem, weighed: &Weighed, config: &DiagnosisConfig) -> Vec<usize> {
    let best = weighed.best().filter(|b| b.1 > 0.0);
    let effect = best.map(|b| weighed.tamed(b.0, problem, config));
    let alone: Vec<Group> = (0..problem.dwells.len()).map(|i| vec![i].into()).collect();
    let left = left_out(problem, effect.as_ref(), &alone);
    // Wilson-Hilferty: the median of chi-square with k degrees of freedom is about k (1 - 2/(9k))^3.
    let reduced: Vec<f64> = problem
        .dwells
        .iter()
        .map(|d| {
            let k = d.rows as f64;
            left.rows(d.first_row, d.rows).norm_squared() / (k * (1.0 - 2.0 / (9.0 * k)).powi(3))
        })
        .collect();
    let variance = median(&reduced);
    let rare = chi2_tail(config.outlier_sigma.powi(2), 1.0);
    let found: Vec<usize> = (0..reduced.len())
        .filter(|i| {
            let d = &problem.dwells[*i];
            let square = left.rows(d.first_row, d.rows).norm_squared() / variance.max(1e-300);
            chi2_tail(square, d.rows as f64) < rare
        })
        .collect();
    let few = found.len() as f64 <= MAX_SHARE * problem.dwells.len() as f64;
    if few && agreement(problem, &left, &found) < MAX_AGREEMENT { found } else { Vec::new() }
}

/// Mean cosine between the residual of each suspect and that of the suspect next to it in joint space. Accidents point
/// anywhere; neighbours that err alike are a cause.
fn agreement(problem: &Problem, left: &DVector<f64>, found: &[usize]) -> f64 {
    if found.len() < MIN_AGREEING {
        return 0.0;
    }
    let z = standardised_joints(problem);
    let rows = |i: usize| left.rows(problem.dwells[i].first_row, problem.dwells[i].rows);
    let mut sum = 0.0;
    for &i in found {
        let distance = |j: &usize| (z.row(i) - z.row(*j)).norm_squared();
        let others =
            found.iter().copied().filter(|j| *j != i && problem.dwells[*j].rows == problem.dwells[i].rows);
        if let Some(j) = others.min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            sum += rows(i).dot(&rows(j)) / (rows(i).norm() * rows(j).norm()).max(1e-300);
        }
    }
    sum / found.len() as f64
}

/// Dwells whose arrival direction looks wrong: turning it over would remove more than 25 sigma squared.
pub(crate) fn flipped(problem: &Problem, residual: &[f64], signature: &[f64]) -> Vec<usize> {
    let change = |i: usize| -> f64 {
        // e - G theta with s turned over is e + G theta: a change of 4 e'G theta in the square.
        let d = &problem.dwells[i];
        d.range().map(|r| -4.0 * residual[r] * signature[r]).sum()
    };
    (0..problem.dwells.len())
        .filter(|i| change(*i) > 25.0 && problem.dwells[*i].arrival.iter().any(|s| *s != 0.0))
        .collect()
}
