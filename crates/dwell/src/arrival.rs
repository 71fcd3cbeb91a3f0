//! The past of a joint's readings, looked through from its end; and from which side each joint came to rest.

use armcal_core::Arrival;
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

    /// Direction of arrival at `rest_rad`, where the dwell begins at row `start`.
    ///
    /// `t*` is the last row before `start` at which the joint was at least `h_rad` away; the direction is
    /// the sign of `rest - q(t*)`. Rows before `since` are not looked at: there the stream is broken or not
    /// yet begun, and what the joint did in the break is unknown. No such row: unknown.
    pub(crate) fn arrival(&self, since: usize, start: usize, rest_rad: f64, h_rad: f64) -> Arrival {
        let away = |q: f64| (q - rest_rad).abs() >= h_rad;
        let mut blocks = self.blocks_back(since..start);
        let with_some = blocks.find(|(_, lowest, highest)| away(*lowest) || away(*highest));
        match with_some.and_then(|(rows, ..)| self.back(rows).find(|q| away(*q))) {
            Some(q) if q < rest_rad => Arrival::Positive,
            Some(_) => Arrival::Negative,
            None => Arrival::Unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.005;

    fn arrival(column: &[f64]) -> Arrival {
        let rest = column[column.len() - 1];
        Past::of(column).arrival(0, column.len() - 1, rest, H)
    }

    #[test]
    fn the_last_move_decides() {
        assert_eq!(arrival(&[0.0, 0.1, 0.2, 0.2]), Arrival::Positive);
        assert_eq!(arrival(&[0.0, 0.3, 0.2, 0.2]), Arrival::Negative);
    }

    #[test]
    fn a_reversal_smaller_than_h_does_not_count() {
        // Overshoots by 0.004 < h and comes back: it still arrived from below.
        assert_eq!(arrival(&[0.0, 0.1, 0.204, 0.202, 0.2]), Arrival::Positive);
        // Overshoots by 0.006 >= h: the last move of at least h was downwards.
        assert_eq!(arrival(&[0.0, 0.1, 0.206, 0.202, 0.2]), Arrival::Negative);
    }

    #[test]
    fn what_the_recording_does_not_show_is_unknown() {
        assert_eq!(arrival(&[0.2; 5]), Arrival::Unknown);
        assert_eq!(arrival(&[0.196, 0.204, 0.2]), Arrival::Unknown);
        // The only motion lies before a break of the stream.
        assert_eq!(Past::of(&[0.0, 0.1, 0.2, 0.2]).arrival(2, 3, 0.2, H), Arrival::Unknown);
    }

    #[test]
    fn a_pause_much_longer_than_a_block_is_looked_through() {
        let mut column = vec![0.0; 700];
        column.extend(vec![0.1; 5000]);
        assert_eq!(arrival(&column), Arrival::Positive);
        assert_eq!(Past::of(&column).arrival(700, 5699, 0.1, H), Arrival::Unknown);
        assert_eq!(Past::of(&column).arrival(699, 5699, 0.1, H), Arrival::Positive);
    }
}
