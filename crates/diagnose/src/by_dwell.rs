//! Products of a base with functions at the dwells, weighed without being put together.
//!
//! With W the whitener, Q and e the projection's basis and residual, a column is `x = b f`, the rows of the base in each dwell times
//! a function there. Then `x'W'Q = sum_d f_d (b_d' (W'Q)_d)`, and so with `W'e`: of each dwell the products with the base are worked
//! out once, and what is asked of a column is a sum of them over dwells, weighted by its function. `x'W'Wx` is such a sum too, less
//! squares of such sums, where the whitener's [form](crate::whitener::Form) keeps dwells apart; where it remembers them, columns are
//! filtered, and nothing else is done row by row. Of events that are sums alone all of it is a difference of two running sums.

use crate::columns::{Columns, write_product};
use crate::evidence::Metric;
use crate::problem::{DwellRow, Problem};
use crate::projection::{Gram, Projection};
use crate::whitener::{Form, Shares};
use armcal_calibrate::inner;
use nalgebra::{DMatrix, DVectorView, DVectorViewMut};
use std::borrow::Cow;

/// What a metric asks of rows that are not whitened.
pub(crate) struct OnRows<'m> {
    dwells: &'m [DwellRow],
    projection: &'m Projection,
    form: Form<'m>,
    /// `W'Q`.
    q: Cow<'m, DMatrix<f64>>,
    /// `W'e`, a column.
    residual: DMatrix<f64>,
}

impl<'m> OnRows<'m> {
    /// Of this metric of a problem.
    pub fn of(metric: &'m Metric, problem: &'m Problem) -> OnRows<'m> {
        let Metric { whitener, projection, .. } = metric;
        let mut residual =
            DMatrix::from_column_slice(projection.residual.len(), 1, projection.residual.as_slice());
        let mut q = Cow::Borrowed(&projection.q);
        if !whitener.is_plain() {
            whitener.apply_transposed(&mut residual);
            whitener.apply_transposed(q.to_mut());
        }
        let form = whitener.form(&problem.dwells);
        OnRows { dwells: &problem.dwells, projection, form, q, residual }
    }
}

/// What the rows of each dwell say of a base of c columns.
pub(crate) struct ByDwell<'m> {
    on_rows: &'m OnRows<'m>,
    base: DMatrix<f64>,
    /// Column i c + j: base column i times base column j, as the form filters them: dwells x c^2; none where it remembers dwells.
    square: Option<DMatrix<f64>>,
    /// Times the residual: dwells x c.
    with_residual: DMatrix<f64>,
    /// Of each base column, times every column of Q: dwells x p.
    with_geometry: Vec<DMatrix<f64>>,
    /// Of each base column, times what is taken out of each group of dwells: rank x dwells of the group.
    with_shares: Vec<Vec<DMatrix<f64>>>,
}

impl<'m> ByDwell<'m> {
    /// Of a base that is not whitened.
    pub fn of(base: DMatrix<f64>, on_rows: &'m OnRows<'m>) -> ByDwell<'m> {
        let OnRows { dwells, form, q, residual, .. } = on_rows;
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
        let square = form.keeps_dwells_apart().then(|| {
            let mut filtered = base.clone();
            form.filter(&mut filtered);
            let mut square = DMatrix::zeros(n, c * c);
            for (k, products) in square.column_iter_mut().enumerate() {
                dot(filtered.column(k / c), filtered.column(k % c), products);
            }
            square
        });
        let of_share = |share: &Shares, i: usize| {
            let own = share.of_dwell.iter().zip(&share.dwells);
            let columns: Vec<_> = own
                .map(|(s, d)| s.tr_mul(&base.column(i).rows(dwells[*d].first_row, dwells[*d].rows)))
                .collect();
            DMatrix::from_columns(&columns)
        };
        let with_shares =
            (0..c).map(|i| form.shares.iter().map(|share| of_share(share, i)).collect()).collect();
        ByDwell { on_rows, base, square, with_residual, with_geometry, with_shares }
    }

    /// Whether all that is asked of a column is a sum over dwells.
    pub fn is_sum(&self) -> bool {
        self.square.is_some() && self.on_rows.form.shares.is_empty()
    }

    /// Numbers that a column takes while it is weighed.
    pub fn height(&self) -> usize {
        let rows = if self.square.is_some() { self.on_rows.dwells.len() } else { self.base.nrows() };
        rows.max(self.taken())
    }

    /// Numbers that are taken out of a column, over all groups of dwells.
    fn taken(&self) -> usize {
        self.with_shares.first().map_or(0, |groups| groups.iter().map(DMatrix::nrows).sum())
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
        let (projection, c) = (self.on_rows.projection, self.base.ncols());
        let score = stacked.tr_mul(&self.with_residual);
        // Rows of Q' X, column by column of the base.
        let spent: Vec<DMatrix<f64>> = self.with_geometry.iter().map(|q| inner(q, &stacked)).collect();
        let shares: Vec<DMatrix<f64>> = (0..c).map(|i| self.shares_of(i, &stacked)).collect();
        let filtered: Vec<DMatrix<f64>> = match &self.square {
            Some(_) => Vec::new(),
            None => (0..c).map(|i| self.filtered(i, &stacked)).collect(),
        };
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
                    let mut full = match &self.square {
                        Some(square) => {
                            let mut weighted = basis.as_ref().clone();
                            for mut column in weighted.column_iter_mut() {
                                column.component_mul_assign(&square.column(i * c + j));
                            }
                            inner(basis, &weighted)
                        }
                        None => inner(&filtered[i].columns(at, m), &filtered[j].columns(at, m)),
                    };
                    if self.taken() > 0 {
                        full -= inner(&shares[i].columns(at, m), &shares[j].columns(at, m));
                    }
                    if i == j {
                        gram.raw.rows_mut(i * m, m).copy_from(&full.diagonal());
                    }
                    let left = full - inner(&own(i), &own(j));
                    gram.a.view_mut((j * m, i * m), (m, m)).copy_from(&left.transpose());
                    gram.a.view_mut((i * m, j * m), (m, m)).copy_from(&left);
                }
            }
            each(*k, &gram);
            at += m;
        }
    }

    /// What is taken out of each group of dwells, of a base column times functions.
    fn shares_of(&self, i: usize, functions: &DMatrix<f64>) -> DMatrix<f64> {
        let groups = &self.on_rows.form.shares;
        let mut taken = DMatrix::zeros(self.taken(), functions.ncols());
        for (function, mut taken) in functions.column_iter().zip(taken.column_iter_mut()) {
            let (function, mut rest) = (function.as_slice(), taken.as_mut_slice());
            for (group, products) in groups.iter().zip(&self.with_shares[i]) {
                let (own, others) = rest.split_at_mut(products.nrows());
                for (d, product) in
                    group.dwells.iter().zip(products.as_slice().chunks_exact(own.len().max(1)))
                {
                    own.iter_mut().zip(product).for_each(|(own, product)| *own += product * function[*d]);
                }
                rest = others;
            }
        }
        taken
    }

    /// A base column times functions, row by row as the form filters them.
    fn filtered(&self, i: usize, functions: &DMatrix<f64>) -> DMatrix<f64> {
        let mut rows = DMatrix::zeros(self.base.nrows(), functions.ncols());
        for (function, mut rows) in functions.column_iter().zip(rows.column_iter_mut()) {
            let values = self.on_rows.dwells.iter().zip(function.iter().copied());
            write_product(self.base.column(i).as_slice(), values, rows.as_mut_slice());
        }
        self.on_rows.form.filter(&mut rows);
        rows
    }

    /// Of terms that are this base in some of the dwells, where all is a sum.
    pub fn of_events(&self, terms: &[&Columns], events: &[usize], each: &mut dyn FnMut(usize, &Gram)) {
        let Some(Columns::Within { places, .. }) = events.first().map(|k| terms[*k]) else { return };
        let Some(square) = &self.square else { return };
        let projection = self.on_rows.projection;
        let mut bounds: Vec<usize> = Vec::new();
        for k in events {
            if let Columns::Within { on, .. } = terms[*k] {
                bounds.extend([on.start, on.end]);
            }
        }
        bounds.sort_unstable();
        bounds.dedup();
        let sums = self.until(square, places, &bounds);
        let at = |place: usize| sums.column(bounds.partition_point(|bound| *bound < place));
        for k in events {
            let Columns::Within { on, .. } = terms[*k] else { continue };
            let (c, p) = (self.base.ncols(), projection.q.ncols());
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
    fn until(&self, square: &DMatrix<f64>, places: &[usize], bounds: &[usize]) -> DMatrix<f64> {
        let c = self.base.ncols();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|d| places[*d]);
        let spent = self.with_geometry.iter().flat_map(DMatrix::column_iter);
        let all = square.column_iter().chain(self.with_residual.column_iter()).chain(spent);
        let mut sums = DMatrix::zeros(c * (c + 1 + self.on_rows.q.ncols()), bounds.len());
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
