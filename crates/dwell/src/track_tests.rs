use super::*;
use crate::detect_dwells;
use crate::testkit::{Random, Session, ns, tip_m};

/// A recording whose sensor is `offset_s` late, and the alignment that knows it.
fn recorded(seed: u64, offset_s: f64) -> (Session, Samples, ClockAlignment) {
    let mut r = Random::new(seed);
    let session = Session::random(&mut r, 8, (0.6, 1.2), (0.7, 1.5));
    let samples = Samples {
        joints: session.encoders(&mut r, 100.0, 0.0, 0.0),
        tip: Some(session.tip(&mut r, 90.0, 0.0, offset_s, 0.0)),
        ..Samples::default()
    };
    let clock = ClockAlignment {
        offset_s,
        offset_sigma_s: 1e-4,
        drift: 0.0,
        drift_sigma: 0.0,
        reference_ns: ns(0.0),
        first_ns: ns(0.0),
        correlation: 1.0,
        displacement_ratio: 1.0,
        declared: false,
    };
    (session, samples, clock)
}

#[test]
fn joints_are_those_of_the_moment_the_sensor_saw() {
    for seed in 0..10 {
        let (session, samples, clock) = recorded(seed, 0.043);
        let config = DwellConfig::default();
        let (dwells, _) = detect_dwells(0, &samples, Some(&clock), &config).expect("a track");
        let moments = track(&samples, Some(&clock), &dwells, &config).expect("a track");
        assert!(moments.len() > 300, "{}", moments.len());
        for m in &moments {
            // Linear interpolation between rows 10 ms apart errs by up to a h^2 / 8, a a few rad/s^2.
            assert!((tip_m(&m.joint_rad, 1.0) - m.position_m).norm() < 2e-4, "seed {seed} at {}", m.time_ns);
            assert!(dwells.iter().all(|d| m.time_ns < d.start_ns || m.time_ns > d.end_ns));
            let s = (m.time_ns - ns(0.0)) as f64 * 1e-9;
            let (before, after) = (session.joints_rad(s - 1e-4), session.joints_rad(s + 1e-4));
            for j in 0..3 {
                let truth = (after[j] - before[j]) / 2e-4;
                assert!(
                    (m.joint_velocity_radps[j] - truth).abs() < 0.03,
                    "{} {truth}",
                    m.joint_velocity_radps[j]
                );
                if truth.abs() > 0.3 {
                    let towards = if truth > 0.0 { Arrival::Positive } else { Arrival::Negative };
                    assert_eq!(m.arrival[j], towards);
                }
            }
        }
        // Between n dwells lie n - 1 motions.
        let motions: std::collections::BTreeSet<usize> = moments.iter().map(|m| m.motion).collect();
        assert_eq!(motions.len(), dwells.len() - 1, "seed {seed}");
    }
}

#[test]
fn a_shifted_clock_moves_the_joints_by_their_velocity() {
    let (_, samples, clock) = recorded(3, 0.043);
    let config = DwellConfig::default();
    let (dwells, _) = detect_dwells(0, &samples, Some(&clock), &config).expect("a track");
    let at = |shift_s: f64| {
        let clock = ClockAlignment { offset_s: clock.offset_s + shift_s, ..clock.clone() };
        track(&samples, Some(&clock), &dwells, &config).expect("a track")
    };
    let (now, later) = (at(0.0), at(0.005));
    let mut compared = 0;
    for m in &now {
        let Some(moved) = later.iter().find(|l| l.position_m == m.position_m) else { continue };
        for j in 0..3 {
            // The sensor's stamp was 5 ms later than thought: the joints are those of 5 ms before.
            let expected = m.joint_rad[j] - 0.005 * m.joint_velocity_radps[j];
            assert!((moved.joint_rad[j] - expected).abs() < 3e-4);
        }
        compared += 1;
    }
    assert!(compared > 300, "{compared}");
}

#[test]
fn a_break_of_the_stream_ends_a_motion() {
    let (_, mut samples, clock) = recorded(5, 0.0);
    let config = DwellConfig::default();
    let (dwells, _) = detect_dwells(0, &samples, Some(&clock), &config).expect("a track");
    let whole = track(&samples, Some(&clock), &dwells, &config).expect("a track");
    // Cut 0.4 s out of the middle of the longest motion.
    let longest = (0..=whole.last().expect("a track").motion)
        .max_by_key(|k| whole.iter().filter(|m| m.motion == *k).count())
        .expect("a track");
    let times: Vec<i64> = whole.iter().filter(|m| m.motion == longest).map(|m| m.time_ns).collect();
    let middle = times[times.len() / 2];
    let kept: Vec<usize> = (0..samples.joints.len())
        .filter(|i| (samples.joints.time_ns[*i] - middle).abs() > 200_000_000)
        .collect();
    samples.joints.time_ns = kept.iter().map(|i| samples.joints.time_ns[*i]).collect();
    for column in &mut samples.joints.joint_rad {
        *column = kept.iter().map(|i| column[*i]).collect();
    }
    let cut = track(&samples, Some(&clock), &dwells, &config).expect("a track");
    assert_eq!(cut.last().expect("a track").motion, whole.last().expect("a track").motion + 1);
    assert!(cut.iter().all(|m| (m.time_ns - middle).abs() > 190_000_000));
}

#[test]
fn without_a_sensor_there_is_nothing_to_follow() {
    let (_, mut samples, _) = recorded(1, 0.0);
    samples.tip = None;
    assert!(track(&samples, None, &[], &DwellConfig::default()).expect("a track").is_empty());
}
