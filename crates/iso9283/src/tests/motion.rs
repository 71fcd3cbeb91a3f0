//! Clauses 7.4, 7.5 and 9 by hand and against closed forms.

use super::{close, mm, sampled};
use crate::settling::{measure_settling, overshoot_m, posing_time_s, stabilization_time_s};
use crate::{IsoError, TimedPose};
use nalgebra::Vector3;

fn at(time_s: f64, x_mm: f64) -> TimedPose {
    TimedPose { time_ns: (time_s * 1e9) as i64, pose: mm(x_mm, 0.0, 0.0) }
}

#[test]
fn stabilization_runs_from_the_first_crossing_to_the_last() {
    // Band 2 mm about 0. From 10 to 0 mm in 1 s: in at 0.8 s. To -4 mm at 2 s, back to 0 at 3 s: in for good at 2.5
    // s.
    let run = [at(0.0, 10.0), at(1.0, 0.0), at(2.0, -4.0), at(3.0, 0.0), at(4.0, 1.0)];
    let settling = measure_settling(&run, &Vector3::zeros(), 2e-3).unwrap();
    close(settling.time_s(), 1.7, 1e-8);
    close(settling.overshoot_m, 4e-3, 1e-15);
    // Another cycle that never leaves the band: 0 s, no overshoot. Mean of the times, largest of the overshoots.
    let calm =
        measure_settling(&[at(0.0, 10.0), at(1.0, 0.0), at(2.0, -1.9)], &Vector3::zeros(), 2e-3).unwrap();
    close(stabilization_time_s(&[settling, calm]).unwrap(), 0.85, 1e-8);
    close(overshoot_m(&[calm, settling]).unwrap(), 4e-3, 1e-15);
    assert_eq!(calm.overshoot_m, 0.0);
}

#[test]
fn a_damped_joint_overshoots_by_its_closed_form() {
    // x'' + 2 z w x' + w^2 x = 0 from rest at 100 mm: first overshoot 100 exp(-pi z / sqrt(1 - z^2)) mm (Ogata,
    // Modern Control Engineering, 5-3), here 37.23 mm. It leaves the band of 1 mm for the last time at its eighth
    // half period or so: the envelope 100 exp(-z w t) / sqrt(1 - z^2) falls to 1 mm at t = 1.54 s, and a peak comes
    // every 0.33 s.
    let (z, w): (f64, f64) = (0.3, 10.0);
    let damped = w * (1.0 - z * z).sqrt();
    let x_mm =
        |t: f64| 100.0 * (-z * w * t).exp() * ((damped * t).cos() + z * w / damped * (damped * t).sin());
    let run = sampled(1e-3, 4.0, |t| mm(x_mm(t), 0.0, 0.0));
    let settling = measure_settling(&run, &Vector3::zeros(), 1e-3).unwrap();
    let peak_mm = 100.0 * (-std::f64::consts::PI * z / (1.0 - z * z).sqrt()).exp();
    close(settling.overshoot_m, peak_mm * 1e-3, 1e-6);
    let envelope_s = (100.0 / (1.0 - z * z).sqrt()).ln() / (z * w);
    let settled_s = settling.settled_ns as f64 * 1e-9;
    assert!((envelope_s - std::f64::consts::PI / damped..=envelope_s).contains(&settled_s), "{settled_s}");
    close(x_mm(settled_s).abs(), 1.0, 1e-3);
}

#[test]
fn an_approach_that_shows_no_crossing_or_no_rest_is_refused() {
    let centre = Vector3::zeros();
    let inside = measure_settling(&[at(0.0, 1.0), at(1.0, 0.0)], &centre, 2e-3).unwrap_err();
    assert!(matches!(inside, IsoError::CrossingNotSeen { .. }), "{inside}");
    let restless = measure_settling(&[at(0.0, 9.0), at(1.0, 0.0), at(2.0, 5.0)], &centre, 2e-3).unwrap_err();
    assert!(matches!(restless, IsoError::NeverSettles { .. }), "{restless}");
    let backwards = measure_settling(&[at(1.0, 9.0), at(0.0, 0.0)], &centre, 2e-3).unwrap_err();
    assert!(matches!(backwards, IsoError::TimeNotIncreasing { index: 1, .. }), "{backwards}");
    assert!(measure_settling(&[at(0.0, 9.0), at(1.0, 0.0)], &centre, 0.0).is_err());
    assert!(measure_settling(&[], &centre, 1e-3).is_err());
}

#[test]
fn posing_time_is_a_mean_of_whole_moves() {
    // 1.2 s and 1.4 s.
    let cycles = [[0, 1_200_000_000], [5_000_000_000, 6_400_000_000]];
    close(posing_time_s(&cycles).unwrap(), 1.3, 1e-12);
}
