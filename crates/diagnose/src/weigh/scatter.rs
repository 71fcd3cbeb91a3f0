//! How what a fit leaves scatters: sizes and correlations, which say nothing of causes.

use crate::problem::projection::Projection;
use crate::problem::{DwellRow, Problem};
use armcal_calibrate::tails::chi2_tail;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A correlation at least so large, and so improbable by chance, is beyond doubt.
const CORRELATED: f64 = 0.2;
pub(crate) const IMPROBABLE: f64 = 1e-3;

/// The scatter of what a fit leaves, against what is declared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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
        Correlation::of_sums(product, rows, count)
    }

    /// From the sum of the products of so many rows of so many pairs.
    fn of_sums(product: f64, rows: f64, pairs: usize) -> Option<Correlation> {
        let value = product / rows;
        (pairs > 0).then(|| Correlation { value, p: chi2_tail(value * value * rows, 1.0), pairs })
    }

    /// Whether errors are alike beyond doubt.
    fn is_certain(&self) -> bool {
        self.value > CORRELATED && self.p < IMPROBABLE
    }
}

impl Scatter {
    /// Of a residual with noise of `scale` times the declared one.
    pub(crate) fn of(problem: &Problem, base: &Projection, scale: f64, residual: &DVector<f64>) -> Scatter {
        let share = base.dof() / residual.len().max(1) as f64;
        let ratio = |tracked: bool| {
            let dwells = problem.dwells.iter().flat_map(DwellRow::ranges);
            let rows = dwells.filter(|(part, _)| part.tracked == tracked).flat_map(|(_, rows)| rows);
            let (square, n) = rows.fold((0.0, 0.0), |(square, n), r| (square + residual[r].powi(2), n + 1.0));
            (n > 0.0).then(|| (square / n / share).sqrt() * scale)
        };
        let variance = residual.norm_squared() / residual.len().max(1) as f64;
        let unit = residual / variance.max(1e-300).sqrt();
        Scatter {
            sigma_ratio: (base.rss / base.dof()).sqrt() * scale,
            tracked_ratio: ratio(true),
            seated_ratio: ratio(false),
            tracked_neighbours: neighbour_correlation(problem, &unit, true),
            seated_neighbours: neighbour_correlation(problem, &unit, false),
            places: visit_correlation(problem, &unit),
        }
    }

    /// How alike dwells err to those before them.
    pub(crate) fn memory(&self) -> f64 {
        self.neighbours().map(|c| c.value).fold(0.0, f64::max)
    }

    fn neighbours(&self) -> impl Iterator<Item = Correlation> {
        [self.tracked_neighbours, self.seated_neighbours].into_iter().flatten()
    }

    /// Whether they do, beyond doubt.
    pub(crate) fn remembers(&self) -> bool {
        self.neighbours().any(|c| c.is_certain())
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
fn neighbour_correlation(problem: &Problem, residual: &DVector<f64>, tracked: bool) -> Option<Correlation> {
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

/// Of every two visits to a place, what was measured in either turned into the axes of the board. Of the visits v of a place the
/// products of every two are `(|sum v|^2 - sum |v|^2) / 2` together.
fn visit_correlation(problem: &Problem, residual: &DVector<f64>) -> Option<Correlation> {
    let mut places: BTreeMap<&str, (DVector<f64>, f64, usize)> = BTreeMap::new();
    for d in &problem.dwells {
        if let Some(place) = &d.place {
            let own = d.seat.tr_mul(&residual.rows(d.first_row, d.rows));
            let (sum, square, count) =
                places.entry(place).or_insert_with(|| (DVector::zeros(own.len()), 0.0, 0));
            (*square, *count) = (*square + own.norm_squared(), *count + 1);
            *sum += own;
        }
    }
    let (mut product, mut rows, mut pairs) = (0.0, 0.0, 0);
    for (sum, square, count) in places.values() {
        let of_place = count * (count - 1) / 2;
        product += 0.5 * (sum.norm_squared() - square);
        rows += (of_place * sum.len()) as f64;
        pairs += of_place;
    }
    Correlation::of_sums(product, rows, pairs)
}

#[cfg(test)]
#[path = "../tests/scatter.rs"]
mod tests;
