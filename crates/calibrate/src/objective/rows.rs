//! Whitened rows and their derivative, kept by parameter in SI: priors that are learnt change the units of x and nothing else, so
//! that one derivative, and the sum of its squares, serve all the fits in which it stays.

use crate::objective::products::gram;
use nalgebra::{DMatrix, DVector};
use std::sync::{Arc, OnceLock};

/// The rows of one group of blocks.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    /// Whitened.
    pub residual: DVector<f64>,
    pub derivative: Derivative,
}

/// `d residual / dx_k = rows.column(k) * scale[k]`.
#[derive(Debug, Clone)]
pub(crate) struct Derivative {
    /// By each parameter of the group's axes, SI.
    pub rows: Arc<ByParameter>,
    /// SI per unit of each axis.
    pub scale: DVector<f64>,
}

/// A derivative by parameters, and its squares once somebody asked.
#[derive(Debug)]
pub(crate) struct ByParameter {
    pub(crate) matrix: DMatrix<f64>,
    squares: OnceLock<DMatrix<f64>>,
}

impl ByParameter {
    pub(crate) fn new(matrix: DMatrix<f64>) -> Arc<ByParameter> {
        Arc::new(ByParameter { matrix, squares: OnceLock::new() })
    }

    /// `J'J`.
    pub(crate) fn squares(&self) -> &DMatrix<f64> {
        self.squares.get_or_init(|| gram(&self.matrix))
    }
}

impl Derivative {
    /// By x: rows x axes.
    pub fn by_axis(&self) -> DMatrix<f64> {
        let mut matrix = self.rows.matrix.clone();
        matrix.column_iter_mut().zip(&self.scale).for_each(|(mut column, scale)| column *= *scale);
        matrix
    }

    /// By x of some rows, each times a factor.
    pub fn some_rows(&self, of: &[(usize, f64)]) -> DMatrix<f64> {
        let mut some = DMatrix::zeros(of.len(), self.scale.len());
        let columns = self.rows.matrix.column_iter().zip(&self.scale);
        for (mut to, (column, scale)) in some.column_iter_mut().zip(columns) {
            to.iter_mut().zip(of).for_each(|(to, (row, factor))| *to = column[*row] * (factor * scale));
        }
        some
    }

    /// `d' J` over the rows of blocks by x, of each the first row and d given: blocks x axes.
    pub fn along(&self, blocks: &[(usize, DVector<f64>)]) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(blocks.len(), self.scale.len());
        let columns = self.rows.matrix.column_iter().zip(&self.scale);
        for (mut to, (column, scale)) in all.column_iter_mut().zip(columns) {
            for (to, (at, d)) in to.iter_mut().zip(blocks) {
                *to = scale * column.rows(*at, d.len()).dot(d);
            }
        }
        all
    }

    /// `J'J`.
    pub fn squares(&self) -> DMatrix<f64> {
        let mut squares = self.rows.squares().clone();
        for (c, mut column) in squares.column_iter_mut().enumerate() {
            // One factor for both, so that the matrix stays symmetric to the last bit.
            column.iter_mut().zip(&self.scale).for_each(|(square, scale)| *square *= scale * self.scale[c]);
        }
        squares
    }

    /// `J'v`.
    pub fn products(&self, v: &DVector<f64>) -> DVector<f64> {
        self.rows.matrix.tr_mul(v).component_mul(&self.scale)
    }

    /// `J d`.
    pub fn times(&self, d: &DVector<f64>) -> DVector<f64> {
        &self.rows.matrix * d.component_mul(&self.scale)
    }
}

/// The derivative of a problem whose derivative stays, group by group as far as anybody asked: each with where the columns of the
/// problem stand in it.
#[derive(Debug)]
pub struct Kept(Vec<OnceLock<OfGroup>>);

/// The derivative of a group, and which columns of the problem it has.
#[derive(Debug)]
struct OfGroup {
    columns: Vec<Option<usize>>,
    rows: Arc<ByParameter>,
}

impl Kept {
    /// Nothing yet, of so many groups.
    pub(crate) fn of(groups: usize) -> Kept {
        Kept((0..groups).map(|_| OnceLock::new()).collect())
    }

    /// That of a group over these columns.
    pub(crate) fn find(&self, group: usize, columns: &[Option<usize>]) -> Option<Arc<ByParameter>> {
        let known = self.0.get(group)?.get()?;
        (known.columns == columns).then(|| known.rows.clone())
    }

    /// The first one that is told stays.
    pub(crate) fn keep(&self, group: usize, columns: &[Option<usize>], rows: &Arc<ByParameter>) {
        if let Some(place) = self.0.get(group) {
            let _ = place.set(OfGroup { columns: columns.to_vec(), rows: rows.clone() });
        }
    }
}
