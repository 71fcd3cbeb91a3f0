//! Taking out what the geometry could do: `M = I - Q Q'` over data rows and prior rows (notes 4.1, formula 5).
//!
//! The prior rows are never stored: a column of data `g` is `[g; 0]`, so products in the projected space need the
//! data rows of Q alone. With `z = Q' e_a`,
//!
//! ```text
//! g~'h~ = g'h - (Q'g)'(Q'h),   g~'e~ = g'e - (Q'g)'z,   e~'e~ = e'e + prior - z'z
//! ```
//!
//! Q comes from a Cholesky factor of the normal equations, applied twice (CholeskyQR2; Yamamoto et al., ETNA 44,
//! 2015), which is as orthogonal as Householder's and a matrix product fast.

use armcal_calibrate::{gram, inner_product};
use nalgebra::{DMatrix, DVector};

/// Geometry projected out of one set of whitened rows.
#[derive(Debug, Clone)]
pub(crate) struct Projection {
    /// Data rows of Q: rows x p.
    pub q: DMatrix<f64>,
    /// `Q' e_a`.
    pub z: DVector<f64>,
    /// The whitened residual before projection.
    pub residual: DVector<f64>,
    /// `e~'e~`.
    pub rss: f64,
    /// Effective number of parameters: what the data, not the prior, decide.
    pub effective_parameters: f64,
}

/// Products of some columns with themselves and with the residual, geometry projected out.
#[derive(Debug, Clone)]
pub(crate) struct Gram {
    /// `G~'G~`.
    pub a: DMatrix<f64>,
    /// `G~'e~`.
    pub g: DVector<f64>,
    /// Squared norms of the columns before projection.
    pub raw: DVector<f64>,
    /// `Q'G`: what the geometry takes over.
    pub spent: DMatrix<f64>,
}

impl Gram {
    /// Of so many columns, nothing yet.
    pub fn zeros(columns: usize, geometry: usize) -> Gram {
        Gram {
            a: DMatrix::zeros(columns, columns),
            g: DVector::zeros(columns),
            raw: DVector::zeros(columns),
            spent: DMatrix::zeros(geometry, columns),
        }
    }
}

impl Projection {
    /// `geometry` with prior precision `precision` and offsets `offset` in its units; `residual` at that point.
    pub fn new(
        geometry: DMatrix<f64>,
        precision: &DVector<f64>,
        offset: &DVector<f64>,
        residual: DVector<f64>,
    ) -> Projection {
        let p = geometry.ncols();
        let root = precision.map(|v| v.max(1e-12).sqrt());
        let mut data = geometry;
        let mut prior = DMatrix::from_diagonal(&root);
        for _ in 0..2 {
            let normal = gram(&data) + gram(&prior);
            let factor = cholesky_upper(normal);
            let inverse = factor
                .solve_upper_triangular(&DMatrix::identity(p, p))
                .unwrap_or_else(|| DMatrix::identity(p, p));
            data = &data * &inverse;
            prior = &prior * &inverse;
        }
        let prior_residual = -offset.component_mul(&root);
        let z = data.tr_mul(&residual) + prior.tr_mul(&prior_residual);
        let rss = residual.norm_squared() + prior_residual.norm_squared() - z.norm_squared();
        let effective_parameters = data.norm_squared();
        Projection { q: data, z, rss: rss.max(1e-12), effective_parameters, residual }
    }

    /// Variance of the residual (declared noise = 1) once something took so much of its square.
    pub fn variance_without(&self, square: f64) -> f64 {
        (self.rss - square).max(0.0) / self.dof()
    }

    /// Degrees of freedom left.
    pub fn dof(&self) -> f64 {
        (self.residual.len() as f64 - self.effective_parameters).max(1.0)
    }

    /// Data rows of the projected residual.
    pub fn projected_residual(&self) -> DVector<f64> {
        &self.residual - &self.q * &self.z
    }

    /// Data rows of projected columns.
    pub fn project(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        columns - &self.q * inner_product(&self.q, columns)
    }

    /// Products of columns in the projected space.
    pub fn gram(&self, columns: &DMatrix<f64>) -> Gram {
        let c = inner_product(&self.q, columns);
        let full = gram(columns);
        Gram {
            raw: full.diagonal(),
            a: full - gram(&c),
            g: columns.tr_mul(&self.residual) - c.tr_mul(&self.z),
            spent: c,
        }
    }
}

/// Upper Cholesky factor of a positive semi-definite matrix, with a ridge that grows until it exists.
pub(crate) fn cholesky_upper(normal: DMatrix<f64>) -> DMatrix<f64> {
    let size = normal.diagonal().iter().fold(f64::MIN_POSITIVE, |a: f64, v| a.max(*v));
    let mut ridge = 0.0;
    for _ in 0..40 {
        let mut m = normal.clone();
        (0..m.nrows()).for_each(|k| m[(k, k)] += ridge);
        if let Some(factor) = m.cholesky() {
            return factor.l().transpose();
        }
        ridge = if ridge == 0.0 { size * 1e-15 } else { ridge * 10.0 };
    }
    DMatrix::identity(normal.nrows(), normal.nrows())
}

/// Eigenvalues (not negative) and eigenvectors of a Gram matrix; those of rounding are set to zero.
pub(crate) fn gram_eigen(a: &DMatrix<f64>, raw_norm: f64) -> (DVector<f64>, DMatrix<f64>) {
    let eigen = a.clone().symmetric_eigen();
    let floor = 1e-9 * raw_norm.max(f64::MIN_POSITIVE);
    (eigen.eigenvalues.map(|v| if v > floor { v } else { 0.0 }), eigen.eigenvectors)
}

/// The solution of a symmetric system of which `upper` is the Cholesky factor; a singular one is left as it is.
pub(crate) fn solve_cholesky(upper: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let half = upper.tr_solve_upper_triangular(right).unwrap_or_else(|| right.clone());
    upper.solve_upper_triangular(&half).unwrap_or(half)
}
