//! How what a fit leaves scatters: sizes and correlations, which say nothing of causes.

use crate::problem::{DwellRow, Problem};
use crate::weigh::Weighed;
use armcal_calibrate::tails::chi2_tail;
use nalgebra::DVector;
use serde::Serialize;
use std::collections::BTreeMap;

/// A correlation at least so large, and so improbable by chance, is beyond doubt.
const CORRELATED: f64 = 0.2;
const IMPROBABLE: f64 = 1e-3;

/// The scatter of what a fit leaves, against what is declared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scatter {
    /// Its standard deviation over the declared one.
    pub sigma_ratio: f64,
    /// The same of dwells that the position sensor saw, and of those that a cavity held; none where there are none.
    pub tracked_ratio: Option<f64>,
    /// Of those that a cavity held.
    pub seated_ratio: Option<f64>,
    /// How alike tracked dwells err that follow one another at other places.
    pub tracked_neighbours: Option<Correlation>,
    /// The same of seated ones.
    pub seated_neighbours: Option<Correlation>,
    /// How alike visits to one place err, in the axes of the board.
    pub places: Option<Correlation>,
}

/// A correlation between errors of pairs of dwells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Correlation {
    /// Its value.
    pub value: f64,
    /// Its p-value (normal approximation, two-sided).
    pub p: f64,
    /// Of so many pairs.
    pub pairs: usize,
}

impl Correlation {
    /// Of pairs of independent errors of unit variance, none of no pairs.
    fn of(pairs: impl Iterator<Item = (DVector<f64>, DVector<f64>)>) -> Option<Correlation> {
        let (mut product, mut rows, mut count) = (0.0, 0.0, 0);
        for (a, b) in pairs {
            product += a.dot(&b);
            rows += a.len() as f64;
            count += 1;
        }
        let value = product / rows;
        (count > 0).then(|| Correlation { value, p: chi2_tail(value * value * rows, 1.0), pairs: count })
    }

    /// Whether errors are alike beyond doubt.
    fn is_certain(&self) -> bool {
        self.value > CORRELATED && self.p < IMPROBABLE
    }
}

impl Scatter {
    /// Of a residual in the units of a weighed problem.
    pub(crate) fn of(problem: &Problem, weighed: &Weighed, residual: &DVector<f64>) -> Scatter {
        let base = &weighed.base;
        let share = base.dof() / residual.len().max(1) as f64;
        let ratio = |tracked: bool| {
            let dwells = problem.dwells.iter().flat_map(DwellRow::ranges);
            let rows = dwells.filter(|(part, _)| part.tracked == tracked).flat_map(|(_, rows)| rows);
            let (square, n) = rows.fold((0.0, 0.0), |(square, n), r| (square + residual[r].powi(2), n + 1.0));
            (n > 0.0).then(|| (square / n / share).sqrt() * weighed.scale)
        };
        let variance = residual.norm_squared() / residual.len().max(1) as f64;
        let unit = residual / variance.max(1e-300).sqrt();
        Scatter {
            sigma_ratio: (base.rss / base.dof()).sqrt() * weighed.scale,
            tracked_ratio: ratio(true),
            seated_ratio: ratio(false),
            tracked_neighbours: neighbours(problem, &unit, true),
            seated_neighbours: neighbours(problem, &unit, false),
            places: visits(problem, &unit),
        }
    }

    /// How alike dwells err to those before them.
    pub(crate) fn memory(&self) -> f64 {
        let neighbours = [self.tracked_neighbours, self.seated_neighbours].into_iter().flatten();
        neighbours.map(|c| c.value).fold(0.0, f64::max)
    }

    /// Whether they do, beyond doubt.
    pub(crate) fn remembers(&self) -> bool {
        [self.tracked_neighbours, self.seated_neighbours].iter().flatten().any(Correlation::is_certain)
    }

    /// Whether visits to one place err alike, beyond doubt.
    pub(crate) fn repeats(&self) -> bool {
        self.places.is_some_and(|c| c.is_certain())
    }

    /// What errs alike beyond doubt, the clearest, and what does that.
    pub(crate) fn alike(&self) -> Option<String> {
        let drifts = "a sensor or a frame that drifts does that";
        let all = [
            (self.places, "visits to a place", "err alike", "seats and cavities off their place do that"),
            (self.tracked_neighbours, "tracked dwells", "err alike over neighbours in time", drifts),
            (self.seated_neighbours, "seated dwells", "err alike over neighbours in time", drifts),
        ];
        let certain = all.into_iter().filter_map(|(c, who, how, why)| Some((c?, who, how, why)));
        let clear = |c: &Correlation| c.value * c.value * c.pairs as f64;
        let clearest =
            certain.filter(|(c, ..)| c.is_certain()).max_by(|a, b| clear(&a.0).total_cmp(&clear(&b.0)));
        clearest.map(|(c, who, how, why)| format!("{who} {how} (correlation {:.2}): {why}", c.value))
    }
}

/// Of dwells that follow one another in a recording, at other places, all of which was tracked, or seated.
fn neighbours(problem: &Problem, residual: &DVector<f64>, tracked: bool) -> Option<Correlation> {
    let mut order: Vec<&DwellRow> = problem.dwells.iter().collect();
    order.retain(|d| d.parts.iter().all(|part| part.tracked == tracked));
    order.sort_by_key(|d| d.id);
    Correlation::of(order.windows(2).filter_map(|w| {
        let (a, b) = (w[0], w[1]);
        let elsewhere = a.place.is_none() || a.place != b.place;
        let width = a.rows_as_in(b);
        let rows = |d: &DwellRow| residual.rows(d.first_row, width).into_owned();
        (a.id.recording == b.id.recording && elsewhere && width > 0).then(|| (rows(a), rows(b)))
    }))
}

/// Of every two visits to a place, what was measured in either turned into the axes of the board.
fn visits(problem: &Problem, residual: &DVector<f64>) -> Option<Correlation> {
    let mut places: BTreeMap<&str, Vec<DVector<f64>>> = BTreeMap::new();
    for d in &problem.dwells {
        if let Some(place) = &d.place {
            places.entry(place).or_default().push(d.seat.tr_mul(&residual.rows(d.first_row, d.rows)));
        }
    }
    let of_place = |all: Vec<DVector<f64>>| {
        let pairs = (0..all.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        pairs.map(|(i, j)| (all[i].clone(), all[j].clone())).collect::<Vec<_>>()
    };
    Correlation::of(places.into_values().flat_map(of_place))
}

#[cfg(test)]
#[path = "tests/scatter.rs"]
mod tests;
