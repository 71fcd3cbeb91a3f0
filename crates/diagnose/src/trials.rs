//! What everything weighs under a kind and size of noise, from products alone: those of the geometry and the residual with each
//! other and with a few scouts, and of each scout with itself.
//!
//! Slack of a joint is a direction u in every dwell, of which a share s of what is seen along it is noise:
//!
//! ```text
//! (I + b^2 v v')^-1 = I - s u u',   s = b^2 v'v / (1 + b^2 v'v),   v = |v| u
//! ```
//!
//! so that its products are those of white noise without what the rows `u'x` of the dwells have of them, whatever the size b:
//! the rows are walked once for a joint.

use crate::columns::Columns;
use crate::config::DiagnosisConfig;
use crate::evidence::{Metric, ln_bayes, ln_weight};
use crate::noise::Noise;
use crate::problem::Problem;
use crate::projection::Rough;
use crate::whitener::Whitener;
use armcal_calibrate::{gram, inner};
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Shares of a direction shorter than this are none.
const NO_DIRECTION: f64 = 1e-12;

/// Geometry, residual and scouts.
pub(crate) struct Trials<'p> {
    problem: &'p Problem,
    config: &'p DiagnosisConfig,
    /// In the units of the weighing.
    rows: Rows,
    /// Their products under white noise.
    white: Products,
    /// Which columns those of each scout are.
    scouts: Vec<Range<usize>>,
}

/// Everything that is tried: all its rows, or of each dwell what lies along a direction.
struct Rows {
    /// The geometry, and the residual behind it.
    base: DMatrix<f64>,
    /// The scouts side by side.
    scouts: DMatrix<f64>,
}

/// Products under a noise.
struct Products {
    /// Of the base with itself.
    base: DMatrix<f64>,
    /// Of the base with all scouts.
    with_scouts: DMatrix<f64>,
    /// Of each scout with itself.
    scouts: Vec<DMatrix<f64>>,
}

impl<'p> Trials<'p> {
    /// Of a problem whose residual noise is `scale` times the declared one.
    pub fn new(
        scouts: &[&Columns],
        problem: &'p Problem,
        scale: f64,
        config: &'p DiagnosisConfig,
    ) -> Trials<'p> {
        let geometry = problem.geometry.ncols();
        let mut base = DMatrix::zeros(problem.rows(), geometry + 1);
        base.columns_mut(0, geometry).zip_apply(&problem.geometry, |to, from| *to = from / scale);
        base.column_mut(geometry).zip_apply(&problem.residual, |to, from| *to = from / scale);
        let mut end = 0;
        let ranges = scouts.iter().map(|scout| {
            end += scout.len();
            end - scout.len()..end
        });
        let ranges: Vec<Range<usize>> = ranges.collect();
        let mut side_by_side = DMatrix::zeros(problem.rows(), end);
        for (scout, range) in scouts.iter().zip(&ranges) {
            scout.write(&problem.dwells, 1.0 / scale, side_by_side.columns_mut(range.start, range.len()));
        }
        let rows = Rows { base, scouts: side_by_side };
        let white = Products {
            base: gram(&rows.base),
            with_scouts: inner(&rows.base, &rows.scouts),
            scouts: ranges.iter().map(|own| square(&rows.scouts, own, None)).collect(),
        };
        Trials { problem, config, rows, white, scouts: ranges }
    }

    /// A kind of noise, of any size.
    pub fn of(&self, noise: Noise) -> OfKind<'_> {
        OfKind { trials: self, noise, along: noise.direction(self.problem).map(|v| self.along(&v)) }
    }

    /// Of each dwell everything along a direction, and the square of its length.
    fn along(&self, direction: &DVector<f64>) -> (Rows, Vec<f64>) {
        let dwells = &self.problem.dwells;
        let squares: Vec<f64> =
            dwells.iter().map(|d| direction.rows(d.first_row, d.rows).norm_squared()).collect();
        let along = |columns: &DMatrix<f64>| {
            let mut along = DMatrix::zeros(dwells.len(), columns.ncols());
            for (column, mut out) in columns.column_iter().zip(along.column_iter_mut()) {
                for ((d, square), out) in dwells.iter().zip(&squares).zip(out.iter_mut()) {
                    let own = direction.rows(d.first_row, d.rows);
                    *out = own.dot(&column.rows(d.first_row, d.rows)) / square.max(NO_DIRECTION).sqrt();
                }
            }
            along
        };
        (Rows { base: along(&self.rows.base), scouts: along(&self.rows.scouts) }, squares)
    }
}

/// Products of some of these columns with each other, each row weighted.
fn square(columns: &DMatrix<f64>, own: &Range<usize>, weights: Option<&[f64]>) -> DMatrix<f64> {
    let columns = columns.columns(own.start, own.len());
    let Some(weights) = weights else { return columns.tr_mul(&columns) };
    let mut weighted = columns.into_owned();
    scale_rows(&mut weighted, weights);
    columns.tr_mul(&weighted)
}

fn scale_rows(columns: &mut DMatrix<f64>, factors: &[f64]) {
    for mut column in columns.column_iter_mut() {
        column.iter_mut().zip(factors).for_each(|(x, factor)| *x *= factor);
    }
}

/// A kind of noise.
pub(crate) struct OfKind<'t> {
    trials: &'t Trials<'t>,
    /// Which.
    pub noise: Noise,
    along: Option<(Rows, Vec<f64>)>,
}

/// A kind of noise of one size.
enum Sized<'t> {
    /// Of each dwell a share of what it has along a direction is noise: what is along it, the base times these shares, and the
    /// shares.
    Shares(&'t Rows, DMatrix<f64>, Vec<f64>),
    /// The base, whitened.
    Whitened(Whitener, DMatrix<f64>),
}

impl OfKind<'_> {
    /// ln (weight x evidence) of nothing against `white` noise, then of every scout; none where the noise widens what is
    /// declared and does not even say more of nothing.
    pub fn tried(&self, amplitude: f64, prior: f64, white: &Metric) -> Option<Vec<f64>> {
        let Trials { problem, config, scouts, .. } = self.trials;
        let (sized, ln_det) = self.sized(amplitude);
        let base = self.of_base(&sized);
        let geometry = problem.geometry.ncols();
        let square = base.view((0, 0), (geometry, geometry)).into_owned();
        let with_residual = base.view((0, geometry), (geometry, 1)).column(0).into_owned();
        let of_residual = (with_residual, base[(geometry, geometry)]);
        let rough = Rough::new(square, of_residual, &problem.geometry_precision, &problem.geometry_offset);
        let nothing = ln_weight(prior, [ln_det, rough.ln_det, rough.rss], &white.projection, config);
        if self.noise.widens() && nothing <= white.ln_weight {
            return None;
        }
        let dof = rough.dof(problem.rows());
        let (with_scouts, squares) = self.of_scouts(&sized);
        let of_scout = |(own, square): (&Range<usize>, DMatrix<f64>)| {
            let block = |from: usize, rows: usize| with_scouts.view((from, own.start), (rows, own.len()));
            let with_residual = block(geometry, 1).transpose().column(0).into_owned();
            let gram = rough.gram(&block(0, geometry).into_owned(), &with_residual, square);
            nothing + ln_bayes(&gram, rough.rss, dof, config)
        };
        Some(std::iter::once(nothing).chain(scouts.iter().zip(squares).map(of_scout)).collect())
    }

    /// The noise of one size, and ln of the determinant of its covariance.
    fn sized(&self, amplitude: f64) -> (Sized<'_>, f64) {
        let Trials { problem, rows, .. } = self.trials;
        let Some((along, squares)) = &self.along else {
            let whitener = Whitener::new(self.noise, amplitude, problem);
            let mut base = rows.base.clone();
            whitener.apply(&mut base);
            let ln_det = whitener.ln_det;
            return (Sized::Whitened(whitener, base), ln_det);
        };
        let grown: Vec<f64> = squares.iter().map(|square| 1.0 + amplitude * amplitude * square).collect();
        let shares: Vec<f64> = grown.iter().map(|grown| 1.0 - 1.0 / grown).collect();
        let mut noise = along.base.clone();
        scale_rows(&mut noise, &shares);
        (Sized::Shares(along, noise, shares), grown.iter().map(|grown| grown.ln()).sum())
    }

    /// Products of the base with itself.
    fn of_base(&self, sized: &Sized<'_>) -> DMatrix<f64> {
        match sized {
            Sized::Shares(along, noise, _) => &self.trials.white.base - inner(noise, &along.base),
            Sized::Whitened(_, base) => gram(base),
        }
    }

    /// Products of the base with all scouts, and of each scout with itself.
    fn of_scouts(&self, sized: &Sized<'_>) -> (DMatrix<f64>, Vec<DMatrix<f64>>) {
        let Trials { rows, white, scouts, .. } = self.trials;
        match sized {
            Sized::Shares(along, noise, shares) => {
                let of_white = scouts.iter().zip(&white.scouts);
                let squares = of_white.map(|(own, all)| all - square(&along.scouts, own, Some(shares)));
                (&white.with_scouts - inner(noise, &along.scouts), squares.collect())
            }
            Sized::Whitened(whitener, base) => {
                let mut of_noise = rows.scouts.clone();
                whitener.apply(&mut of_noise);
                let squares = scouts.iter().map(|own| square(&of_noise, own, None));
                (inner(base, &of_noise), squares.collect())
            }
        }
    }
}

#[cfg(test)]
#[path = "tests/trials.rs"]
mod tests;
