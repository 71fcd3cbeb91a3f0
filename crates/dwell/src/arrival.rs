//! From which side each joint came to rest.

use crate::motion_history::Past;
use armcal_core::Arrival;
use std::ops::Range;

/// Direction of arrival at `rest_rad`, where the dwell begins behind `rows`.
///
/// `t*` is the last of these rows at which the joint was at least `h_rad` away; the direction is the sign of
/// `rest - q(t*)`. They begin where the stream does, or where it was last broken: what the joint did in the break is
/// unknown. No such row: unknown.
pub(crate) fn arrival_direction(past: &Past<'_>, rows: Range<usize>, rest_rad: f64, h_rad: f64) -> Arrival {
    let away = |q: f64| (q - rest_rad).abs() >= h_rad;
    let mut blocks = past.blocks_back(rows);
    let with_some = blocks.find(|(_, lowest, highest)| away(*lowest) || away(*highest));
    match with_some.and_then(|(rows, ..)| past.back(rows).find(|q| away(*q))) {
        Some(q) if q < rest_rad => Arrival::Positive,
        Some(_) => Arrival::Negative,
        None => Arrival::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.005;

    fn last_arrival(column: &[f64]) -> Arrival {
        let rest = column[column.len() - 1];
        arrival_direction(&Past::of(column), 0..column.len() - 1, rest, H)
    }

    #[test]
    fn the_last_move_decides() {
        assert_eq!(last_arrival(&[0.0, 0.1, 0.2, 0.2]), Arrival::Positive);
        assert_eq!(last_arrival(&[0.0, 0.3, 0.2, 0.2]), Arrival::Negative);
    }

    #[test]
    fn a_reversal_smaller_than_h_does_not_count() {
        // Overshoots by 0.004 < h and comes back: it still arrived from below.
        assert_eq!(last_arrival(&[0.0, 0.1, 0.204, 0.202, 0.2]), Arrival::Positive);
        // Overshoots by 0.006 >= h: the last move of at least h was downwards.
        assert_eq!(last_arrival(&[0.0, 0.1, 0.206, 0.202, 0.2]), Arrival::Negative);
    }

    #[test]
    fn what_the_recording_does_not_show_is_unknown() {
        assert_eq!(last_arrival(&[0.2; 5]), Arrival::Unknown);
        assert_eq!(last_arrival(&[0.196, 0.204, 0.2]), Arrival::Unknown);
        // The only motion lies before a break of the stream.
        assert_eq!(arrival_direction(&Past::of(&[0.0, 0.1, 0.2, 0.2]), 2..3, 0.2, H), Arrival::Unknown);
    }

    #[test]
    fn a_pause_much_longer_than_a_block_is_looked_through() {
        let mut column = vec![0.0; 700];
        column.extend(vec![0.1; 5000]);
        assert_eq!(last_arrival(&column), Arrival::Positive);
        assert_eq!(arrival_direction(&Past::of(&column), 700..5699, 0.1, H), Arrival::Unknown);
        assert_eq!(arrival_direction(&Past::of(&column), 699..5699, 0.1, H), Arrival::Positive);
    }
}
