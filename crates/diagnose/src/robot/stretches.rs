//! Events that end again: a tool pushed aside for a few dwells, an encoder that came back.
//!
//! A recording of n dwells has n^2/2 stretches, so each is tried by what it promises first ([`screening_score`]), which running
//! sums over its dwells give. The best are weighed in full.

use crate::weigh::evidence::screening_score;
use armcal_core::DwellId;
use armcal_model::least_dwells;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use std::ops::Range;

/// Dwells of a stretch: fewer are what swapped markers or a few poor readings make as well, of more the two steps show.
const LENGTHS: Range<usize> = 5..41;
/// Stretches that are weighed in full.
const WEIGHED: usize = 12;

/// The stretches of dwells in which an effect is worth weighing.
pub(crate) struct Stretches {
    /// First dwell and the number of the last one, the most promising first.
    pub best: Vec<(DwellId, usize)>,
    /// How many were tried for them.
    pub tried: usize,
}

/// Tries all stretches for an effect with these whitened columns; `rows` are those of each dwell.
pub(crate) fn stretches(
    dwells: &[DwellId],
    rows: &[Range<usize>],
    columns: &DMatrix<f64>,
    residual: &DVector<f64>,
) -> Stretches {
    let mut order: Vec<usize> = (0..dwells.len()).collect();
    order.sort_by_key(|i| dwells[*i]);
    let ends: Option<[DwellId; 2]> =
        order.first().zip(order.last()).map(|(first, last)| [dwells[*first], dwells[*last]]);
    let mut recordings: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    order.into_iter().for_each(|i| recordings.entry(dwells[i].recording).or_default().push(i));

    let least = least_dwells(columns.ncols());
    let lengths = LENGTHS.start.max(least)..LENGTHS.end;
    let mut tried: Vec<(f64, (DwellId, usize))> = Vec::new();
    for members in recordings.values() {
        let sums = running_sums(members, rows, columns, residual);
        for from in 0..members.len() {
            for length in lengths.clone().take_while(|length| from + length <= members.len()) {
                let (first, last) = (dwells[members[from]], dwells[members[from + length - 1]]);
                // What begins or ends with the session is a step, what all but fills a recording is that recording's.
                let step = ends.is_some_and(|ends| ends[0] == first || ends[1] == last);
                if !step && length + least <= members.len() {
                    tried.push((score_between(&sums[from], &sums[from + length]), (first, last.dwell)));
                }
            }
        }
    }
    let count = tried.len();
    let first =
        |a: &(f64, (DwellId, usize)), b: &(f64, (DwellId, usize))| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
    if count > WEIGHED {
        tried.select_nth_unstable_by(WEIGHED, first);
        tried.truncate(WEIGHED);
    }
    tried.sort_by(first);
    Stretches { best: tried.into_iter().map(|(_, stretch)| stretch).collect(), tried: count }
}

/// What columns promise in the members between two of [`running_sums`] sums.
pub(crate) fn score_between(before: &[[f64; 2]], until: &[[f64; 2]]) -> f64 {
    screening_score(before.iter().zip(until).map(|(b, a)| [a[0] - b[0], a[1] - b[1]]))
}

/// `X_ik' r_i` and `|X_ik|^2` summed over the members before each, for every column k.
pub(crate) fn running_sums(
    members: &[usize],
    rows: &[Range<usize>],
    columns: &DMatrix<f64>,
    residual: &DVector<f64>,
) -> Vec<Vec<[f64; 2]>> {
    let mut sums = vec![vec![[0.0; 2]; columns.ncols()]];
    for i in members {
        let mut next = sums[sums.len() - 1].clone();
        for (sum, column) in next.iter_mut().zip(columns.column_iter()) {
            for row in rows[*i].clone() {
                sum[0] += column[row] * residual[row];
                sum[1] += column[row].powi(2);
            }
        }
        sums.push(next);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two recordings of 20 dwells with three rows each; the effect moves the first row.
    fn session() -> (Vec<DwellId>, Vec<Range<usize>>, DMatrix<f64>) {
        let dwells = (0..40).map(|i| DwellId { recording: i / 20, dwell: i % 20 }).collect();
        let rows = (0..40).map(|i| 3 * i..3 * i + 3).collect();
        (dwells, rows, DMatrix::from_fn(120, 1, |row, _| if row % 3 == 0 { 2.0 } else { 0.0 }))
    }

    #[test]
    fn the_stretch_with_the_shift_comes_first() {
        let (dwells, rows, columns) = session();
        // 5 sigma in dwells 6 to 11 of recording 1, and what no fit predicts everywhere.
        let residual = DVector::from_fn(120, |row, _| {
            let inside = (26..=31).contains(&(row / 3)) && row % 3 == 0;
            f64::from(inside) * 5.0 + 0.3 * (row as f64 * 1.7).sin()
        });
        let seen = stretches(&dwells, &rows, &columns, &residual);
        assert_eq!(seen.best[0], (DwellId { recording: 1, dwell: 6 }, 11));
        assert_eq!(seen.best.len(), WEIGHED);
    }

    #[test]
    fn steps_and_whole_recordings_are_no_stretches() {
        let (dwells, rows, columns) = session();
        let seen = stretches(&dwells, &rows, &columns, &DVector::zeros(120));
        // Of 20 dwells: 20 - L + 1 stretches of each length L from 5 to 18; those that begin with the session, or end
        // with it, are one of each length and recording.
        let all: usize = (5..19).map(|length| 20 - length + 1).sum();
        assert_eq!(seen.tried, 2 * (all - 14));
        let few = stretches(&dwells[..2], &rows[..2], &columns, &DVector::zeros(120));
        assert_eq!((few.tried, few.best.len()), (0, 0));
    }
}
