//! The default cost and the scale of its residuals.
//!
//! `F(x) = sum_j rho(|e_j| / s) + 1/2 sum_k w_k x_k^2` with e_j the whitened residual of observation j, s the scale of
//! the residuals in units of the declared noise, and w the prior precision (1 in units of its own standard deviation).

use crate::objective::axes::Point;
use crate::objective::loss::{Loss, chi_median};
use crate::objective::products::gram;
use crate::objective::rows::{Derivative, Rows};
use crate::objective::solver::{Arrow, Cost, Curvature, Quadratic, gram_root, is_tall, root_of};
use crate::objective::structure::Structure;
use crate::objective::whitened::Whitened;
use crate::{CalibrateError, FitConfig, Objective};
use armcal_core::robust::median;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// The cost at a fixed scale.
pub(crate) struct RobustCost<'a, 'p> {
    pub white: &'a Whitened<'p>,
    pub huber_c: Option<f64>,
    /// s above.
    pub sigma_scale: f64,
    /// Whether the curvature of the loss is exact (fast near the minimum) or that of iteratively reweighted least
    /// squares (never too small, hence no overshooting far away).
    pub exact_curvature: bool,
    /// As [`Cost::ends_straight`].
    pub ends_straight: bool,
}

impl<'a, 'p> RobustCost<'a, 'p> {
    pub fn new(white: &'a Whitened<'p>, config: &FitConfig, sigma_scale: f64) -> RobustCost<'a, 'p> {
        let huber_c = (config.objective == Objective::Robust).then_some(config.huber_c);
        RobustCost { white, huber_c, sigma_scale, exact_curvature: true, ends_straight: !config.every_step }
    }

    /// All rows alike: its model has the squares of the derivative.
    pub fn plain(white: &'a Whitened<'p>) -> RobustCost<'a, 'p> {
        RobustCost { white, huber_c: None, sigma_scale: 1.0, exact_curvature: false, ends_straight: false }
    }

    pub fn loss(&self, block: usize) -> Loss {
        self.huber_c.map_or(Loss::Square, |c| Loss::huber(c, self.white.dimension(block)))
    }

    /// `|e_j| / s` of every observation.
    pub fn norms(&self, at: &Point) -> Vec<f64> {
        at.norms.iter().map(|norm| norm / self.sigma_scale).collect()
    }

    /// Weight of every observation, 1 = fully trusted.
    pub fn weights(&self, at: &Point) -> Vec<f64> {
        let norms = self.norms(at);
        norms.iter().enumerate().map(|(j, &u)| self.loss(j).weight(u)).collect()
    }
}

impl Whitened<'_> {
    /// `J'J` of the derivative at a point.
    pub fn squares(&self, at: &Point) -> Curvature {
        let parts = RobustCost::plain(self).parts(at);
        curvature(&self.structure, parts, DVector::zeros(self.axes.len()))
    }
}

impl Cost for RobustCost<'_, '_> {
    fn at(&self, x: DVector<f64>) -> Result<Point, CalibrateError> {
        self.white.at(x)
    }

    fn ends_straight(&self) -> bool {
        self.ends_straight
    }

    fn moved(&self, at: Point, x: DVector<f64>) -> Point {
        self.white.moved(at, x)
    }

    fn value(&self, at: &Point) -> f64 {
        let norms = self.norms(at);
        let data: f64 = norms.iter().enumerate().map(|(j, &u)| self.loss(j).rho(u)).sum();
        let prior: f64 = self.white.axes.iter().zip(at.x.iter()).map(|(a, x)| a.precision * x * x).sum();
        data + 0.5 * prior
    }

    /// Gauss-Newton in the model, exact in the loss: for an outlier `w (I - u u')` instead of `w I`, because Huber's
    /// loss has no curvature along the residual (Triggs et al. 2000, section 4.3, with rho'' from the table).
    fn model(&self, at: &Point) -> Quadratic {
        let (x, structure) = (&at.x, &self.white.structure);
        let precision =
            DVector::from_iterator(self.white.axes.len(), self.white.axes.iter().map(|a| a.precision));
        let parts = self.parts(at);
        let (mut gradient, mut damping) = (DVector::zeros(x.len()), DVector::zeros(x.len()));
        for (group, part) in parts.iter().enumerate() {
            for (k, axis) in structure.axes(group).enumerate() {
                gradient[axis] += part.gradient[k];
                damping[axis] += part.squares[k];
            }
        }
        gradient += precision.component_mul(x);
        damping += &precision;
        let hessian = curvature(structure, parts, precision);
        Quadratic { value: self.value(at), gradient, hessian, damping }
    }

    fn lower(&self) -> DVector<f64> {
        DVector::from_iterator(self.white.axes.len(), self.white.axes.iter().map(|a| a.lower))
    }

    fn upper(&self) -> DVector<f64> {
        DVector::from_iterator(self.white.axes.len(), self.white.axes.iter().map(|a| a.upper))
    }
}

/// The sum of the squares of all groups, with `diagonal` on its diagonal.
pub(crate) fn curvature(structure: &Arc<Structure>, parts: Vec<Part>, diagonal: DVector<f64>) -> Curvature {
    let mut of_data: Vec<DMatrix<f64>> = parts.into_iter().map(|part| part.curvature).collect();
    match of_data.pop() {
        Some(mut hessian) if structure.is_dense() => {
            (0..diagonal.len()).for_each(|k| hessian[(k, k)] += diagonal[k]);
            Curvature::Dense(hessian)
        }
        last => {
            of_data.extend(last);
            Curvature::Arrow(Arrow::new(structure.clone(), of_data, diagonal))
        }
    }
}

/// What the blocks of one group add to the model, over the group's columns.
pub(crate) struct Part {
    gradient: DVector<f64>,
    /// Diagonal of the curvature, without what outliers take from it.
    squares: DVector<f64>,
    /// The matrix itself where the structure is dense, otherwise the triangle that has it as its square.
    curvature: DMatrix<f64>,
}

impl RobustCost<'_, '_> {
    /// What every group adds to the model.
    pub fn parts(&self, at: &Point) -> Vec<Part> {
        self.white.each_group(|group| self.part(group, &at.groups[group]))
    }

    fn part(&self, group: usize, rows: &Rows) -> Part {
        let structure = &self.white.structure;
        let blocks = structure.groups[group].blocks.clone();
        let first = self.white.offsets[blocks.start];
        let mut lighter = Vec::new();
        for j in blocks {
            let (at, count) = (self.white.offsets[j] - first, self.white.dimension(j));
            let norm = rows.residual.rows(at, count).norm();
            let weight = self.loss(j).weight(norm / self.sigma_scale);
            if weight < 1.0 {
                lighter.push(Lighter { rows: at..at + count, weight, norm });
            }
        }
        let count = rows.residual.len();
        let are_few = 2 * lighter.iter().map(|l| l.rows.len()).sum::<usize>() <= count;
        if are_few && (structure.is_dense() || is_tall(count, rows.derivative.scale.len())) {
            self.part_by_squares(rows, &lighter)
        } else {
            self.part_by_rows(rows, &lighter)
        }
    }

    /// From the squares of all rows, and what those of the lighter blocks have less.
    fn part_by_squares(&self, rows: &Rows, lighter: &[Lighter]) -> Part {
        let Rows { residual, derivative } = rows;
        let usual = self.sigma_scale.powi(2).recip();
        let mut weighted = residual * usual;
        let mut less = Vec::new();
        for Lighter { rows, weight, .. } in lighter {
            weighted.rows_mut(rows.start, rows.len()).iter_mut().for_each(|row| *row *= weight);
            less.extend(rows.clone().map(|row| (row, ((1.0 - weight) * usual).sqrt())));
        }
        let gradient = derivative.products(&weighted);
        let less = derivative.some_rows(&less);
        let of_less = less.column_iter().map(|column| column.norm_squared());
        let mut curvature = derivative.squares() * usual;
        let squares = curvature.diagonal() - DVector::from_iterator(less.ncols(), of_less);
        curvature -= gram(&less);
        if self.exact_curvature {
            let along = |Lighter { rows, weight, norm }: &Lighter| {
                let own = residual.rows(rows.start, rows.len());
                (rows.start, own * ((weight * usual).sqrt() / norm))
            };
            curvature -= gram(&derivative.along(&lighter.iter().map(along).collect::<Vec<_>>()));
        }
        if !self.white.structure.is_dense() {
            curvature = root_of(curvature, residual.len(), || {
                let mut jacobian = self.lightened(derivative, lighter);
                self.straighten(&mut jacobian, residual, lighter);
                jacobian
            });
        }
        Part { gradient, squares, curvature }
    }

    /// Row by row.
    fn part_by_rows(&self, Rows { residual, derivative }: &Rows, lighter: &[Lighter]) -> Part {
        let mut jacobian = self.lightened(derivative, lighter);
        let mut scaled = residual / self.sigma_scale;
        lighter.iter().for_each(|l| scaled.rows_mut(l.rows.start, l.rows.len()).scale_mut(l.weight.sqrt()));
        let gradient = jacobian.tr_mul(&scaled);
        let squares = jacobian.column_iter().map(|column| column.norm_squared());
        let squares = DVector::from_iterator(jacobian.ncols(), squares);
        self.straighten(&mut jacobian, residual, lighter);
        let curvature = if self.white.structure.is_dense() { gram(&jacobian) } else { gram_root(jacobian) };
        Part { gradient, squares, curvature }
    }

    /// The derivative by x, each row times the root of its weight.
    fn lightened(&self, derivative: &Derivative, lighter: &[Lighter]) -> DMatrix<f64> {
        let mut jacobian = derivative.by_axis() / self.sigma_scale;
        for Lighter { rows, weight, .. } in lighter {
            jacobian.rows_mut(rows.start, rows.len()).scale_mut(weight.sqrt());
        }
        jacobian
    }

    /// Takes what lies along their residual u out of lighter rows, where curvature is exact: `I - u u'` is its own root.
    fn straighten(&self, jacobian: &mut DMatrix<f64>, residual: &DVector<f64>, lighter: &[Lighter]) {
        for Lighter { rows, norm, .. } in lighter.iter().filter(|_| self.exact_curvature) {
            let direction = residual.rows(rows.start, rows.len()) / *norm;
            let mut own = jacobian.rows_mut(rows.start, rows.len());
            let along = direction.transpose() * &own;
            own -= direction * along;
        }
    }
}

/// A block that weighs less than the others.
struct Lighter {
    rows: Range<usize>,
    weight: f64,
    /// Of its residual.
    norm: f64,
}

/// `sum_j E |psi|^2` under the declared noise.
fn expected_psi_square(cost: &RobustCost<'_, '_>) -> f64 {
    let mut blocks_of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for j in 0..cost.white.blocks() {
        blocks_of.entry(cost.white.dimension(j)).or_default().push(j);
    }
    let of_dimension = |(&dimension, blocks): (&usize, &Vec<usize>)| {
        cost.loss(blocks[0]).gaussian_psi_square(dimension) * (dimension * blocks.len()) as f64
    };
    blocks_of.iter().map(of_dimension).sum()
}

/// Scale of the residuals by the median norm: survives half of the observations being wrong.
pub(crate) fn median_scale(white: &Whitened<'_>, at: &Point) -> f64 {
    let norm = |(j, norm): (usize, &f64)| norm / chi_median(white.dimension(j));
    let norms: Vec<f64> = at.norms.iter().enumerate().map(norm).collect();
    median(&norms)
}

/// Scale of the residuals by Huber's proposal 2 (Huber and Ronchetti 2009, section 6.4), `p` fitted directions
/// allowed for: `sum |psi(e/s)|^2 = (1 - p/N) sum_j E|psi|^2`. As efficient as the fit itself, kept within a factor of
/// two of the median's answer, which is the more robust one.
pub(crate) fn proposal2_scale(cost: &RobustCost<'_, '_>, point: &Point, fitted: f64) -> f64 {
    let white = cost.white;
    let left = ((white.rows() as f64 - fitted) / white.rows() as f64).max(1.0 / white.rows() as f64);
    let start = median_scale(white, point) / left.sqrt();
    let expected = expected_psi_square(cost);
    if start <= 0.0 {
        // Most observations are met exactly: there is no scale to refine.
        return 0.0;
    }
    let mut scale = start;
    for _ in 0..100 {
        let at = RobustCost { sigma_scale: scale, ..*cost };
        let norms = at.norms(point);
        let psi: f64 = norms.iter().enumerate().map(|(j, &u)| (at.loss(j).weight(u) * u).powi(2)).sum();
        let next = (scale * (psi / (left * expected)).sqrt()).clamp(0.5 * start, 2.0 * start);
        let change = (next - scale).abs();
        scale = next;
        if change <= 1e-10 * scale {
            break;
        }
    }
    if cost.huber_c.is_none() {
        // Least squares: the root of the reduced chi-square itself.
        let squares: f64 = point.norms.iter().map(|norm| norm * norm).sum();
        return (squares / (left * white.rows() as f64)).sqrt();
    }
    scale
}
