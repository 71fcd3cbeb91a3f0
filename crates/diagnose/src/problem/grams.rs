//! Products of many columns with each other, the residual and the geometry.
//!
//! Products of a base with functions at the dwells ([`Columns`]) are weighed [by dwell](crate::problem::by_dwell), and not put together row
//! by row.

use crate::problem::Problem;
use crate::problem::by_dwell::{ByDwell, OnRows};
use crate::problem::columns::Columns;
use crate::problem::projection::{Gram, Projection};
use armcal_calibrate::inner_product;
use nalgebra::DMatrix;
use std::sync::Arc;

/// Numbers of columns that are put together into one matrix product: 8 MB, which stay in a processor's caches and need no new
/// pages from the system for each block.
const BLOCK_NUMBERS: usize = 1 << 20;

/// Calls `each` with the number and the [`Gram`] of every one of many sets of columns, times `factor`.
pub(crate) fn each_gram(
    terms: &[&Columns],
    problem: &Problem,
    factor: f64,
    projection: &Projection,
    each: &mut dyn FnMut(usize, &Gram),
) {
    let mut rest = Vec::new();
    let mut of_bases: Vec<(&Arc<DMatrix<f64>>, Vec<usize>)> = Vec::new();
    for (k, term) in terms.iter().enumerate() {
        match term.base() {
            None => rest.push(k),
            Some(base) => match of_bases.iter_mut().find(|(other, _)| Arc::ptr_eq(other, base)) {
                Some((_, own)) => own.push(k),
                None => of_bases.push((base, vec![k])),
            },
        }
    }
    if !of_bases.is_empty() {
        let on_rows = OnRows { dwells: &problem.dwells, projection };
        for (base, own) in of_bases {
            let by_dwell = ByDwell::of(&(base.as_ref() * factor), &on_rows);
            let is_event = |k: &usize| matches!(terms[*k], Columns::Within { .. });
            let (events, functions): (Vec<usize>, Vec<usize>) = own.into_iter().partition(is_event);
            by_dwell.of_events(terms, &events, each);
            for block in blocks(terms, &functions, problem.dwells.len()) {
                by_dwell.of_functions(terms, block, each);
            }
        }
    }
    for block in blocks(terms, &rest, problem.rows()) {
        dense_grams(terms, block, problem, factor, projection, each);
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
fn dense_grams(
    terms: &[&Columns],
    block: &[usize],
    problem: &Problem,
    factor: f64,
    projection: &Projection,
    each: &mut dyn FnMut(usize, &Gram),
) {
    let width = block.iter().map(|k| terms[*k].len()).sum();
    let mut stacked = DMatrix::zeros(problem.rows(), width);
    let mut at = 0;
    for t in block.iter().map(|k| terms[*k]) {
        t.write(&problem.dwells, factor, stacked.columns_mut(at, t.len()));
        at += t.len();
    }
    let spent = inner_product(&projection.q, &stacked);
    let score = stacked.tr_mul(&projection.residual) - spent.tr_mul(&projection.z);
    let mut at = 0;
    for k in block {
        let m = terms[*k].len();
        let (x, c) = (stacked.columns(at, m), spent.columns(at, m));
        let full = inner_product(&x, &x);
        let raw = full.diagonal();
        let (a, g) = (full - inner_product(&c, &c), score.rows(at, m).into_owned());
        let gram = Gram { raw, a, g, spent: c.into_owned() };
        each(*k, &gram);
        at += m;
    }
}

#[cfg(test)]
#[path = "../tests/grams.rs"]
pub(crate) mod tests;
