//! Whether one offset and one drift hold for the whole recording, judged by what each movement alone would say.
//!
//! A stretch of the recording has another offset where its movements differ from all others by more than any single
//! movement does from its like, and by so many standard errors that chance does not explain the best of all stretches.
//! A nominal arm that is wrong in another way in another region shifts movements too, but by no more than the
//! uncertainty of the alignment, which counts that in.

use armcal_core::robust::median;
use nalgebra::{DMatrix, DVector};

use super::spread::MovementOffset;

/// Fewest movements in the stretch, before it, and after it unless it lasts to the end.
pub(crate) const LEAST_MOVEMENTS: usize = 4;
/// Normal deviate that the best of all stretches must reach: one in a thousand among the stretches of 50 movements.
const SIGNIFICANT: f64 = 5.0;
/// Times the scatter of single movements that the change must be.
const SINGLE_SIGMAS: f64 = 3.0;
/// A movement weighs at most this many times the median one.
const MOST_WEIGHT: f64 = 4.0;

/// A stretch of movements with another offset than the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    /// First movement, and the one after the last.
    pub first: usize,
    pub end: usize,
    /// Offset in it less that outside [s], with its standard error.
    pub by_s: f64,
    pub sigma_s: f64,
    /// Scatter of single movements [s].
    single_s: f64,
    /// Student's t as a normal deviate.
    deviate: f64,
}

/// The stretch that differs most, if it differs by more than chance and by at least `least_s`.
pub(crate) fn other_offset(all: &[MovementOffset], with_drift: bool, least_s: f64) -> Option<Stretch> {
    let n = all.len();
    let line = Line::of(all, with_drift)?;
    let mut best: Option<Stretch> = None;
    for first in 0..n {
        for end in first + LEAST_MOVEMENTS..=n {
            // The rest of a stretch from the beginning on is a stretch up to the end.
            if first < LEAST_MOVEMENTS || (end < n && n - end < LEAST_MOVEMENTS) {
                continue;
            }
            if let Some(found) = line.stretch(first, end)
                && best.is_none_or(|b| found.deviate.abs() > b.deviate.abs())
            {
                best = Some(found);
            }
        }
    }
    best.filter(|s| s.deviate.abs() >= SIGNIFICANT && s.by_s.abs() >= least_s.max(SINGLE_SIGMAS * s.single_s))
}

/// How much another offset a given stretch has.
pub(crate) fn stretch_offset(
    all: &[MovementOffset],
    with_drift: bool,
    first: usize,
    end: usize,
) -> Option<Stretch> {
    Line::of(all, with_drift)?.stretch(first, end)
}

/// Weighted offsets of the movements with a straight line in time taken out.
struct Line {
    weight: Vec<f64>,
    /// Orthonormal columns (level, and time where drift is estimated) in the metric of the weights.
    basis: Vec<DVector<f64>>,
    /// Offsets times the root of their weights, the line taken out.
    left: DVector<f64>,
    free: f64,
}

impl Line {
    fn of(all: &[MovementOffset], with_drift: bool) -> Option<Line> {
        let typical = median(&all.iter().map(|m| m.weight).collect::<Vec<_>>());
        let weight: Vec<f64> = all.iter().map(|m| (m.weight / typical).clamp(0.0, MOST_WEIGHT)).collect();
        let free = all.len() as f64 - if with_drift { 3.0 } else { 2.0 };
        if typical.is_nan() || typical <= 0.0 || free < 1.0 {
            return None;
        }
        let rooted =
            |value: &dyn Fn(usize) -> f64| DVector::from_fn(all.len(), |i, _| weight[i].sqrt() * value(i));
        let mut columns = vec![rooted(&|_| 1.0)];
        if with_drift {
            columns.push(rooted(&|i| all[i].from_s));
        }
        let basis: Vec<DVector<f64>> =
            DMatrix::from_columns(&columns).qr().q().column_iter().map(|c| c.into_owned()).collect();
        let mut line = Line { left: rooted(&|i| all[i].offset_s), weight, basis, free };
        line.left = line.without(line.left.clone());
        Some(line)
    }

    fn without(&self, mut column: DVector<f64>) -> DVector<f64> {
        for b in &self.basis {
            column -= b * b.dot(&column);
        }
        column
    }

    fn stretch(&self, first: usize, end: usize) -> Option<Stretch> {
        let inside = DVector::from_fn(self.weight.len(), |i, _| {
            if (first..end).contains(&i) { self.weight[i].sqrt() } else { 0.0 }
        });
        let inside = self.without(inside);
        let square = inside.norm_squared();
        // A stretch that the line describes as well tells nothing.
        if square < 0.05 {
            return None;
        }
        let by_s = inside.dot(&self.left) / square;
        let variance = (&self.left - &inside * by_s).norm_squared() / self.free;
        let sigma_s = (variance / square).sqrt();
        let deviate = normal_deviate(by_s / sigma_s, self.free);
        deviate.is_finite().then_some(Stretch {
            first,
            end,
            by_s,
            sigma_s,
            single_s: variance.sqrt(),
            deviate,
        })
    }
}

/// Student's t as the normal deviate of the same probability (Wallace, Ann. Math. Stat. 30, 1959).
fn normal_deviate(t: f64, free: f64) -> f64 {
    let z = (free * (t * t / free).ln_1p()).sqrt() * (8.0 * free + 1.0) / (8.0 * free + 3.0);
    z.copysign(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::Random;

    fn movements(r: &mut Random, n: usize, offset_s: impl Fn(usize) -> f64) -> Vec<MovementOffset> {
        let one = |i: usize| {
            let from_s = 3.0 * i as f64;
            let offset_s = offset_s(i) + 1e-3 * r.normal();
            MovementOffset { from_s, to_s: from_s + 2.0, offset_s, weight: 1.0 }
        };
        (0..n).map(one).collect()
    }

    #[test]
    fn students_t_becomes_a_normal_deviate() {
        // Two-sided 0.001: t = 6.869 (5), 4.587 (10), 3.646 (30); normal 3.2905.
        for (free, t) in [(5.0, 6.869), (10.0, 4.587), (30.0, 3.646)] {
            assert!((normal_deviate(t, free) - 3.2905).abs() < 0.05, "{free}: {}", normal_deviate(t, free));
        }
    }

    #[test]
    fn chance_is_no_change_and_a_change_is_found_where_it_was() {
        let mut r = Random::new(1);
        for n in [8, 12, 25, 50] {
            for seed in 0..200 {
                let drift = f64::from(seed) * 1e-5;
                let sound = movements(&mut r, n, |i| drift * i as f64);
                assert_eq!(other_offset(&sound, true, 0.0), None, "{n} {seed}");
            }
        }
        let set = movements(&mut r, 25, |i| if i >= 17 { 0.02 } else { 0.0 });
        let found = other_offset(&set, true, 5e-3).expect("a change");
        assert_eq!((found.first, found.end), (17, 25));
        assert!((found.by_s - 0.02).abs() < 4.0 * found.sigma_s, "{found:?}");
        // Five milliseconds for a while are found, and are not worth a word where ten are asked for.
        let away = movements(&mut r, 30, |i| if (10..16).contains(&i) { -7e-3 } else { 0.0 });
        let found = other_offset(&away, true, 5e-3).expect("a change");
        assert_eq!((found.first, found.end), (10, 16));
        assert_eq!(other_offset(&away, true, 1e-2), None);
    }
}
