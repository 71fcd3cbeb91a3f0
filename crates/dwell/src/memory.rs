//! What a joint's path leaves behind at rest: the turning points that a gap in the gear remembers.

use crate::motion_history::Past;
use std::ops::Range;

/// Path further back than this is not kept [rad]: no credible lost motion reaches it.
const WIDEST_RAD: f64 = 0.25;

/// The dominating extrema of the path up to the dwell, oldest first, ending at `rest_rad` [rad].
///
/// Rate-independent hysteresis (backlash, friction) remembers of a path only its reduced memory sequence: alternating
/// maxima and minima whose excursions shrink towards the present, every smaller loop before a larger one wiped out
/// (Mayergoyz, Mathematical Models of Hysteresis, 1991, section 1.2). Seen from the present backwards they are the
/// rows that set a new record above or below everything since. The path is that of `rows`, all before the dwell and
/// within one unbroken stretch of the stream; turning points closer than `deadband_rad` to the rest are noise.
pub(crate) fn path_memory(past: &Past<'_>, rows: Range<usize>, rest_rad: f64, deadband_rad: f64) -> Vec<f64> {
    let (lowest, highest) = (rest_rad - deadband_rad, rest_rad + deadband_rad);
    let mut records = Records { newest_first: vec![rest_rad], lowest, highest, last_was_high: None };
    for (rows, lowest, highest) in past.blocks_back(rows) {
        let (low, high) = (lowest < records.lowest, highest > records.highest);
        let far = highest.max(records.highest) - lowest.min(records.lowest) > WIDEST_RAD;
        if far || (low && high) {
            let enough = past.back(rows).any(|q| {
                records.see(q);
                records.highest - records.lowest > WIDEST_RAD
            });
            if enough {
                break;
            }
        } else {
            // Of records on one side only the last counts, which is the extreme.
            records.see(if low { lowest } else { highest });
        }
    }
    records.newest_first.reverse();
    records.newest_first
}

/// Records of a path seen backwards.
struct Records {
    newest_first: Vec<f64>,
    lowest: f64,
    highest: f64,
    last_was_high: Option<bool>,
}

impl Records {
    fn see(&mut self, q: f64) {
        let high = if q > self.highest {
            self.highest = q;
            true
        } else if q < self.lowest {
            self.lowest = q;
            false
        } else {
            return;
        };
        match self.newest_first.last_mut() {
            Some(record) if self.last_was_high == Some(high) => *record = q,
            _ => self.newest_first.push(q),
        }
        self.last_was_high = Some(high);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn memory(path: &[f64], rest_rad: f64, deadband_rad: f64) -> Vec<f64> {
        path_memory(&Past::of(path), 0..path.len(), rest_rad, deadband_rad)
    }

    /// The play operator by its definition, row by row.
    fn play(path: &[f64], width: f64) -> f64 {
        let mut w = path[0];
        for q in path {
            w = w.max(q - width / 2.0).min(q + width / 2.0);
        }
        w
    }

    #[test]
    fn smaller_loops_before_a_larger_one_are_forgotten() {
        let path = [0.0, 0.10, 0.05, 0.08, 0.02, 0.06, 0.04];
        assert_eq!(memory(&path[..6], 0.04, 1e-3), vec![0.0, 0.10, 0.02, 0.06, 0.04]);
        assert_eq!(memory(&[], 0.04, 1e-3), vec![0.04]);
        // Tremor within the deadband is no turning point, and far history is cut.
        assert_eq!(memory(&[0.0, 0.0405, 0.0396], 0.04, 1e-3), vec![0.0, 0.04]);
        assert_eq!(memory(&[0.0, 0.9, 0.5, 0.4], 0.3, 1e-3), vec![0.9, 0.3]);
    }

    /// The records row by row, without blocks.
    fn row_by_row(path: &[f64], rest_rad: f64, deadband_rad: f64) -> Vec<f64> {
        let (mut kept, mut lowest, mut highest) =
            (vec![rest_rad], rest_rad - deadband_rad, rest_rad + deadband_rad);
        let mut up = None;
        for &q in path.iter().rev().filter(|q| !q.is_nan()) {
            if (lowest..=highest).contains(&q) {
                continue;
            }
            let is_up = q > highest;
            (lowest, highest) = (lowest.min(q), highest.max(q));
            if up == Some(is_up) {
                kept.pop();
            }
            kept.push(q);
            up = Some(is_up);
            if highest - lowest > WIDEST_RAD {
                break;
            }
        }
        kept.into_iter().rev().collect()
    }

    proptest! {
        #[test]
        fn blocks_give_what_rows_give(
            steps in prop::collection::vec(-0.02_f64..0.02, 1..900),
            drift in -0.003_f64..0.003,
            deadband in 0.0_f64..0.02,
        ) {
            let path: Vec<f64> = steps.iter().scan(0.0, |q, step| { *q += step + drift; Some(*q) }).collect();
            let (rest, before) = path.split_last().expect("a step at least");
            prop_assert_eq!(memory(before, *rest, deadband), row_by_row(before, *rest, deadband));
        }

        #[test]
        fn a_gap_is_where_the_whole_path_would_leave_it(
            steps in prop::collection::vec(-0.02_f64..0.02, 2..1500),
            width in 1e-3_f64..0.05,
        ) {
            let path: Vec<f64> = steps.iter().scan(0.0, |q, step| { *q += step; Some(*q) }).collect();
            let (rest, before) = path.split_last().expect("two steps at least");
            let kept = memory(before, *rest, 0.0);
            let range = path.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                - path.iter().copied().fold(f64::INFINITY, f64::min);
            // Until the gap has been crossed once, where it began decides.
            if range > 2.0 * width {
                prop_assert!((play(&kept, width) - play(&path, width)).abs() < 1e-12);
            }
        }
    }
}
