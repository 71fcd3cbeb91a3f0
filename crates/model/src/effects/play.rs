//! The play operator on the path of an encoder: exact backlash for every width.
//!
//! A gap of width `b` between encoder and link holds the link where it is until one of its flanks touches:
//! `w <- max(q - b/2, min(q + b/2, w))`. Of a long path only the extrema matter that no later, larger excursion
//! has wiped out (the reduced memory sequence of Preisach hysteresis, Mayergoyz 1991, ch. 1); they alternate, and
//! there are few of them, whatever the width turns out to be. The dwell detection keeps them
//! (`Observation::path_memory_rad`).

use crate::rigid::Scalar;

/// Where the link is relative to the encoder [rad] behind a gap of this width, after the remembered path; a
/// negative width is a link that leads (a back-driven joint).
///
/// Before the path began the link is taken to be in the middle of its gap.
pub(crate) fn lost_motion_rad<D: Scalar>(width: D, memory_rad: &[f64]) -> D {
    let (sign, half) = if width.re() < 0.0 { (-1.0, width * -0.5) } else { (1.0, width * 0.5) };
    let Some((&start, rest)) = memory_rad.split_first() else { return D::from(0.0) };
    let (mut link, mut encoder) = (D::from(start), start);
    for &q in rest {
        let (low, high) = (half * -1.0 + q, half + q);
        // The flank that pushes touches; at width zero both do, and the one that drives decides the derivative.
        if q > encoder && link.re() <= low.re() {
            link = low;
        } else if q < encoder && link.re() >= high.re() {
            link = high;
        }
        encoder = q;
    }
    (link - encoder) * sign
}

/// The way a fit takes from zero is that of a gap of this width [deg]: the smallest moves, which decide what happens in a gap without
/// width, are those of a servo's overshoot.
pub(super) const BEGUN_DEG: f64 = 0.3;

/// [`lost_motion_rad`] of a width that a fit begins with at zero: there it grows in proportion, as to a gap that has `begun`.
/// Without a remembered path by the direction of `arrival`.
pub(super) fn play_displacement<D: Scalar>(width: D, begun: f64, memory: &[f64], arrival: f64) -> D {
    if memory.len() < 2 {
        width * (-0.5 * arrival)
    } else if width.re() == 0.0 {
        width * (lost_motion_rad(begun, memory) / begun)
    } else {
        lost_motion_rad(width, memory)
    }
}

/// [`play_displacement`], for a joint that may be led by hand: where the width is negative the link leads, and an encoder that
/// moved, however little, was pushed by the flank it was pushed from; what the link did within its gap afterwards
/// nobody recorded.
pub(super) fn led_play_displacement<D: Scalar>(width: D, begun: f64, memory: &[f64], arrival: f64) -> D {
    match memory {
        [.., before, rest] if width.re() < 0.0 => {
            let last_move = if rest == before { 0.0 } else { (rest - before).signum() };
            width * (-0.5 * last_move)
        }
        _ => play_displacement(width, begun, memory, arrival),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;
    use proptest::prelude::*;

    /// The extrema of an encoder's path that matter to a gap of any width, oldest first, its end last [rad].
    ///
    /// Excursions smaller than `resolution_rad` (noise, quantisation) do not count as reversals. The start of the path
    /// counts as an extremum. Empty if the joint never moved by more than the resolution: its past is not known.
    fn path_memory_rad(path_rad: impl IntoIterator<Item = f64>, resolution_rad: f64) -> Vec<f64> {
        let mut memory: Vec<f64> = Vec::new();
        for point in turning_points(path_rad, resolution_rad) {
            loop {
                match memory[..] {
                    // The first leg began in the middle of the gap, so it weighs twice; the start itself stays,
                    // because what happened before it is not known.
                    [start, first] if (point - first).abs() >= 2.0 * (first - start).abs() => {
                        memory.truncate(1)
                    }
                    // A leg at least as long as the one before it goes beyond where that one began: both are
                    // wiped out, and the leg before them goes on.
                    [_, .., a, b] if memory.len() > 2 && (point - b).abs() >= (b - a).abs() => {
                        memory.truncate(memory.len() - 2);
                    }
                    _ => break,
                }
            }
            memory.push(point);
        }
        if memory.len() < 2 { Vec::new() } else { memory }
    }

    /// Start, alternating extrema and end of a path, reversals below the resolution left out.
    fn turning_points(path_rad: impl IntoIterator<Item = f64>, resolution_rad: f64) -> Vec<f64> {
        let mut path = path_rad.into_iter();
        let Some(start) = path.next() else { return Vec::new() };
        let (mut turns, mut extreme, mut direction, mut last) = (vec![start], start, 0.0, start);
        for q in path {
            last = q;
            if direction == 0.0 {
                if (q - start).abs() > resolution_rad {
                    (direction, extreme) = ((q - start).signum(), q);
                }
            } else if (q - extreme) * direction >= 0.0 {
                extreme = q;
            } else if (q - extreme).abs() > resolution_rad {
                turns.push(extreme);
                (direction, extreme) = (-direction, q);
            }
        }
        if direction == 0.0 {
            return turns;
        }
        // At rest within the resolution of the last extremum: the end of the path is that extremum.
        turns.push(if (last - extreme).abs() > resolution_rad { last } else { extreme });
        turns
    }

    /// The play operator as it is defined, sample by sample.
    fn brute_force(path: &[f64], width: f64) -> f64 {
        let half = 0.5 * width;
        let mut link = path[0];
        for &q in path {
            link = (q - half).max((q + half).min(link));
        }
        link - path[path.len() - 1]
    }

    proptest! {
        #[test]
        fn the_memory_gives_the_play_of_the_whole_path(
            path in prop::collection::vec(-1.0..1.0f64, 2..60), width in 0.0..1.5f64,
        ) {
            let memory = path_memory_rad(path.iter().copied(), 0.0);
            let short = lost_motion_rad(width, &memory);
            prop_assert!((short - brute_force(&path, width)).abs() < 1e-14, "{memory:?}");
            prop_assert!(lost_motion_rad(-width, &memory) == -short);
        }

        #[test]
        fn the_memory_shrinks_towards_its_end(path in prop::collection::vec(-1.0..1.0f64, 2..200)) {
            let memory = path_memory_rad(path.iter().copied(), 0.0);
            let legs: Vec<f64> = memory.windows(2).map(|w| w[1] - w[0]).collect();
            prop_assert!(legs.windows(2).all(|l| l[0] * l[1] < 0.0), "not alternating: {memory:?}");
            prop_assert!(legs.windows(2).skip(1).all(|l| l[1].abs() < l[0].abs()), "{memory:?}");
        }

        #[test]
        fn the_derivative_is_the_slope(
            path in prop::collection::vec(-1.0..1.0f64, 2..60), width in 0.01..1.5f64,
        ) {
            let memory = path_memory_rad(path.iter().copied(), 0.0);
            let h = 1e-9;
            let slope = (lost_motion_rad(width + h, &memory) - lost_motion_rad(width - h, &memory)) / (2.0 * h);
            let dual = lost_motion_rad(Dual64::new(width, 1.0), &memory);
            prop_assert!((dual.eps - slope).abs() < 1e-5);
        }
    }

    #[test]
    fn a_narrow_gap_follows_the_last_leg_and_noise_is_not_a_leg() {
        let rising = [0.0, 0.5, 0.2, 0.6, 0.599, 0.6];
        let memory = path_memory_rad(rising, 0.002);
        assert_eq!(memory, [0.0, 0.6]);
        assert!((lost_motion_rad(0.01, &memory) + 0.005_f64).abs() < 1e-16);
        assert_eq!(lost_motion_rad(Dual64::new(0.0, 1.0), &memory).eps, -0.5);
        assert!(path_memory_rad([0.3, 0.301, 0.3], 0.002).is_empty());
    }
}
