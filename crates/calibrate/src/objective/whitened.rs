//! The problem as the solvers see it: free parameters in units of their prior, residuals in units of their noise.

use crate::objective::axes::{Axis, Point, axes_and_start};
use crate::objective::problem::{Linearised, Problem};
use crate::objective::rows::{ByParameter, Derivative, Rows};
use crate::objective::structure::Structure;
use crate::{CalibrateError, FitConfig};
use armcal_core::Parameter;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// A [`Problem`] whitened at its start values, over its free parameters.
pub(crate) struct Whitened<'a> {
    pub problem: Box<dyn Problem + 'a>,
    pub axes: Vec<Axis>,
    /// Full parameter vector at the start; fixed parameters stay there.
    pub start: Vec<f64>,
    /// Inverse Cholesky factor of each block's covariance.
    whitener: Vec<DMatrix<f64>>,
    /// First row of each block in the stacked residual, and one past the last.
    pub offsets: Vec<usize>,
    /// Which parameters single groups of blocks have for themselves.
    pub structure: Arc<Structure>,
}

impl<'a> Whitened<'a> {
    /// Whitens `problem` at `start`, with the parameters `free` of it free.
    pub fn new(
        problem: Box<dyn Problem + 'a>,
        start: &[f64],
        free: &dyn Fn(&Parameter) -> bool,
        config: &FitConfig,
    ) -> Result<Whitened<'a>, CalibrateError> {
        let (axes, start) = axes_and_start(problem.as_ref(), start, free, config)?;
        let inverse = |block| {
            inverse_cholesky(problem.covariance(block, &start))
                .ok_or_else(|| CalibrateError::BadCovariance { observation: problem.name(block) })
        };
        let whitener = (0..problem.blocks()).map(inverse).collect::<Result<_, _>>()?;
        Ok(Whitened::over(problem, axes, start, whitener))
    }

    /// The same where the inverse Cholesky factor of each block's covariance is known.
    pub fn in_noise(
        problem: Box<dyn Problem + 'a>,
        start: &[f64],
        free: &dyn Fn(&Parameter) -> bool,
        whitener: Vec<DMatrix<f64>>,
        config: &FitConfig,
    ) -> Result<Whitened<'a>, CalibrateError> {
        let (axes, start) = axes_and_start(problem.as_ref(), start, free, config)?;
        Ok(Whitened::over(problem, axes, start, whitener))
    }

    /// The same over these axes, whose start is within their bounds.
    fn over(
        problem: Box<dyn Problem + 'a>,
        axes: Vec<Axis>,
        start: Vec<f64>,
        whitener: Vec<DMatrix<f64>>,
    ) -> Whitened<'a> {
        let structure = Structure::of(problem.as_ref(), &axes).into();
        Whitened { offsets: offsets(&whitener), problem, axes, start, whitener, structure }
    }

    /// Inverse Cholesky factor of each block's covariance.
    pub fn into_whitener(self) -> Vec<DMatrix<f64>> {
        self.whitener
    }

    pub fn rows(&self) -> usize {
        *self.offsets.last().unwrap_or(&0)
    }

    pub fn blocks(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Rows of one block.
    pub fn dimension(&self, block: usize) -> usize {
        self.offsets[block + 1] - self.offsets[block]
    }

    /// Start in units of x, within the bounds.
    pub fn start(&self) -> DVector<f64> {
        DVector::from_iterator(self.axes.len(), self.axes.iter().map(|a| a.at(self.start[a.index])))
    }

    /// Full parameter vector at x.
    pub fn parameters_at(&self, x: &DVector<f64>) -> Vec<f64> {
        let mut p = self.start.clone();
        for (a, x) in self.axes.iter().zip(x.iter()) {
            // The start and a bound are met exactly, not to rounding.
            let parameter = &self.problem.parameters()[a.index];
            p[a.index] = if *x == a.at(self.start[a.index]) {
                self.start[a.index]
            } else if *x <= a.lower {
                parameter.lower
            } else if *x >= a.upper {
                parameter.upper
            } else {
                a.centre + a.scale * x
            };
        }
        p
    }

    /// Linearises at x.
    pub fn at(&self, x: DVector<f64>) -> Result<Point, CalibrateError> {
        let p = self.parameters_at(&x);
        let groups = self.each_group(|group| self.linearised_group(&p, group));
        let groups = groups.into_iter().collect::<Result<Vec<_>, _>>()?;
        Ok(self.point(x, groups))
    }

    /// A point with these rows.
    fn point(&self, x: DVector<f64>, groups: Vec<Rows>) -> Point {
        let rows = groups.iter().flat_map(|rows| rows.residual.iter().copied());
        let residual = DVector::from_iterator(self.rows(), rows);
        let norm = |block| residual.rows(self.offsets[block], self.dimension(block)).norm();
        let norms = (0..self.blocks()).map(norm).collect();
        Point { x, norms, residual, groups }
    }

    /// A point moved to x along its linearisation.
    pub fn moved(&self, at: Point, x: DVector<f64>) -> Point {
        let step = &x - &at.x;
        let mut groups = at.groups;
        for (group, rows) in groups.iter_mut().enumerate() {
            let own = self.structure.axes(group).map(|axis| step[axis]);
            rows.residual += rows.derivative.times(&own.collect::<Vec<f64>>().into());
        }
        self.point(x, groups)
    }

    /// Something of every group of blocks, in their order.
    pub fn each_group<T: Send>(&self, of: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
        let count = self.structure.groups.len();
        if count == 1 { vec![of(0)] } else { (0..count).into_par_iter().map(of).collect() }
    }

    /// Position residuals [m] of all blocks and their derivative by x, neither whitened.
    pub fn distances(&self, x: &DVector<f64>) -> Result<Vec<Linearised>, CalibrateError> {
        let p = self.parameters_at(x);
        let mut blocks = Vec::with_capacity(self.blocks());
        for block in 0..self.blocks() {
            let (raw, full) = self.problem.linearised(block, &p);
            let rows = raw.len().min(3);
            let jacobian = DMatrix::from_fn(rows, self.axes.len(), |r, c| {
                full[(r, self.axes[c].index)] * self.axes[c].scale
            });
            self.finite(block, raw.as_slice(), "the residual")?;
            self.finite(block, jacobian.as_slice(), "the derivative")?;
            blocks.push((raw.rows(0, rows).into_owned(), jacobian));
        }
        Ok(blocks)
    }

    /// Norms of the position residuals [m].
    pub fn distance_norms(&self, x: &DVector<f64>) -> Result<Vec<f64>, CalibrateError> {
        let p = self.parameters_at(x);
        let mut norms = Vec::with_capacity(self.blocks());
        let mut add = |_, raw: &[f64]| norms.push(raw.iter().take(3).map(|v| v * v).sum::<f64>().sqrt());
        self.residual_each(0..self.blocks(), &p, &mut add)?;
        Ok(norms)
    }

    /// The derivative of all residuals by x.
    pub fn jacobian(&self, at: &Point) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.rows(), self.axes.len());
        for (group, rows) in at.groups.iter().enumerate() {
            let first = self.offsets[self.structure.groups[group].blocks.start];
            let part = rows.derivative.by_axis();
            for (axis, column) in self.structure.axes(group).zip(part.column_iter()) {
                jacobian.view_mut((first, axis), (part.nrows(), 1)).copy_from(&column);
            }
        }
        jacobian
    }

    /// The rows of one group at parameters `p`, with the columns of its own axes, then those of the shared ones.
    fn linearised_group(&self, p: &[f64], group: usize) -> Result<Rows, CalibrateError> {
        let columns = &self.structure.groups[group].columns;
        let axes = self.structure.axes(group).map(|axis| self.axes[axis].scale);
        let scale = DVector::from_iterator(columns.len(), axes);
        let straight = self.problem.straight();
        if let Some(rows) = straight.and_then(|kept| kept.find(group, columns)) {
            let residual = self.residual_of_group(p, group)?;
            return Ok(Rows { residual, derivative: Derivative { rows, scale } });
        }
        let (residual, matrix) = self.by_parameter(p, group)?;
        let rows = ByParameter::new(matrix);
        if let Some(kept) = straight {
            kept.keep(group, columns, &rows);
        }
        Ok(Rows { residual, derivative: Derivative { rows, scale } })
    }

    /// The residual of one group alone.
    fn residual_of_group(&self, p: &[f64], group: usize) -> Result<DVector<f64>, CalibrateError> {
        let blocks = self.structure.groups[group].blocks.clone();
        let first = self.offsets[blocks.start];
        let mut stacked = DVector::zeros(self.offsets[blocks.end] - first);
        self.residual_each(blocks, p, &mut |block, raw| {
            let at = self.offsets[block] - first;
            whiten(&self.whitener[block], raw, &mut stacked.as_mut_slice()[at..at + raw.len()]);
        })?;
        Ok(stacked)
    }

    /// The residuals of these blocks, not whitened, as far as they are finite.
    fn residual_each(
        &self,
        blocks: Range<usize>,
        p: &[f64],
        each: &mut dyn FnMut(usize, &[f64]),
    ) -> Result<(), CalibrateError> {
        let mut done = Ok(());
        self.problem.residual_each(blocks, p, &mut |block, raw| {
            if done.is_ok() {
                done = self.finite(block, raw, "the residual");
            }
            if done.is_ok() {
                each(block, raw);
            }
        });
        done
    }

    /// The residual of one group, and its derivative by the parameter of each of the group's axes.
    fn by_parameter(&self, p: &[f64], group: usize) -> Result<Linearised, CalibrateError> {
        let at_group = &self.structure.groups[group];
        let first = self.offsets[at_group.blocks.start];
        let height = self.offsets[at_group.blocks.end] - first;
        let (mut stacked, mut jacobian) =
            (DVector::zeros(height), DMatrix::zeros(height, at_group.columns.len()));
        // Of a pool a group knows few of all parameters.
        let asked = |column: usize| at_group.columns.contains(&Some(column));
        // Where a column is among those that are told, where it goes, and its parameter.
        let told = self.structure.axes(group).zip(&at_group.columns).enumerate();
        let told: Vec<(usize, usize, usize)> = told
            .filter_map(|(to, (axis, known))| Some(((*known)?, to * height, self.axes[axis].index)))
            .collect();
        let mut done = Ok(());
        let mut put = |block: usize, (raw, full): &Linearised| {
            self.finite(block, raw.as_slice(), "the residual")?;
            let (at, rows) = (self.offsets[block] - first, raw.len());
            let white = &self.whitener[block];
            whiten(white, raw.as_slice(), &mut stacked.as_mut_slice()[at..at + rows]);
            let (full, out) = (full.as_slice(), jacobian.as_mut_slice());
            let suspect = !all_finite(full);
            for (known, to, index) in &told {
                let raw = &full[known * rows..(known + 1) * rows];
                if suspect && !all_finite(raw) {
                    return Err(self.not_finite(block, "the derivative", Some(*index)));
                }
                whiten(white, raw, &mut out[to + at..to + at + rows]);
            }
            Ok(())
        };
        self.problem.linearised_each(at_group.blocks.clone(), p, &asked, &mut |block, linearised| {
            if done.is_ok() {
                done = put(block, &linearised);
            }
        });
        done?;
        Ok((stacked, jacobian))
    }

    fn finite(&self, block: usize, values: &[f64], what: &'static str) -> Result<(), CalibrateError> {
        if all_finite(values) { Ok(()) } else { Err(self.not_finite(block, what, None)) }
    }

    fn not_finite(&self, block: usize, what: &'static str, parameter: Option<usize>) -> CalibrateError {
        let name = |i: usize| format!(" with respect to `{}`", self.problem.parameters()[i].name);
        CalibrateError::NotFinite {
            observation: self.problem.name(block),
            what,
            parameter: parameter.map(name).unwrap_or_default(),
            joint_rad: self.problem.joint_rad(block).to_vec(),
        }
    }
}

/// First row of each block, and one past the last.
fn offsets(whitener: &[DMatrix<f64>]) -> Vec<usize> {
    let mut offsets = vec![0];
    whitener.iter().for_each(|block| offsets.push(offsets[offsets.len() - 1] + block.nrows()));
    offsets
}

/// Without a branch for each value: nearly always the answer is yes.
fn all_finite(values: &[f64]) -> bool {
    values.iter().fold(true, |all, v| all & v.is_finite())
}

/// `white * raw`, white lower triangular. Three rows, all that a block of most calibrations has, are written out: products whose
/// size is not known take several times as long.
fn whiten(white: &DMatrix<f64>, raw: &[f64], out: &mut [f64]) {
    if let ([x, y, z], [a, b, c], [xx, yx, zx, _, yy, zy, _, _, zz]) = (raw, &mut *out, white.as_slice()) {
        *a = xx * x;
        *b = yx * x + yy * y;
        *c = zx * x + zy * y + zz * z;
        return;
    }
    for (r, out) in out.iter_mut().enumerate() {
        *out = raw[..=r].iter().enumerate().map(|(c, v)| white[(r, c)] * v).sum();
    }
}

fn inverse_cholesky(covariance: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let factor = covariance.cholesky()?.unpack();
    factor.solve_lower_triangular(&DMatrix::identity(factor.nrows(), factor.ncols()))
}
