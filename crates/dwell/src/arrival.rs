//! From which side each joint came to rest.

use armcal_core::Arrival;
use std::ops::Range;

/// Rows per block of the summary that lets long pauses be skipped.
const BLOCK: usize = 256;

/// One encoder column, prepared for questions about its past.
pub(crate) struct Past<'a> {
    column: &'a [f64],
    blocks: Vec<(f64, f64)>,
}

impl<'a> Past<'a> {
    pub(crate) fn of(column: &'a [f64]) -> Past<'a> {
        let extremes = |block: &[f64]| {
            block.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &q| (q.min(lo), q.max(hi)))
        };
        Past { column, blocks: column.chunks(BLOCK).map(extremes).collect() }
    }

    /// Direction of arrival at `rest_rad`, where the dwell begins at row `start`.
    ///
    /// `t*` is the last row before `start` at which the joint was at least `h_rad` away; the direction is
    /// the sign of `rest - q(t*)`. Rows before `since` are not looked at: there the stream is broken or not
    /// yet begun, and what the joint did in the break is unknown. No such row: unknown.
    pub(crate) fn arrival(&self, since: usize, start: usize, rest_rad: f64, h_rad: f64) -> Arrival {
        let away = |q: f64| (q - rest_rad).abs() >= h_rad;
        let mut end = start.min(self.column.len());
        while end > since {
            let block = (end - 1) / BLOCK;
            let rows: Range<usize> = (block * BLOCK).max(since)..end;
            let (lowest, highest) = self.blocks[block];
            if (away(lowest) || away(highest))
                && let Some(q) = self.column[rows.clone()].iter().rev().find(|q| away(**q))
            {
                return if *q < rest_rad { Arrival::Positive } else { Arrival::Negative };
            }
            end = rows.start;
        }
        Arrival::Unknown
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
