//! Errors that are planted to be alike, and those that are not.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::tests::{planted, quick};
use crate::weigh::weigh;

fn of(p: &Problem) -> Scatter {
    let weighed = weigh(p, &quick());
    weighed.scatter_of(p, &weighed.base.projected_residual())
}

/// One number a dwell and axis, in units of the declared noise.
fn added(mut p: Problem, of: impl Fn(&DwellRow, usize) -> f64) -> Problem {
    for d in &p.dwells {
        for axis in 0..3 {
            p.residual[d.first_row + axis] += of(d, axis);
        }
    }
    p
}

/// An angle that differs from one number to the next without an end.
fn drawn(k: usize) -> f64 {
    1.4 * (k as f64 * 2.399_963).sin()
}

#[test]
fn independent_errors_are_alike_nowhere() {
    for seed in 0..5 {
        let s = of(&planted(&[], 0, seed));
        assert!(s.alike().is_none() && !s.remembers() && !s.repeats(), "{seed}: {s:?}");
        assert!((s.sigma_ratio - 1.0).abs() < 0.1 && s.tracked_ratio.is_none(), "{s:?}");
        assert_eq!(s.places.unwrap().pairs, 33 * 15, "33 cavities, six visits each");
    }
}

#[test]
fn what_every_visit_to_a_place_has_is_alike_at_places() {
    let place = |d: &DwellRow| d.place.as_deref().map_or(0, |p| p.bytes().map(usize::from).sum::<usize>());
    let s = of(&added(planted(&[], 0, 3), |d, axis| 1.5 * drawn(7 * place(d) + axis)));
    assert!(s.repeats() && !s.remembers(), "{s:?}");
    assert!(s.alike().unwrap().starts_with("visits to a place err alike (correlation 0."), "{s:?}");
}

#[test]
fn a_walk_is_alike_over_neighbours_and_of_the_dwells_that_walk() {
    let mut p = planted(&[], 0, 3);
    p.dwells.iter_mut().filter(|d| d.id.recording == 1).for_each(|d| d.parts[0].tracked = true);
    let walk = |d: &DwellRow, axis: usize| match d.id.recording {
        1 => 1.5 * ((d.id.dwell as f64) * 0.4 + axis as f64).sin(),
        _ => 0.0,
    };
    let s = of(&added(p, walk));
    assert!(s.remembers(), "{s:?}");
    assert!(s.tracked_neighbours.unwrap().value > 0.3 && s.seated_neighbours.unwrap().value < 0.2, "{s:?}");
    assert!(s.tracked_ratio.unwrap() > 1.3 * s.seated_ratio.unwrap(), "{s:?}");
    assert!(s.alike().unwrap().starts_with("tracked dwells err alike over neighbours in time"), "{s:?}");
}

#[test]
fn a_correlation_is_that_of_numbers_side_by_side() {
    let v = |a: f64, b: f64| DVector::from_vec(vec![a, b]);
    let c = Correlation::of([(v(1.0, 2.0), v(0.5, -1.0)), (v(-1.0, 0.0), v(-1.0, 3.0))].into_iter()).unwrap();
    assert_eq!((c.value, c.pairs), ((0.5 - 2.0 + 1.0) / 4.0, 2));
    // The square of a standard normal number exceeds 0.125^2 * 4 with 0.8026.
    assert!((c.p - 0.8026).abs() < 1e-3, "{c:?}");
    assert!(Correlation::of(std::iter::empty()).is_none());
}
