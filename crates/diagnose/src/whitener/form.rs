//! A whitener as a quadratic form, for columns that nobody puts together.
//!
//! With W the whitener, `x'W'Wx = |F x|^2 - sum_g |S_g' x|^2`: F is all but what the last step takes out of groups of dwells, which
//! has a rank of three a group. Where F keeps dwells apart, all of it is a sum over dwells.

use super::{Kind, Whitener};
use crate::problem::DwellRow;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// `|F x|^2 - sum_g |S_g' x|^2` of columns x.
#[derive(Debug)]
pub(crate) struct Form<'w> {
    filters: &'w [Kind],
    /// Then each row times this; where there is none, as it is.
    factors: Option<DVector<f64>>,
    /// The `S_g`.
    pub shares: Vec<Shares>,
}

/// What is taken out of a group of dwells.
#[derive(Debug)]
pub(crate) struct Shares {
    /// The dwells.
    pub dwells: Vec<usize>,
    /// Of each, S: its rows x rank.
    pub of_dwell: Vec<DMatrix<f64>>,
}

impl Whitener {
    /// As a form, for columns over the rows of these dwells.
    pub fn form(&self, dwells: &[DwellRow]) -> Form<'_> {
        let all = match &self.kind {
            Kind::Then(all) => all.as_slice(),
            one => std::slice::from_ref(one),
        };
        let Some((Kind::Groups(unit, groups), filters)) = all.split_last() else {
            return Form { filters: all, factors: None, shares: Vec::new() };
        };
        let rows = dwells.last().map_or(0, |d| d.range().end);
        let mut factors = DVector::from_element(rows, 1.0);
        // Groups share no row: all of them stand in one matrix. Where a filter remembers there is one alone, of all rows.
        let rank = groups.iter().map(|(_, p)| p.ncols()).max().unwrap_or(0);
        let mut s = DMatrix::zeros(rows, rank);
        for (own, p) in groups {
            own.iter().for_each(|row| factors[*row] = *unit);
            // (I - P P')^2 = I - S S', the columns of P being orthogonal.
            for (mut to, from) in s.column_iter_mut().zip(p.column_iter()) {
                let size = unit * (2.0 - from.norm_squared()).sqrt();
                own.iter().zip(from.iter()).for_each(|(row, from)| to[*row] = size * from);
            }
        }
        filters.iter().rev().for_each(|one| one.apply_transposed(&mut s));
        let of_row: BTreeMap<usize, usize> =
            dwells.iter().enumerate().map(|(i, d)| (d.first_row, i)).collect();
        let of_group = |(own, p): &(Vec<usize>, DMatrix<f64>)| {
            let members: Vec<usize> = own.iter().filter_map(|row| of_row.get(row).copied()).collect();
            let of_dwell = |i: &usize| {
                let DwellRow { first_row, rows, .. } = dwells[*i];
                s.view((first_row, 0), (rows, p.ncols())).into_owned()
            };
            Shares { of_dwell: members.iter().map(of_dwell).collect(), dwells: members }
        };
        let shares = groups.iter().map(of_group).collect();
        Form { filters, factors: Some(factors), shares }
    }
}

impl Form<'_> {
    /// Whether F whitens rows of a dwell by themselves.
    pub fn keeps_dwells_apart(&self) -> bool {
        self.filters.iter().all(Kind::keeps_dwells_apart)
    }

    /// Columns times F, in place.
    pub fn filter(&self, columns: &mut DMatrix<f64>) {
        self.filters.iter().for_each(|one| one.apply(columns));
        if let Some(factors) = &self.factors {
            columns.column_iter_mut().for_each(|mut column| column.component_mul_assign(factors));
        }
    }
}
