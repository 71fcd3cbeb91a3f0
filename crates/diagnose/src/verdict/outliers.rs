//! Dwells that fit nothing: set aside and reported, never silently (notes 9, DATA SUSPECT).

use crate::config::DiagnosisConfig;
use crate::problem::{Columns, DwellRow, Problem};
use crate::weigh::crossval::{Group, fitted_and_left_out};
use crate::weigh::drivers::standardised_joints;
use crate::weigh::{Entry, Weighed, weigh};
use armcal_calibrate::tails::chi2_tail;
use armcal_core::DwellId;
use armcal_core::robust::median;
use armcal_model::Toggle;
use nalgebra::DVector;
use std::collections::BTreeSet;

/// Rounds of setting dwells aside.
const ROUNDS: usize = 3;
/// More dwells than this share, over all rounds, are no outliers but structure.
const MAX_SHARE: f64 = 0.1;
/// Suspects that err alike above this mean cosine are structure too.
const MAX_AGREEMENT: f64 = 0.4;
/// Fewest suspects for which that is asked.
const MIN_AGREEING: usize = 4;
/// Dwells in a row that err are an event, which has a name of its own.
const RUN: usize = 3;
/// Names whose predictions are asked.
const NAMED: usize = 6;
/// What sets dwells apart, a joint's angle say, keeps at least this share of its variance.
const KEPT_VARIANCE: f64 = 0.5;

/// A problem without the dwells that fit nothing.
pub(crate) struct Cleaned {
    /// Which dwells of the whole problem are kept.
    pub keep: Vec<bool>,
    /// The others.
    pub aside: Vec<DwellId>,
    /// The problem of these.
    pub problem: Problem,
    /// How it weighs.
    pub weighed: Weighed,
}

/// Sets dwells aside in rounds, each with the explanations that the dwells before it did not spoil.
pub(crate) fn set_aside(whole: Problem, config: &DiagnosisConfig) -> Cleaned {
    let mut keep = vec![true; whole.dwells.len()];
    let mut cut = None;
    let mut weighed = weigh(&whole, config);
    for _ in 0..ROUNDS {
        let kept: Vec<usize> = (0..keep.len()).filter(|i| keep[*i]).collect();
        let found = suspects(cut.as_ref().unwrap_or(&whole), &weighed, config);
        let found = plausible_outliers(&whole, &keep, found.into_iter().map(|i| kept[i]).collect());
        if found.is_empty() {
            break;
        }
        found.iter().for_each(|i| keep[*i] = false);
        weighed = weigh(cut.insert(whole.without(&keep)), config);
    }
    let aside = whole.dwells.iter().zip(&keep).filter(|(_, keep)| !**keep).map(|(d, _)| d.id).collect();
    Cleaned { keep, aside, problem: cut.unwrap_or(whole), weighed }
}

/// Dwells whose residual, predicted without them, is as rare as `outlier_sigma` under every explanation at hand, what a
/// prediction does not know allowed for: the best of all, which may be a flexible shape and says how the rest scatters, and
/// the best lasting ones that have a name. What one of these predicts has a cause, even where another one weighs more while
/// it is in; and what errs alike under one of them is structure.
fn suspects(problem: &Problem, weighed: &Weighed, config: &DiagnosisConfig) -> Vec<usize> {
    let best = weighed.best().filter(|b| b.1 > 0.0).map(|b| b.0);
    let (left, square) = leave_one_out(problem, weighed, best, config);
    let reduced: Vec<f64> =
        problem.dwells.iter().zip(&square).map(|(d, square)| square / median_square(d.rows as f64)).collect();
    let variance = median(&reduced).max(1e-300);
    let limit = chi2_tail(config.outlier_sigma.powi(2), 1.0);
    let rare = |i: usize, square: f64| chi2_tail(square / variance, problem.dwells[i].rows as f64) < limit;
    let mut found: Vec<usize> = (0..square.len()).filter(|i| rare(*i, square[*i])).collect();
    let mut lefts = vec![left];
    // An event is placed where accidents are: that it predicts them is no sign of a cause.
    let lasts = |e: &&Entry| !matches!(e.candidate.toggle, Toggle::Time | Toggle::Recording);
    let named = weighed.ranking().into_iter().map(|k| &weighed.entries[k]).filter(lasts).take(NAMED);
    for entry in named.filter(|e| e.ln_evidence >= config.margin_nats) {
        if found.is_empty() {
            break;
        }
        let (left, square) = leave_one_out(problem, weighed, Some(&entry.candidate.columns), config);
        found.retain(|i| rare(*i, square[*i]));
        lefts.push(left);
    }
    let alike = lefts.iter().any(|left| mean_neighbour_cosine(problem, left, &found) >= MAX_AGREEMENT);
    if alike { Vec::new() } else { found }
}

/// Residual of each dwell as one explanation, or none, predicts it without the dwell, and its square in units of what that
/// scatters.
fn leave_one_out(
    problem: &Problem,
    weighed: &Weighed,
    explanation: Option<&Columns>,
    config: &DiagnosisConfig,
) -> (DVector<f64>, Vec<f64>) {
    let effect = explanation.map(|columns| weighed.regularised(columns, problem, config));
    let alone: Vec<Group> = (0..problem.dwells.len()).map(|i| vec![i].into()).collect();
    let [fitted, left] = fitted_and_left_out(problem, effect.as_ref(), &alone, weighed.scale);
    let square = studentised_squares(problem, &left, &fitted);
    (left, square)
}

/// Median of chi-square with so many degrees of freedom, within one in a hundred (Wilson, Hilferty, PNAS 1931).
fn median_square(rows: f64) -> f64 {
    rows * (1.0 - 2.0 / (9.0 * rows)).powi(3)
}

/// `r' (I - H)^-1 r` of each dwell: the square of its left-out residual in units of what that scatters. A dwell that
/// alone determines something is predicted badly without it, and that is no sign against it (Cook, Weisberg 1982, 2.2).
fn studentised_squares(problem: &Problem, left: &DVector<f64>, fitted: &DVector<f64>) -> Vec<f64> {
    let rows = |of: &DVector<f64>, d: &DwellRow| of.rows(d.first_row, d.rows).into_owned();
    problem.dwells.iter().map(|d| rows(left, d).dot(&rows(fitted, d)).max(0.0)).collect()
}

/// Of the suspects, those that can be accidents: few, with all that were set aside before; not in a row; and not what
/// alone shows a joint, a direction, a load or a temperature.
fn plausible_outliers(whole: &Problem, keep: &[bool], found: Vec<usize>) -> Vec<usize> {
    let mut all: BTreeSet<usize> =
        (0..keep.len()).filter(|i| !keep[*i]).chain(found.iter().copied()).collect();
    let few = all.len() as f64 <= MAX_SHARE * whole.dwells.len() as f64;
    if !few {
        return Vec::new();
    }
    let rows = in_a_row(whole, &all);
    all.retain(|i| !rows.contains(i));
    let needed = needed_for_variance(whole, &all);
    found.into_iter().filter(|i| all.contains(i) && !needed.contains(i)).collect()
}

/// Those of the suspects that follow each other in time, at least [`RUN`] of them.
fn in_a_row(whole: &Problem, suspects: &BTreeSet<usize>) -> BTreeSet<usize> {
    let mut order: Vec<usize> = (0..whole.dwells.len()).collect();
    order.sort_by_key(|i| whole.dwells[*i].id);
    let same = |a: &usize, b: &usize| {
        suspects.contains(a) == suspects.contains(b)
            && whole.dwells[*a].id.recording == whole.dwells[*b].id.recording
    };
    let runs = order.chunk_by(same).filter(|run| run.len() >= RUN && suspects.contains(&run[0]));
    runs.flatten().copied().collect()
}

/// Those of the suspects without which something that sets dwells apart would hardly vary.
fn needed_for_variance(whole: &Problem, suspects: &BTreeSet<usize>) -> BTreeSet<usize> {
    let mut needed = BTreeSet::new();
    for value in what_varies(whole) {
        let kept: Vec<f64> = (0..value.len()).filter(|i| !suspects.contains(i)).map(|i| value[i]).collect();
        let ((_, all), (middle, rest)) = (mean_and_variance(&value), mean_and_variance(&kept));
        if rest < KEPT_VARIANCE * all {
            needed.extend(suspects.iter().filter(|i| (value[**i] - middle).powi(2) > all));
        }
    }
    needed
}

/// Joint angles, arrival directions, load and temperature of the dwells.
fn what_varies(whole: &Problem) -> Vec<Vec<f64>> {
    let column = |f: &dyn Fn(&DwellRow) -> f64| whole.dwells.iter().map(f).collect::<Vec<f64>>();
    let mut all = vec![column(&|d| d.load_kg)];
    all.extend(whole.dwells.iter().map(|d| d.temperature_c).collect::<Option<Vec<f64>>>());
    for j in 0..whole.joints() {
        all.push(column(&|d| d.joint_rad[j]));
        all.push(column(&|d| d.arrival[j]));
    }
    all
}

fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n)
}

/// Mean cosine between the residual of each suspect and that of the suspect next to it in joint space. Accidents point
/// anywhere; neighbours that err alike are a cause, but those within one accident: two dwells in which the same markers were
/// swapped.
fn mean_neighbour_cosine(problem: &Problem, left: &DVector<f64>, found: &[usize]) -> f64 {
    if found.len() < MIN_AGREEING {
        return 0.0;
    }
    let z = standardised_joints(problem);
    let rows = |i: usize| left.rows(problem.dwells[i].first_row, problem.dwells[i].rows);
    let mut sum = 0.0;
    for &i in found {
        let distance = |j: &usize| (z.row(i) - z.row(*j)).norm_squared();
        let own = &problem.dwells[i];
        let one_accident = |other: &DwellRow| {
            other.id.recording == own.id.recording && other.id.dwell.abs_diff(own.id.dwell) < RUN
        };
        let apart = |other: &DwellRow| other.measured_as(own) && !one_accident(other);
        let others = found.iter().copied().filter(|j| apart(&problem.dwells[*j]));
        if let Some(j) = others.min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            sum += rows(i).dot(&rows(j)) / (rows(i).norm() * rows(j).norm()).max(1e-300);
        }
    }
    sum / found.len() as f64
}

/// Dwells whose arrival direction looks wrong: turning it over would remove more than 25 sigma squared.
pub(crate) fn flipped_arrivals(problem: &Problem, residual: &[f64], signature: &[f64]) -> Vec<usize> {
    let change = |i: usize| -> f64 {
        // e - G theta with s turned over is e + G theta: a change of 4 e'G theta in the square.
        let d = &problem.dwells[i];
        d.range().map(|r| -4.0 * residual[r] * signature[r]).sum()
    };
    (0..problem.dwells.len())
        .filter(|i| change(*i) > 25.0 && problem.dwells[*i].arrival.iter().any(|s| *s != 0.0))
        .collect()
}

#[cfg(test)]
#[path = "../tests/outliers.rs"]
mod tests;
