//! What a joint's path leaves behind at rest: the turning points that a gap in the gear remembers.

/// Path further back than this is not kept [rad]: no credible lost motion reaches it.
const WIDEST_RAD: f64 = 0.25;

/// The dominating extrema of the path up to the dwell, oldest first, ending at `rest_rad` [rad].
///
/// Rate-independent hysteresis (backlash, friction) remembers of a path only its reduced memory sequence: alternating
/// maxima and minima whose excursions shrink towards the present, every smaller loop before a larger one wiped out
/// (Mayergoyz, Mathematical Models of Hysteresis, 1991, section 1.2). Seen from the present backwards they are the
/// rows that set a new record above or below everything since. `column` is the path before the dwell, within one
/// unbroken stretch of the stream; turning points closer than `deadband_rad` to the rest are noise.
pub(crate) fn path_memory(
    column: impl DoubleEndedIterator<Item = f64>,
    rest_rad: f64,
    deadband_rad: f64,
) -> Vec<f64> {
    let mut newest_first: Vec<f64> = vec![rest_rad];
    let (mut lowest, mut highest) = (rest_rad - deadband_rad, rest_rad + deadband_rad);
    let mut last_was_high = None;
    for q in column.rev() {
        let high = if q > highest {
            highest = q;
            true
        } else if q < lowest {
            lowest = q;
            false
        } else {
            continue;
        };
        match newest_first.last_mut() {
            Some(record) if last_was_high == Some(high) => *record = q,
            _ => newest_first.push(q),
        }
        last_was_high = Some(high);
        if highest - lowest > WIDEST_RAD {
            break;
        }
    }
    newest_first.reverse();
    newest_first
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
        assert_eq!(path_memory(path[..6].iter().copied(), 0.04, 1e-3), vec![0.0, 0.10, 0.02, 0.06, 0.04]);
        assert_eq!(path_memory([].into_iter(), 0.04, 1e-3), vec![0.04]);
        // Tremor within the deadband is no turning point, and far history is cut.
        assert_eq!(path_memory([0.0, 0.0405, 0.0396].into_iter(), 0.04, 1e-3), vec![0.0, 0.04]);
        assert_eq!(path_memory([0.0, 0.9, 0.5, 0.4].into_iter(), 0.3, 1e-3), vec![0.9, 0.3]);
    }

    proptest! {
        #[test]
        fn a_gap_is_where_the_whole_path_would_leave_it(
            steps in prop::collection::vec(-0.02_f64..0.02, 2..200),
            width in 1e-3_f64..0.05,
        ) {
            let path: Vec<f64> = steps.iter().scan(0.0, |q, step| { *q += step; Some(*q) }).collect();
            let (rest, before) = path.split_last().expect("two steps at least");
            let kept = path_memory(before.iter().copied(), *rest, 0.0);
            let range = path.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                - path.iter().copied().fold(f64::INFINITY, f64::min);
            // Until the gap has been crossed once, where it began decides.
            if range > 2.0 * width {
                prop_assert!((play(&kept, width) - play(&path, width)).abs() < 1e-12);
            }
        }
    }
}
