//! Products of many columns with each other, the residual and the geometry, under one noise.
//!
//! Products of a base with functions at the dwells ([`Columns`]) are not put together row by row where the noise keeps dwells
//! apart: of each dwell `b'b`, `b'e` and `b'Q` are worked out once for a base, and what is asked of a column is a sum of
//! them over dwells, weighted by its function. Of events it is a difference of two running sums.

use crate::columns::Columns;
use crate::evidence::Metric;
use crate::problem::Problem;
use crate::projection::{Gram, Projection};
use armcal_calibrate::inner;
use nalgebra::{DMatrix, DVectorView, DVectorViewMut};
use std::sync::Arc;

/// Numbers of columns that are put together into one matrix product: 8 MB, which stay in a processor's caches and need no new
/// pages from the system for each block.
const BLOCK_NUMBERS: usize = 1 << 20;

/// Calls `each` with the number and the [`Gram`] of every one of many sets of columns, times `factor`.
pub(crate) fn each_gram(
    terms: &[&Columns],
    problem: &Problem,
    factor: f64,
    metric: &Metric,
    each: &mut dyn FnMut(usize, &Gram),
) {
    let mut rest = Vec::new();
    let mut of_bases: Vec<(&Arc<DMatrix<f64>>, Vec<usize>)> = Vec::new();
    for (k, term) in terms.iter().enumerate() {
        match term.base().filter(|_| metric.whitener.keeps_dwells_apart()) {
            None => rest.push(k),
            Some(base) => match of_bases.iter_mut().find(|(other, _)| Arc::ptr_eq(other, base)) {
                Some((_, own)) => own.push(k),
                None => of_bases.push((base, vec![k])),
            },
        }
    }
    for (base, own) in of_bases {
        let by_dwell = ByDwell::of(&metric.whitened(base.as_ref() * factor), problem, &metric.projection);
        let (events, functions): (Vec<usize>, Vec<usize>) =
            own.into_iter().partition(|k| matches!(terms[*k], Columns::Within { .. }));
        by_dwell.of_events(terms, &events, each);
        for block in blocks(terms, &functions, problem.dwells.len()) {
            by_dwell.of_functions(terms, block, each);
        }
    }
    for block in blocks(terms, &rest, problem.rows()) {
        dense(terms, block, problem, factor, metric, each);
    }
}

/// Runs of these terms of at most [`BLOCK_NUMBERS`] numbers at so many to a column.
fn blocks<'k>(terms: &[&Columns], which: &'k [usize], height: usize) -> Vec<&'k [usize]> {
    let most = BLOCK_NUMBERS / height.max(1);
    let (mut all, mut from) = (Vec::new(), 0);
    while from < which.len() {
        let (mut to, mut width) = (from, 0);
        while to < which.len() && (to == from || width + terms[which[to]].len() <= most) {
            width += terms[which[to]].len();
            to += 1;
        }
        all.push(&which[from..to]);
        from = to;
    }
    all
}

/// Row by row.
fn dense(
    terms: &[&Columns],
    block: &[usize],
    problem: &Problem,
    factor: f64,
    metric: &Metric,
    each: &mut dyn FnMut(usize, &Gram),
) {
    let width = block.iter().map(|k| terms[*k].len()).sum();
    let mut stacked = DMatrix::zeros(problem.rows(), width);
    let mut at = 0;
    for t in block.iter().map(|k| terms[*k]) {
        t.write(&problem.dwells, factor, stacked.columns_mut(at, t.len()));
        at += t.len();
    }
    let white = metric.whitened(stacked);
    let projection = &metric.projection;
    let spent = inner(&projection.q, &white);
    let score = white.tr_mul(&projection.residual) - spent.tr_mul(&projection.z);
    let mut at = 0;
    for k in block {
        let m = terms[*k].len();
        let (x, c) = (white.columns(at, m), spent.columns(at, m));
        let full = inner(&x, &x);
        let raw = full.diagonal();
        let (a, g) = (full - inner(&c, &c), score.rows(at, m).into_owned());
        let gram = Gram { raw, a, g, spent: c.into_owned() };
        each(*k, &gram);
        at += m;
    }
}

/// What the rows of each dwell say of a base of c whitened columns.
struct ByDwell<'p> {
    projection: &'p Projection,
    c: usize,
    /// Column i c + j: base column i times base column j: dwells x c^2.
    square: DMatrix<f64>,
    /// Times the residual: dwells x c.
    with_residual: DMatrix<f64>,
    /// Of each base column, times every column of the projection's `q`: dwells x p.
    with_geometry: Vec<DMatrix<f64>>,
}

impl<'p> ByDwell<'p> {
    fn of(base: &DMatrix<f64>, problem: &Problem, projection: &'p Projection) -> ByDwell<'p> {
        let (n, c, p) = (problem.dwells.len(), base.ncols(), projection.q.ncols());
        let mut by_dwell = ByDwell {
            projection,
            c,
            square: DMatrix::zeros(n, c * c),
            with_residual: DMatrix::zeros(n, c),
            with_geometry: vec![DMatrix::zeros(n, p); c],
        };
        let dwells = &problem.dwells;
        // Nearly always all dwells have as many rows: products whose length is known take a fraction of the time.
        let alike = dwells.first().map(|d| d.rows).filter(|rows| dwells.iter().all(|d| d.rows == *rows));
        let dot =
            |a: DVectorView<'_, f64>, b: DVectorView<'_, f64>, mut products: DVectorViewMut<'_, f64>| {
                let (a, b, products) = (a.as_slice(), b.as_slice(), products.as_mut_slice());
                match alike {
                    Some(3) => dot_by::<3>(a, b, products),
                    Some(6) => dot_by::<6>(a, b, products),
                    _ => products.iter_mut().zip(dwells).for_each(|(product, d)| {
                        *product = a[d.range()].iter().zip(&b[d.range()]).map(|(a, b)| a * b).sum();
                    }),
                }
            };
        for i in 0..c {
            let own = base.column(i);
            dot(own, projection.residual.column(0), by_dwell.with_residual.column_mut(i));
            for j in 0..c {
                dot(own, base.column(j), by_dwell.square.column_mut(i * c + j));
            }
            let of_base = &mut by_dwell.with_geometry[i];
            for (q, products) in projection.q.column_iter().zip(of_base.column_iter_mut()) {
                dot(own, q, products);
            }
        }
        by_dwell
    }

    /// Of terms that are functions times this base.
    fn of_functions(&self, terms: &[&Columns], block: &[usize], each: &mut dyn FnMut(usize, &Gram)) {
        let functions = Columns::functions(block.iter().map(|k| terms[*k]));
        let width = functions.iter().map(|basis| basis.ncols()).sum();
        let mut stacked = DMatrix::zeros(self.square.nrows(), width);
        let mut at = 0;
        for basis in &functions {
            stacked.columns_mut(at, basis.ncols()).copy_from(basis);
            at += basis.ncols();
        }
        let score = stacked.tr_mul(&self.with_residual);
        // Rows of Q' X, column by column of the base.
        let spent: Vec<DMatrix<f64>> = self.with_geometry.iter().map(|q| inner(q, &stacked)).collect();
        let mut at = 0;
        for (k, basis) in block.iter().zip(&functions) {
            let m = basis.ncols();
            let own = |i: usize| spent[i].columns(at, m);
            let mut gram = Gram::zeros(m * self.c, self.projection.q.ncols());
            for i in 0..self.c {
                let g = score.view((at, i), (m, 1)) - own(i).tr_mul(&self.projection.z);
                gram.g.rows_mut(i * m, m).copy_from(&g);
                gram.spent.columns_mut(i * m, m).copy_from(&own(i));
                for j in i..self.c {
                    let mut weighted = basis.as_ref().clone();
                    for mut column in weighted.column_iter_mut() {
                        column.component_mul_assign(&self.square.column(i * self.c + j));
                    }
                    let full = inner(basis, &weighted);
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

    /// Of terms that are this base in some of the dwells.
    fn of_events(&self, terms: &[&Columns], events: &[usize], each: &mut dyn FnMut(usize, &Gram)) {
        let Some(Columns::Within { places, .. }) = events.first().map(|k| terms[*k]) else { return };
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
            let (c, p) = (self.c, self.projection.q.ncols());
            let within = at(on.end) - at(on.start);
            let full = DMatrix::from_column_slice(c, c, &within.as_slice()[..c * c]);
            let spent = DMatrix::from_column_slice(p, c, &within.as_slice()[c * c + c..]);
            let gram = Gram {
                raw: full.diagonal(),
                g: within.rows(c * c, c) - spent.tr_mul(&self.projection.z),
                a: full - spent.tr_mul(&spent),
                spent,
            };
            each(*k, &gram);
        }
    }

    /// Sums over the dwells before each of these places: `square`, `with_residual`, then `with_geometry`, a column a place.
    fn until(&self, places: &[usize], bounds: &[usize]) -> DMatrix<f64> {
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|d| places[*d]);
        let spent = self.with_geometry.iter().flat_map(DMatrix::column_iter);
        let all = self.square.column_iter().chain(self.with_residual.column_iter()).chain(spent);
        let mut sums = DMatrix::zeros(self.c * (self.c + 1 + self.projection.q.ncols()), bounds.len());
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

#[cfg(test)]
#[path = "tests/grams.rs"]
pub(crate) mod tests;
