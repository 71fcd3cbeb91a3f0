//! Repeatability on residuals made up, against the sum written out.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use armcal_core::{DwellId, Reference};

/// A visit: the place, whether it came forwards, the recording, what it erred [mm].
type Visit = (usize, bool, usize, [f64; 3]);

/// The mean error [mm] that is learnt of these visits.
fn learnt(visits: &[Visit]) -> Option<f64> {
    let seen: Vec<Observation> = (visits.iter().enumerate())
        .map(|(dwell, (place, forwards, recording, _))| {
            let joint_rad = vec![0.1 * *place as f64, 1.5 - 0.06 * *place as f64, 0.0];
            let id = DwellId { recording: *recording, dwell };
            let arrival = if *forwards { Arrival::Positive } else { Arrival::Negative };
            Observation {
                arrival: vec![arrival; 3],
                ..Observation::bare(id, joint_rad, Reference::position(Vector3::zeros()))
            }
        })
        .collect();
    let errors_m = visits.iter().map(|(.., error_mm)| Vector3::from(*error_mm) * 1e-3);
    of_errors(&seen, errors_m).map(|m| m * 1e3)
}

/// Visits `n` times to each place, one after the other, each off by an error of the place and one of its own.
fn visits(places: usize, n: usize) -> Vec<Visit> {
    let own = |place: usize, k: usize| {
        let (a, b) = (place as f64, k as f64);
        [3.0 * a + 0.1 * (7.0 * b).sin(), -a + 0.2 * (3.0 * b).cos(), 0.05 * b]
    };
    (0..places).flat_map(|place| (0..n).map(move |k| (place, true, 0, own(place, k)))).collect()
}

/// `sqrt(8 / pi)` times the root of the squares about the mean of each of these groups.
fn by_hand(groups: &[&[Visit]]) -> f64 {
    let (mut square, mut more) = (0.0, 0);
    for group in groups {
        for axis in 0..3 {
            let mean = group.iter().map(|v| v.3[axis]).sum::<f64>() / group.len() as f64;
            square += group.iter().map(|v| (v.3[axis] - mean).powi(2)).sum::<f64>();
        }
        more += group.len() - 1;
    }
    (square / (3 * more) as f64).sqrt() * (8.0 / PI).sqrt()
}

fn close(found: Option<f64>, expected: f64) -> bool {
    found.is_some_and(|found| (found - expected).abs() < 1e-9 * expected)
}

#[test]
fn it_is_what_visits_to_one_place_differ_by() {
    let all = visits(5, 3);
    let expected = by_hand(&all.chunks(3).collect::<Vec<_>>());
    assert!(close(learnt(&all), expected), "{:?} {expected}", learnt(&all));
    // Whatever the model does not know of a place is the same in all of its visits.
    let off = |v: &Visit| (v.0, v.1, v.2, v.3.map(|e| e + 100.0 * v.0 as f64));
    assert!(close(learnt(&all.iter().map(off).collect::<Vec<_>>()), expected));
    let larger = |v: &Visit| (v.0, v.1, v.2, v.3.map(|e| 7.0 * e));
    assert!(close(learnt(&all.iter().map(larger).collect::<Vec<_>>()), 7.0 * expected));
    // And in whatever order they came.
    let mut mixed = all.clone();
    mixed.sort_by(|a, b| a.3[1].total_cmp(&b.3[1]));
    assert!(close(learnt(&mixed), expected));
}

#[test]
fn of_fewer_than_eight_repeats_none_is_told() {
    assert!(learnt(&visits(4, 3)).is_some(), "two more of each of four");
    assert!(learnt(&visits(7, 2)).is_none() && learnt(&visits(8, 2)).is_some());
    assert!(learnt(&visits(19, 1)).is_none(), "nothing was visited twice");
    let mut nearly = visits(4, 3);
    nearly.pop();
    assert!(learnt(&nearly).is_none());
}

#[test]
fn another_direction_and_another_recording_are_other_places() {
    let all = visits(4, 6);
    let expected = by_hand(&all.chunks(3).collect::<Vec<_>>());
    assert!(!close(Some(by_hand(&all.chunks(6).collect::<Vec<_>>())), expected));
    let split = |change: &dyn Fn(&mut Visit)| {
        let mut all = all.clone();
        all.chunks_mut(6).flat_map(|visits| &mut visits[3..]).for_each(change);
        learnt(&all)
    };
    // As far as a play, or a frame that was set up again, displaces.
    let play = split(&|v| (v.1, v.3) = (false, v.3.map(|e| e + 50.0)));
    assert!(close(play, expected), "{play:?} {expected}");
    let anew = split(&|v| (v.2, v.3) = (1, v.3.map(|e| e - 20.0)));
    assert!(close(anew, expected), "{anew:?} {expected}");
    let neither = split(&|v| v.3 = v.3.map(|e| e + 50.0));
    assert!(neither.unwrap() > 10.0 * expected, "{neither:?}");
}
