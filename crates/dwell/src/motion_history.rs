//! The past of a joint's readings, looked through from its end.

use std::ops::Range;

/// Rows per block of the summary that lets pauses and long ways be passed over.
const BLOCK: usize = 64;

/// What is looked back at: readings of one joint, or those of two joints together.
#[derive(Clone, Copy)]
enum Readings<'a> {
    One(&'a [f64]),
    /// `of + sense * and`.
    Two {
        of: &'a [f64],
        and: &'a [f64],
        sense: f64,
    },
}

impl Readings<'_> {
    fn len(&self) -> usize {
        match self {
            Readings::One(column) => column.len(),
            Readings::Two { of, and, .. } => of.len().min(and.len()),
        }
    }

    fn at(&self, row: usize) -> f64 {
        match self {
            Readings::One(column) => column[row],
            Readings::Two { of, and, sense } => of[row] + sense * and[row],
        }
    }

    /// Smallest and largest of these rows.
    fn extremes(&self, rows: Range<usize>) -> (f64, f64) {
        rows.map(|row| self.at(row))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), q| (q.min(lo), q.max(hi)))
    }
}

/// A column of readings, prepared for questions about its past.
pub(crate) struct Past<'a> {
    readings: Readings<'a>,
    /// Smallest and largest reading of each block.
    blocks: Vec<(f64, f64)>,
}

impl<'a> Past<'a> {
    /// Of one joint.
    pub(crate) fn of(column: &'a [f64]) -> Past<'a> {
        Past::new(Readings::One(column))
    }

    /// Of a joint's readings plus `sense` times another's, row by row.
    pub(crate) fn of_pair(of: &'a [f64], and: &'a [f64], sense: f64) -> Past<'a> {
        Past::new(Readings::Two { of, and, sense })
    }

    fn new(readings: Readings<'a>) -> Past<'a> {
        let rows = readings.len();
        let block = |block: usize| readings.extremes(block * BLOCK..((block + 1) * BLOCK).min(rows));
        Past { readings, blocks: (0..rows.div_ceil(BLOCK)).map(block).collect() }
    }

    /// The readings of rows, newest first.
    pub(crate) fn back(&self, rows: Range<usize>) -> impl Iterator<Item = f64> {
        rows.rev().map(|row| self.readings.at(row))
    }

    /// Rows in blocks, newest first: which they are, their smallest and their largest reading.
    pub(crate) fn blocks_back(&self, rows: Range<usize>) -> impl Iterator<Item = (Range<usize>, f64, f64)> {
        let end = rows.end.min(self.readings.len());
        let blocks = if rows.start < end { rows.start / BLOCK..end.div_ceil(BLOCK) } else { 0..0 };
        blocks.rev().map(move |block| {
            let whole = block * BLOCK..((block + 1) * BLOCK).min(self.readings.len());
            let part = whole.start.max(rows.start)..whole.end.min(end);
            let (lowest, highest) =
                if part == whole { self.blocks[block] } else { self.readings.extremes(part.clone()) };
            (part, lowest, highest)
        })
    }
}
