//! What everything weighs under a kind and size of noise, from products alone: geometry, residual and a few scouts stand side
//! by side, and each noise makes one matrix of their products with each other.
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
use armcal_calibrate::gram;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Shares of a direction shorter than this are none.
const NO_DIRECTION: f64 = 1e-12;

/// Geometry, residual and scouts.
pub(crate) struct Trials<'p> {
    problem: &'p Problem,
    config: &'p DiagnosisConfig,
    /// Side by side, in the units of the weighing.
    columns: DMatrix<f64>,
    /// Their products under white noise.
    white: DMatrix<f64>,
    /// Which columns those of each scout are.
    scouts: Vec<Range<usize>>,
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
        let mut end = geometry + 1;
        let ranges = scouts.iter().map(|scout| {
            end += scout.len();
            end - scout.len()..end
        });
        let ranges: Vec<Range<usize>> = ranges.collect();
        let mut columns = DMatrix::zeros(problem.rows(), end);
        columns.columns_mut(0, geometry).zip_apply(&problem.geometry, |to, from| *to = from / scale);
        columns.column_mut(geometry).zip_apply(&problem.residual, |to, from| *to = from / scale);
        for (scout, range) in scouts.iter().zip(&ranges) {
            scout.write(&problem.dwells, 1.0 / scale, columns.columns_mut(range.start, range.len()));
        }
        Trials { problem, config, white: gram(&columns), columns, scouts: ranges }
    }

    /// A kind of noise, of any size.
    pub fn of(&self, noise: Noise) -> OfKind<'_> {
        OfKind { trials: self, noise, along: noise.direction(self.problem).map(|v| self.along(&v)) }
    }

    /// Of each dwell all columns along a direction, and the square of its length.
    fn along(&self, direction: &DVector<f64>) -> (DMatrix<f64>, Vec<f64>) {
        let dwells = &self.problem.dwells;
        let squares: Vec<f64> =
            dwells.iter().map(|d| direction.rows(d.first_row, d.rows).norm_squared()).collect();
        let mut along = DMatrix::zeros(dwells.len(), self.columns.ncols());
        for (column, mut out) in self.columns.column_iter().zip(along.column_iter_mut()) {
            for ((d, square), out) in dwells.iter().zip(&squares).zip(out.iter_mut()) {
                let own = direction.rows(d.first_row, d.rows);
                *out = own.dot(&column.rows(d.first_row, d.rows)) / square.max(NO_DIRECTION).sqrt();
            }
        }
        (along, squares)
    }
}

/// A kind of noise.
pub(crate) struct OfKind<'t> {
    trials: &'t Trials<'t>,
    /// Which.
    pub noise: Noise,
    along: Option<(DMatrix<f64>, Vec<f64>)>,
}

impl OfKind<'_> {
    /// ln (weight x evidence) of nothing against `white` noise, then of every scout; none where the noise widens what is
    /// declared and does not even say more of nothing.
    pub fn tried(&self, amplitude: f64, prior: f64, white: &Metric) -> Option<Vec<f64>> {
        let Trials { problem, config, scouts, .. } = self.trials;
        let (products, ln_det) = self.products(amplitude);
        let geometry = problem.geometry.ncols();
        let square = products.view((0, 0), (geometry, geometry)).into_owned();
        let with_residual = products.view((0, geometry), (geometry, 1)).column(0).into_owned();
        let of_residual = (with_residual, products[(geometry, geometry)]);
        let rough = Rough::new(square, of_residual, &problem.geometry_precision, &problem.geometry_offset);
        let nothing = ln_weight(prior, [ln_det, rough.ln_det, rough.rss], &white.projection, config);
        if self.noise.widens() && nothing <= white.ln_weight {
            return None;
        }
        let dof = rough.dof(problem.rows());
        let of_scout = |own: &Range<usize>| {
            let block = |from: usize, rows: usize| products.view((from, own.start), (rows, own.len()));
            let with_residual = block(geometry, 1).transpose().column(0).into_owned();
            let gram = rough.gram(
                &block(0, geometry).into_owned(),
                &with_residual,
                block(own.start, own.len()).into(),
            );
            nothing + ln_bayes(&gram, rough.rss, dof, config)
        };
        Some(std::iter::once(nothing).chain(scouts.iter().map(of_scout)).collect())
    }

    /// All products under this noise, and ln of the determinant of its covariance.
    fn products(&self, amplitude: f64) -> (DMatrix<f64>, f64) {
        let Trials { problem, columns, white, .. } = self.trials;
        let Some((along, squares)) = &self.along else {
            let whitener = Whitener::new(self.noise, amplitude, problem);
            let mut columns = columns.clone();
            whitener.apply(&mut columns);
            return (gram(&columns), whitener.ln_det);
        };
        let grown: Vec<f64> = squares.iter().map(|square| 1.0 + amplitude * amplitude * square).collect();
        let mut noise = along.clone();
        for mut column in noise.column_iter_mut() {
            column.iter_mut().zip(&grown).for_each(|(x, grown)| *x *= (1.0 - 1.0 / grown).sqrt());
        }
        (white - gram(&noise), grown.iter().map(|grown| grown.ln()).sum())
    }
}

#[cfg(test)]
#[path = "tests/trials.rs"]
mod tests;
