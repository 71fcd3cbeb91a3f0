//! Errors on groups the fit never saw, in closed form (notes 4.4).
//!
//! For a group of dwells, `beta_(g) = (X'X + P - X_g'X_g)^-1 (X'e - P b0 - X_g'e_g)` and
//! `e_(g) = e_g - X_g beta_(g)`: exactly the linearised fit without the group. A geometry column that only the group
//! itself sees (the pose of its own board) is fitted to the group afterwards, as a user would have to.

use crate::config::DiagnosisConfig;
use crate::problem::places::independent_units;
use crate::problem::projection::{cholesky_upper, solve_cholesky};
use crate::problem::{DwellRow, EFFECT_PRECISION, Problem};
use armcal_calibrate::{HeldOut, gram, grouped_ci95};
use nalgebra::{DMatrix, DVector};
use std::collections::{BTreeMap, BTreeSet};

/// Dwells of a stretch of time that is left out, and of what is left out before and after it.
const STRETCH: usize = 4;
const FORGOTTEN: usize = 6;

/// Dwells that are predicted by a fit that did not see them.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    /// Those that are predicted.
    pub scored: Vec<usize>,
    /// Those the fit does not see: the same, and what is too near to them to be independent.
    pub unseen: Vec<usize>,
}

impl From<Vec<usize>> for Group {
    fn from(scored: Vec<usize>) -> Group {
        Group { unseen: scored.clone(), scored }
    }
}

/// Dwells by place, or by neighbourhood in joint space where places are few or do not repeat.
pub(crate) fn by_place(problem: &Problem) -> Vec<Group> {
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    independent_units(problem)
        .into_iter()
        .enumerate()
        .for_each(|(i, unit)| groups.entry(unit).or_default().push(i));
    groups.into_values().map(Group::from).collect()
}

/// Dwells by recording.
pub(crate) fn by_recording(problem: &Problem) -> Vec<Group> {
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    problem.dwells.iter().enumerate().for_each(|(i, d)| groups.entry(d.id.recording).or_default().push(i));
    groups.into_values().map(Group::from).collect()
}

/// Stretches of time, with as much before and after them unseen as the noise may remember (h-block cross-validation:
/// Burman, Chow, Nolan, Biometrika 1994).
pub(crate) fn by_stretch(problem: &Problem) -> Vec<Group> {
    let mut groups: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (i, d) in problem.dwells.iter().enumerate() {
        groups.entry((d.id.recording, d.id.dwell / STRETCH)).or_default().push(i);
    }
    let around = |((recording, stretch), scored): ((usize, usize), Vec<usize>)| {
        let (from, to) = (stretch * STRETCH, (stretch + 1) * STRETCH + FORGOTTEN);
        let near = |i: &usize| {
            let id = problem.dwells[*i].id;
            id.recording == recording && id.dwell + FORGOTTEN >= from && id.dwell < to
        };
        Group { scored, unseen: (0..problem.dwells.len()).filter(near).collect() }
    };
    groups.into_iter().map(around).collect()
}

/// Whitened residual rows of every dwell, each predicted without its group; `effect` columns are fitted too. Noise of
/// `scale` times the declared one makes priors weigh its square as much against data in declared units; the columns of an
/// effect come with that in them.
pub(crate) fn left_out(
    problem: &Problem,
    effect: Option<&DMatrix<f64>>,
    groups: &[Group],
    scale: f64,
) -> DVector<f64> {
    let [_, left] = fitted_and_left_out(problem, effect, groups, scale);
    left
}

/// Residual rows of the fit to all dwells, and those of [`left_out`].
pub(crate) fn fitted_and_left_out(
    problem: &Problem,
    effect: Option<&DMatrix<f64>>,
    groups: &[Group],
    scale: f64,
) -> [DVector<f64>; 2] {
    let geometry = problem.geometry.ncols();
    let extra = effect.map_or(0, |e| e.ncols());
    let mut x = DMatrix::zeros(problem.rows(), geometry + extra);
    x.columns_mut(0, geometry).copy_from(&problem.geometry);
    if let Some(effect) = effect {
        x.columns_mut(geometry, extra).copy_from(effect);
    }
    let precision = |k: usize| match k < geometry {
        true => problem.geometry_precision[k] * scale.powi(2),
        false => EFFECT_PRECISION,
    };
    let mut normal = gram(&x);
    let mut right = x.tr_mul(&problem.residual);
    for k in 0..x.ncols() {
        normal[(k, k)] += precision(k);
        if k < geometry {
            right[k] -= precision(k) * problem.geometry_offset[k];
        }
    }
    let total: Vec<f64> = x.column_iter().map(|c| c.norm_squared()).collect();
    let factor = cholesky_upper(normal.clone());
    let beta_all = solve_cholesky(&factor, &right);
    let out = &problem.residual - &x * &beta_all;
    let mut predicted = out.clone();
    for group in groups {
        let rows: Vec<usize> = group.unseen.iter().flat_map(|i| problem.dwells[*i].range()).collect();
        let x_g = x.select_rows(&rows);
        let own: Vec<usize> = (0..geometry)
            .filter(|k| total[*k] > 0.0 && x_g.column(*k).norm_squared() > (1.0 - 1e-9) * total[*k])
            .collect();
        let short = own.is_empty() && 2 * rows.len() < x.ncols();
        let by_hat = if short { without_by_hat(&factor, &x_g, &out.select_rows(&rows)) } else { None };
        let left = by_hat.unwrap_or_else(|| {
            let e_g = problem.residual.select_rows(&rows);
            let factor = cholesky_upper(&normal - x_g.tr_mul(&x_g));
            let beta = solve_cholesky(&factor, &(&right - x_g.tr_mul(&e_g)));
            let mut left = e_g - &x_g * beta;
            if !own.is_empty() && own.len() < rows.len() {
                let q = x_g.select_columns(&own).qr().q();
                left -= &q * q.tr_mul(&left);
            }
            left
        });
        let scored: BTreeSet<usize> = group.scored.iter().flat_map(|i| problem.dwells[*i].range()).collect();
        rows.iter()
            .zip(left.iter())
            .filter(|(r, _)| scored.contains(r))
            .for_each(|(r, v)| predicted[*r] = *v);
    }
    [out, predicted]
}

/// `(I - H_gg)^-1 r_g`, r the residual of the whole fit: the same number by a small matrix.
fn without_by_hat(
    factor: &DMatrix<f64>,
    x_g: &DMatrix<f64>,
    residual: &DVector<f64>,
) -> Option<DVector<f64>> {
    let half = factor.tr_solve_upper_triangular(&x_g.transpose())?;
    let n = residual.len();
    (DMatrix::identity(n, n) - half.tr_mul(&half)).cholesky().map(|c| c.solve(residual))
}

/// Position errors of one dwell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DwellErrors {
    /// Their sum over what was measured in it [m].
    pub sum_m: f64,
    /// How much that was.
    pub count: f64,
}

/// Position errors of the dwells from whitened rows.
pub(crate) fn errors_m(problem: &Problem, rows: &DVector<f64>) -> Vec<DwellErrors> {
    let of = |d: &DwellRow| DwellErrors { sum_m: d.errors_m(rows).sum(), count: d.parts.len() as f64 };
    problem.dwells.iter().map(of).collect()
}

/// Compares two sets of left-out whitened rows group by group.
pub(crate) fn compare_left_out(
    problem: &Problem,
    before: &DVector<f64>,
    after: &DVector<f64>,
    groups: &[Group],
    config: &DiagnosisConfig,
) -> HeldOut {
    let power = |rows: &DVector<f64>, group: &[usize]| -> f64 {
        group
            .iter()
            .map(|i| rows.rows(problem.dwells[*i].first_row, problem.dwells[*i].rows).norm_squared())
            .sum()
    };
    let fall: Vec<f64> = groups.iter().map(|g| power(before, &g.scored) - power(after, &g.scored)).collect();
    let (from, to) = (errors_m(problem, before), errors_m(problem, after));
    let n = from.iter().map(|e| e.count).sum::<f64>().max(1.0);
    let mean = |v: &[DwellErrors]| v.iter().map(|e| e.sum_m).sum::<f64>() / n * 1e3;
    let change = |g: &Group| {
        let change_m = g.scored.iter().map(|i| to[*i].sum_m - from[*i].sum_m).sum::<f64>();
        (change_m * 1e3, g.scored.iter().map(|i| from[*i].count).sum::<f64>())
    };
    let changes: Vec<(f64, f64)> = groups.iter().map(change).collect();
    let total_before = before.norm_squared();
    HeldOut {
        before: mean(&from),
        after: mean(&to),
        change_ci95: grouped_ci95(&changes),
        gain: if total_before > 0.0 { fall.iter().sum::<f64>() / total_before } else { 0.0 },
        p: config.flips().p(&fall),
        groups: groups.len(),
    }
}
