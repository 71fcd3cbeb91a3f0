//! Products of a base with functions at the dwells, weighed without being put together.
//!
//! With Q and e the projection's basis and residual, a column is `x = b f`, the rows of the base in each dwell times a function
//! there. Then `x'Q = sum_d f_d (b_d' Q_d)`, and so with `x'e` and `x'x`: of each dwell the products with the base are worked out
//! once, and what is asked of a column is a sum of them over dwells, weighted by its function. Of events it is a difference of two
//! running sums.

use crate::problem::DwellRow;
use crate::problem::columns::Columns;
use crate::problem::projection::{Gram, Projection};
use armcal_calibrate::inner_product;
use nalgebra::{DMatrix, DVectorView, DVectorViewMut};

/// The rows of a problem, its geometry projected out.
pub(crate) struct OnRows<'m> {
    pub dwells: &'m [DwellRow],
    pub projection: &'m Projection,
}

/// What the rows of each dwell say of a base of c columns.
pub(crate) struct ByDwell<'m> {
    on_rows: &'m OnRows<'m>,
    /// Columns of the base.
    columns: usize,
    /// Column i c + j: base column i times base column j: dwells x c^2.
    square: DMatrix<f64>,
    /// Times the residual: dwells x c.
    with_residual: DMatrix<f64>,
    /// Of each base column, times every column of Q: dwells x p.
    with_geometry: Vec<DMatrix<f64>>,
}

impl<'m> ByDwell<'m> {
    /// Of a base.
    pub fn of(base: &DMatrix<f64>, on_rows: &'m OnRows<'m>) -> ByDwell<'m> {
        let OnRows { dwells, projection: Projection { q, residual, .. } } = on_rows;
        let (n, c, p) = (dwells.len(), base.ncols(), q.ncols());
        let mut with_residual = DMatrix::zeros(n, c);
        let mut with_geometry = vec![DMatrix::zeros(n, p); c];
        // Nearly always all dwells have as many rows: products whose length is known take a fraction of the time.
        let alike = dwells.first().map(|d| d.rows).filter(|rows| dwells.iter().all(|d| d.rows == *rows));
        let dot =
            |a: DVectorView<'_, f64>, b: DVectorView<'_, f64>, mut products: DVectorViewMut<'_, f64>| {
                let (a, b, products) = (a.as_slice(), b.as_slice(), products.as_mut_slice());
                match alike {
                    Some(3) => dot_by::<3>(a, b, products),
                    Some(6) => dot_by::<6>(a, b, products),
                    _ => products.iter_mut().zip(*dwells).for_each(|(product, d)| {
                        *product = a[d.range()].iter().zip(&b[d.range()]).map(|(a, b)| a * b).sum();
                    }),
                }
            };
        for (i, of_base) in with_geometry.iter_mut().enumerate() {
            dot(base.column(i), residual.column(0), with_residual.column_mut(i));
            for (q, products) in q.column_iter().zip(of_base.column_iter_mut()) {
                dot(base.column(i), q, products);
            }
        }
        let mut square = DMatrix::zeros(n, c * c);
        for (k, products) in square.column_iter_mut().enumerate() {
            dot(base.column(k / c), base.column(k % c), products);
        }
        ByDwell { on_rows, columns: c, square, with_residual, with_geometry }
    }

    /// Of terms that are functions times this base.
    pub fn of_functions(&self, terms: &[&Columns], block: &[usize], each: &mut dyn FnMut(usize, &Gram)) {
        let functions = Columns::functions(block.iter().map(|k| terms[*k]));
        let width = functions.iter().map(|basis| basis.ncols()).sum();
        let mut stacked = DMatrix::zeros(self.with_residual.nrows(), width);
        let mut at = 0;
        for basis in &functions {
            stacked.columns_mut(at, basis.ncols()).copy_from(basis);
            at += basis.ncols();
        }
        let (projection, c) = (self.on_rows.projection, self.columns);
        let score = stacked.tr_mul(&self.with_residual);
        // Rows of Q' X, column by column of the base.
        let spent: Vec<DMatrix<f64>> =
            self.with_geometry.iter().map(|q| inner_product(q, &stacked)).collect();
        let mut at = 0;
        for (k, basis) in block.iter().zip(&functions) {
            let m = basis.ncols();
            let own = |i: usize| spent[i].columns(at, m);
            let mut gram = Gram::zeros(m * c, projection.q.ncols());
            for i in 0..c {
                let g = score.view((at, i), (m, 1)) - own(i).tr_mul(&projection.z);
                gram.g.rows_mut(i * m, m).copy_from(&g);
                gram.spent.columns_mut(i * m, m).copy_from(&own(i));
                for j in i..c {
                    let mut weighted = basis.as_ref().clone();
                    for mut column in weighted.column_iter_mut() {
                        column.component_mul_assign(&self.square.column(i * c + j));
                    }
                    let full = inner_product(basis, &weighted);
                    if i == j {
                        gram.raw.rows_mut(i * m, m).copy_from(&full.diagonal());
                    }
                    let left = full - inner_product(&own(i), &own(j));
                    gram.a.view_mut((j * m, i * m), (m, m)).copy_from(&left.transpose());
                    gram.a.view_mut((i * m, j * m), (m, m)).copy_from(&left);
                }
            }
            each(*k, &gram);
            at += m;
        }
    }

    /// Of terms that are this base in some of the dwells, differences of running sums.
    pub fn of_events(&self, terms: &[&Columns], events: &[usize], each: &mut dyn FnMut(usize, &Gram)) {
        let Some(Columns::Within { places, .. }) = events.first().map(|k| terms[*k]) else { return };
        let projection = self.on_rows.projection;
        let mut bounds: Vec<usize> = Vec::new();
        for k in events {
            if let Columns::Within { on, .. } = terms[*k] {
                bounds.extend([on.start, on.end]);
            }
        }
        bounds.sort_unstable();
        bounds.dedup();
        let sums = self.until(places, &bounds);
        let at = |place: usize| sums.column(bounds.partition_point(|bound| *bound < place));
        for k in events {
            let Columns::Within { on, .. } = terms[*k] else { continue };
            let (c, p) = (self.columns, projection.q.ncols());
            let within = at(on.end) - at(on.start);
            let full = DMatrix::from_column_slice(c, c, &within.as_slice()[..c * c]);
            let spent = DMatrix::from_column_slice(p, c, &within.as_slice()[c * c + c..]);
            let gram = Gram {
                raw: full.diagonal(),
                g: within.rows(c * c, c) - spent.tr_mul(&projection.z),
                a: full - spent.tr_mul(&spent),
                spent,
            };
            each(*k, &gram);
        }
    }

    /// Sums over the dwells before each of these places: `square`, `with_residual`, then `with_geometry`, a column a place.
    fn until(&self, places: &[usize], bounds: &[usize]) -> DMatrix<f64> {
        let c = self.columns;
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|d| places[*d]);
        let spent = self.with_geometry.iter().flat_map(DMatrix::column_iter);
        let all = self.square.column_iter().chain(self.with_residual.column_iter()).chain(spent);
        let mut sums = DMatrix::zeros(c * (c + 1 + self.on_rows.projection.q.ncols()), bounds.len());
        for (k, column) in all.enumerate() {
            let (mut sum, mut next) = (0.0, order.iter().peekable());
            for (b, bound) in bounds.iter().enumerate() {
                while let Some(d) = next.next_if(|d| places[**d] < *bound) {
                    sum += column[*d];
                }
                sums[(k, b)] = sum;
            }
        }
        sums
    }
}

/// Products of two columns dwell by dwell, each of so many rows.
fn dot_by<const ROWS: usize>(a: &[f64], b: &[f64], products: &mut [f64]) {
    let pairs = a.as_chunks::<ROWS>().0.iter().zip(b.as_chunks::<ROWS>().0);
    for (product, (a, b)) in products.iter_mut().zip(pairs) {
        *product = (0..ROWS).map(|k| a[k] * b[k]).sum();
    }
}
