use super::*;
use crate::testkit::{Formula, Random, Session, ns, tip_m};
use armcal_core::{Arrival, Code, JointSamples, PoseSamples, ScalarSamples};
use nalgebra::Vector3;
use proptest::prelude::*;

const COUNT_RAD: f64 = std::f64::consts::TAU / 8192.0;

fn detect(samples: &Samples) -> (Vec<Dwell>, Vec<Warning>) {
    detect_dwells(0, samples, None, &DwellConfig::default()).expect("detects")
}

fn only_joints(joints: JointSamples) -> Samples {
    Samples { joints, ..Samples::default() }
}

/// Every planted dwell found once, in order, with its edges and its pose.
fn assert_found(session: &Session, dwells: &[Dwell], edge_s: f64, angle_rad: f64, what: &str) {
    assert_eq!(dwells.len(), session.dwells_s.len(), "{what}");
    let planted = session.dwells_s.iter().zip(&session.poses_rad);
    for (found, ((start_s, end_s), pose)) in dwells.iter().zip(planted) {
        let early = (found.start_ns - ns(*start_s)) as f64 * 1e-9;
        let late = (found.end_ns - ns(*end_s)) as f64 * 1e-9;
        assert!(early.abs() < edge_s && late.abs() < edge_s, "{what} {}: {early} {late}", found.id);
        for (mean, truth) in found.joint_rad.iter().zip(pose) {
            assert!((mean - truth).abs() < angle_rad, "{what} {}: {mean} {truth}", found.id);
        }
    }
}

#[test]
fn planted_dwells_are_found_exactly() {
    for seed in 0..40 {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 12, (0.5, 1.6), (0.5, 1.5));
        let rate_hz = [50.0, 100.0, 250.0][seed as usize % 3];
        let (dwells, warnings) = detect(&only_joints(s.encoders(&mut r, rate_hz, 2e-5, 0.0)));
        assert_found(&s, &dwells, 0.1, 2e-5, &format!("seed {seed} at {rate_hz} Hz"));
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

#[test]
fn quantised_encoders_without_any_noise_are_found() {
    for seed in 0..20 {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 10, (0.6, 1.4), (0.5, 1.5));
        let (dwells, _) = detect(&only_joints(s.encoders(&mut r, 100.0, 0.0, COUNT_RAD)));
        assert_found(&s, &dwells, 0.15, COUNT_RAD, &format!("seed {seed}"));
        for d in &dwells {
            assert!(d.joint_sigma_rad.iter().all(|s| *s > 0.9 * COUNT_RAD / 12f64.sqrt()), "{d:?}");
        }
    }
}

#[test]
fn a_reading_flickering_between_counts_is_still() {
    for seed in 0..20 {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 10, (0.6, 1.4), (0.5, 1.5));
        let (dwells, _) = detect(&only_joints(s.encoders(&mut r, 100.0, 0.4 * COUNT_RAD, COUNT_RAD)));
        assert_found(&s, &dwells, 0.15, 0.6 * COUNT_RAD, &format!("seed {seed}"));
    }
}

#[test]
fn tremor_and_slow_settling_before_rest_are_left_out() {
    for seed in 0..20 {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 8, (1.6, 2.4), (0.6, 1.2));
        let mut joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
        let phase = r.between(0.0, 6.0);
        for (row, t) in joints.time_ns.iter().enumerate() {
            let t_s = (t - ns(0.0)) as f64 * 1e-9;
            let Some(d) = s.dwells_s.iter().find(|d| (d.0..d.1).contains(&t_s)) else { continue };
            let since_s = t_s - d.0;
            // 0.06 deg of tremor at 9 Hz for half a second, and a creep of 0.05 deg with 0.15 s.
            let tremor = if since_s < 0.5 {
                1e-3 * (phase + 9.0 * std::f64::consts::TAU * since_s).sin()
            } else {
                0.0
            };
            joints.joint_rad[1][row] += tremor;
            joints.joint_rad[2][row] += 9e-4 * (-since_s / 0.15).exp();
        }
        let (dwells, _) = detect(&only_joints(joints));
        assert_eq!(dwells.len(), 8, "seed {seed}");
        for (found, (d, pose)) in dwells.iter().zip(s.dwells_s.iter().zip(&s.poses_rad)) {
            let after_s = (found.start_ns - ns(d.0)) as f64 * 1e-9;
            assert!((0.4..0.75).contains(&after_s), "seed {seed} {}: starts {after_s} s in", found.id);
            assert!((found.joint_rad[1] - pose[1]).abs() < 2e-5, "seed {seed} {}", found.id);
            assert!((found.joint_rad[2] - pose[2]).abs() < 3e-5, "seed {seed} {}", found.id);
        }
    }
}

/// Every joint of every dwell given a way to creep, of the time since the dwell began and its length [s].
fn with_creep(s: &Session, joints: &mut JointSamples, creep_rad: impl Fn(usize, f64, f64) -> f64) {
    for (row, t) in joints.time_ns.iter().enumerate() {
        let t_s = (t - ns(0.0)) as f64 * 1e-9;
        if let Some(d) = s.dwells_s.iter().find(|d| (d.0..=d.1).contains(&t_s)) {
            for (j, column) in joints.joint_rad.iter_mut().enumerate() {
                column[row] += creep_rad(j, t_s - d.0, d.1 - d.0);
            }
        }
    }
}

#[test]
fn dwells_of_an_arm_that_gives_way_are_kept_once_with_the_settled_reading() {
    // Steadily by 0.05 deg a second in joint 1; by 0.25 deg with 0.8 s in joint 2.
    for (name, steady_deg_s, settling_deg) in
        [("steady", 0.05, 0.0), ("settling", 0.0, 0.25), ("both", 0.03, 0.2)]
    {
        for seed in 0..20 {
            let mut r = Random::new(seed);
            let s = Session::random(&mut r, 8, (1.6, 2.4), (0.6, 1.2));
            let mut joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
            let at = |j: usize, t_s: f64| -> f64 {
                [steady_deg_s * t_s, settling_deg * ((-t_s / 0.8f64).exp() - 1.0), 0.0][j].to_radians()
            };
            with_creep(&s, &mut joints, |j, t_s, _| at(j, t_s));
            let (dwells, warnings) = detect(&only_joints(joints));
            assert_eq!(dwells.len(), 8, "{name} seed {seed}");
            let said = warnings.iter().any(|w| w.code == Code::DwellCreeps);
            assert!(said || steady_deg_s == 0.0, "{name} seed {seed}: {warnings:?}");
            for (found, (d, pose)) in dwells.iter().zip(s.dwells_s.iter().zip(&s.poses_rad)) {
                let since_s = |t: i64| (t - ns(d.0)) as f64 * 1e-9;
                let (first_s, last_s) = (since_s(found.start_ns), since_s(found.end_ns));
                // The settled end, not the way there.
                assert!(
                    last_s > d.1 - d.0 - 0.1 && first_s > 0.4 * (d.1 - d.0),
                    "{name} seed {seed} {}",
                    found.id
                );
                for (j, rest) in pose.iter().enumerate() {
                    let (from, to) = (rest + at(j, first_s), rest + at(j, last_s));
                    let (mean, sigma) = (found.joint_rad[j], found.joint_sigma_rad[j]);
                    let inside = from.min(to) - 2e-5..=from.max(to) + 2e-5;
                    assert!(
                        inside.contains(&mean),
                        "{name} seed {seed} {} joint {j}: {mean} {inside:?}",
                        found.id
                    );
                    // A uniform error over the way that is left has 0.29 of it as its standard deviation.
                    let way = (to - from).abs();
                    assert!(
                        sigma >= 0.2 * way && sigma <= 0.5 * way + 1e-5,
                        "{name} {}: {sigma} of {way}",
                        found.id
                    );
                }
            }
        }
    }
}

#[test]
fn a_creep_at_the_edge_of_stillness_splits_no_dwell() {
    for seed in 0..30 {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 6, (3.0, 4.0), (0.6, 1.2));
        let speed_deg_s = r.between(0.005, 0.06);
        let mut joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
        with_creep(&s, &mut joints, |j, t_s, _| if j == 1 { (speed_deg_s * t_s).to_radians() } else { 0.0 });
        let (dwells, _) = detect(&only_joints(joints));
        let found: Vec<(f64, f64)> =
            dwells.iter().map(|d| ((d.start_ns - ns(0.0)) as f64 * 1e-9, d.duration_s())).collect();
        assert_eq!(dwells.len(), 6, "seed {seed} at {speed_deg_s} deg/s: {found:?} of {:?}", s.dwells_s);
    }
}

#[test]
fn two_poses_a_slow_milliradian_apart_are_two_dwells() {
    // Seen on a real arm: one second each, joined by a move of 1 mrad in 0.6 s.
    for seed in 0..20 {
        let mut r = Random::new(seed);
        let dwells_s = vec![(0.0, 1.0), (1.6, 2.6), (3.2, 4.2)];
        let poses_rad = vec![vec![0.3; 3], vec![0.3, 0.301, 0.2997], vec![0.31; 3]];
        let s = Session { dwells_s, poses_rad };
        let (dwells, _) = detect(&only_joints(s.encoders(&mut r, 100.0, 2e-5, 0.0)));
        assert_found(&s, &dwells, 0.2, 3e-5, &format!("seed {seed}"));
    }
}

#[test]
fn what_only_the_tip_sees_moving_is_no_dwell() {
    let mut r = Random::new(1);
    let s = Session::random(&mut r, 6, (2.0, 2.0), (1.0, 1.0));
    let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
    let mut tip = s.tip(&mut r, 100.0, 5e-5, 0.0, 0.0);
    // During the third dwell the hand works the tip through the play of the gear for 1.2 s.
    for (t, p) in tip.time_ns.iter().zip(&mut tip.position_m) {
        let since_s = (t - ns(s.dwells_s[2].0)) as f64 * 1e-9;
        if (0.0..1.2).contains(&since_s) {
            p.x += 2e-3 * (20.0 * since_s).sin();
        }
    }
    let samples = Samples { joints, tip: Some(tip), ..Samples::default() };
    let (dwells, _) = detect(&samples);
    assert_eq!(dwells.len(), 6);
    assert!((dwells[2].start_ns - ns(s.dwells_s[2].0)) as f64 * 1e-9 > 1.1);
    let encoders_only = DwellConfig { use_tip: false, ..DwellConfig::default() };
    let (dwells, _) = detect_dwells(0, &samples, None, &encoders_only).expect("detects");
    assert!((dwells[2].start_ns - ns(s.dwells_s[2].0)) as f64 * 1e-9 < 0.1);
}

/// A marker that is hidden in a dwell costs its own measurement there, and that is said with its count.
#[test]
fn every_marker_that_was_seen_is_measured_and_one_that_was_hidden_is_counted() {
    let mut r = Random::new(3);
    let s = Session::random(&mut r, 6, (1.5, 1.5), (1.0, 1.0));
    let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
    let seen = s.tip(&mut r, 100.0, 5e-5, 0.0, 0.0);
    let mut hidden = s.tip(&mut r, 100.0, 5e-5, 0.0, 0.0);
    let (from, to) = s.dwells_s[2];
    let kept: Vec<usize> = (0..hidden.len())
        .filter(|i| !(ns(from) - 100_000_000..ns(to) + 100_000_000).contains(&hidden.time_ns[*i]))
        .collect();
    hidden.time_ns = kept.iter().map(|i| hidden.time_ns[*i]).collect();
    hidden.position_m = kept.iter().map(|i| hidden.position_m[*i]).collect();
    let bodies = [("elbow".to_owned(), seen), ("hand".to_owned(), hidden)].into();
    let (dwells, warnings) = detect(&Samples { joints, bodies, ..Samples::default() });
    assert_eq!(dwells.len(), 6);
    for d in &dwells {
        assert!(d.tip.is_none() && d.markers.contains_key("elbow"));
        assert_eq!(d.markers.contains_key("hand"), d.id.dwell != 2);
        let error_m = (d.markers["elbow"].position_m - tip_m(&s.poses_rad[d.id.dwell], 1.0)).norm();
        assert!(error_m < 1e-4, "{error_m}");
    }
    let said: Vec<&Warning> = warnings.iter().filter(|w| w.code == Code::DwellWithoutMarker).collect();
    assert_eq!(said.len(), 1, "{warnings:?}");
    assert_eq!(said[0].subject, "marker hand");
    assert!(
        said[0].message.starts_with("the sensor saw it in 5 of 6 dwells, not in dwell 2;"),
        "{}",
        said[0].message
    );
}

#[test]
fn the_tip_is_measured_on_its_own_clock() {
    let config = DwellConfig { tip_sigma_floor_mm: 0.0, ..DwellConfig::default() };
    let (mut inside, mut all) = (0u32, 0u32);
    for seed in 0..15 {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 10, (0.8, 1.4), (0.6, 1.2));
        let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
        let tip = s.tip(&mut r, 120.0, 1.4e-4, 0.4, 0.0);
        let clock = ClockAlignment {
            offset_s: 0.4,
            offset_sigma_s: 1e-3,
            drift: 0.0,
            drift_sigma: 0.0,
            reference_ns: ns(0.0),
            first_ns: ns(0.0),
            correlation: 1.0,
            displacement_ratio: 1.0,
            declared: false,
        };
        let samples = Samples { joints, tip: Some(tip), ..Samples::default() };
        let (dwells, _) = detect_dwells(3, &samples, Some(&clock), &config).expect("detects");
        assert_found(&s, &dwells, 0.1, 2e-5, &format!("seed {seed}"));
        for (d, pose) in dwells.iter().zip(&s.poses_rad) {
            let tip = d.tip.as_ref().expect("seen");
            let error = tip.position_m - tip_m(pose, 1.0);
            let whitened = tip.covariance_m2.try_inverse().expect("regular") * error;
            all += 1;
            // 95 % of chi-square with three degrees of freedom.
            inside += u32::from(error.dot(&whitened) < 7.81);
            assert_eq!(d.id.recording, 3);
            assert_eq!((&tip.orientation, tip.orientation_sigma_rad), (&None, f64::INFINITY));
        }
    }
    assert!((0.89..=0.99).contains(&(f64::from(inside) / f64::from(all))), "{inside} of {all}");
}

#[test]
fn the_first_and_last_dwell_are_kept_whole_and_know_no_arrival() {
    let mut r = Random::new(4);
    let s = Session::random(&mut r, 3, (1.0, 1.0), (1.0, 1.0));
    let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
    let (first, last) = (joints.time_ns[0], joints.time_ns[joints.len() - 1]);
    let (dwells, _) = detect(&only_joints(joints));
    assert_eq!((dwells[0].start_ns, dwells[2].end_ns), (first, last));
    assert_eq!(dwells[0].arrival, vec![Arrival::Unknown; 3]);
    for (k, d) in dwells.iter().enumerate().skip(1) {
        for j in 0..3 {
            let up = s.poses_rad[k][j] > s.poses_rad[k - 1][j];
            assert_eq!(d.arrival[j], if up { Arrival::Positive } else { Arrival::Negative });
        }
    }
}

#[test]
fn a_gap_or_a_nan_splits_a_dwell_and_is_said() {
    let mut r = Random::new(5);
    let s = Session { dwells_s: vec![(0.0, 1.0), (2.0, 4.0)], poses_rad: vec![vec![0.0; 3], vec![0.5; 3]] };
    let whole = s.encoders(&mut r, 100.0, 2e-5, 0.0);
    let mut gap = whole.clone();
    let keep: Vec<usize> = (0..whole.len()).filter(|i| !(280..320).contains(i)).collect();
    gap.time_ns = keep.iter().map(|&i| whole.time_ns[i]).collect();
    gap.joint_rad = whole.joint_rad.iter().map(|c| keep.iter().map(|&i| c[i]).collect()).collect();
    let mut nan = whole.clone();
    nan.joint_rad[1][300] = f64::NAN;
    for (joints, gap_s) in [(gap, "0.41 s"), (nan, "0.02 s")] {
        let (dwells, warnings) = detect(&only_joints(joints));
        assert_eq!(dwells.len(), 3);
        assert_eq!(dwells[1].arrival, vec![Arrival::Positive; 3]);
        assert_eq!(dwells[2].arrival, vec![Arrival::Unknown; 3]);
        let said: Vec<&Warning> = warnings.iter().filter(|w| w.code == Code::DwellSplitByGap).collect();
        assert!(said.len() == 1 && said[0].message.contains(gap_s), "{warnings:?}");
    }
    // A short interruption at the same pose, without a gap, does not.
    let mut bump = whole;
    bump.joint_rad[0][300] += 0.01;
    let (dwells, _) = detect(&only_joints(bump));
    assert_eq!(dwells.len(), 2);
    assert!((dwells[1].joint_rad[0] - 0.5).abs() < 1e-5);
}

#[test]
fn no_dwells_comes_with_the_threshold_that_would_find_some() {
    // The joints hunt by 0.1 deg all the time.
    let n = 1000;
    let mut r = Random::new(6);
    let column = |r: &mut Random| -> Vec<f64> {
        (0..n)
            .map(|i| 1.7e-3 * (f64::from(i) * 0.1).sin() + f64::from(i / 250) * 0.3 + 1e-6 * r.normal())
            .collect()
    };
    let joint_rad = vec![column(&mut r), column(&mut r)];
    let time_ns = (0..n).map(|i| ns(f64::from(i) * 0.01)).collect();
    let names = vec!["shoulder".into(), "elbow".into()];
    let samples = only_joints(JointSamples { time_ns, names, joint_rad, ..JointSamples::default() });
    let (dwells, warnings) = detect(&samples);
    assert!(dwells.is_empty());
    let message = &warnings[0].message;
    assert_eq!(warnings[0].code, Code::NoDwells);
    let proposed = message
        .split("joint_floor_deg = ")
        .nth(1)
        .and_then(|s| s.split(' ').next()?.parse::<f64>().ok())
        .expect("a number");
    let config = DwellConfig { joint_floor_deg: proposed, ..DwellConfig::default() };
    assert!(!detect_dwells(0, &samples, None, &config).expect("detects").0.is_empty(), "{message}");
    // Pauses that are too short name min_duration_s instead.
    let s = Session::random(&mut r, 10, (0.25, 0.3), (0.6, 0.8));
    let (dwells, warnings) = detect(&only_joints(s.encoders(&mut r, 100.0, 2e-5, 0.0)));
    let kept: Vec<f64> = dwells.iter().map(Dwell::duration_s).collect();
    assert!(dwells.is_empty() && warnings[0].message.contains("min_duration_s"), "{kept:?} {warnings:?}");
}

#[test]
fn an_arm_that_never_rests_has_no_dwells() {
    let mut r = Random::new(7);
    let n = 3000;
    let joint_rad = (0..2)
        .map(|j| (0..n).map(|i| (f64::from(i) * 0.004 + f64::from(j)).sin() + 2e-5 * r.normal()).collect())
        .collect();
    let time_ns = (0..n).map(|i| ns(f64::from(i) * 0.01)).collect();
    let (dwells, warnings) =
        detect(&only_joints(JointSamples { time_ns, joint_rad, ..JointSamples::default() }));
    assert!(dwells.is_empty() && warnings[0].code == Code::NoDwells, "{}", dwells.len());
}

#[test]
fn temperature_and_effort_are_averaged() {
    let mut r = Random::new(8);
    let s = Session::random(&mut r, 3, (1.0, 1.0), (1.0, 1.0));
    let mut joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
    let rows = joints.len();
    joints.effort_nm = Some((0..3).map(|j| vec![f64::from(j) * 1.5; rows]).collect());
    // 20 degC at 0 s, 24 degC at 4 s: the second dwell (2 to 3 s) lies between.
    let temperature = Some(ScalarSamples { time_ns: vec![ns(0.0), ns(4.0)], value: vec![20.0, 24.0] });
    let samples = Samples { joints, temperature, ..Samples::default() };
    let (dwells, _) = detect(&samples);
    assert_eq!(dwells[1].effort_nm, Some(vec![0.0, 1.5, 3.0]));
    assert_eq!(dwells[0].temperature_c, Some(20.0));
    let without = |lost: &dyn Fn(usize, usize) -> bool| {
        let mut samples = samples.clone();
        for (j, column) in samples.joints.effort_nm.iter_mut().flatten().enumerate() {
            column.iter_mut().enumerate().filter(|(i, _)| lost(j, *i)).for_each(|(_, e)| *e = f64::NAN);
        }
        detect(&samples).0[1].effort_nm.clone()
    };
    // A joint without effort keeps its place; rows without one leave the mean to the others.
    let gap = without(&|j, i| j == 1 || i % 2 == 0).expect("two joints have theirs");
    assert!(gap[0] == 0.0 && gap[1].is_nan() && gap[2] == 3.0, "{gap:?}");
    assert_eq!(without(&|_, _| true), None);
    let between = dwells[1].temperature_c.expect("interpolated");
    let (b, a) = ((dwells[1].start_ns - ns(0.0)) as f64, (ns(4.0) - dwells[1].end_ns) as f64);
    assert!((between - (20.0 + 4.0 * b / (a + b))).abs() < 1e-9);
}

#[test]
fn a_dwell_knows_how_far_its_joints_have_come() {
    let mut r = Random::new(3);
    let s = Session::random(&mut r, 6, (0.5, 1.0), (0.5, 1.0));
    let dwells = detect(&only_joints(s.encoders(&mut r, 100.0, 2e-5, 0.0))).0;
    assert!(dwells.len() > 3 && dwells[0].moved_rad.is_none());
    for pair in dwells.windows(2) {
        let moved = pair[1].moved_rad.as_ref().expect("there was a dwell before");
        let ends = pair[0].joint_rad.iter().zip(&pair[1].joint_rad).zip(moved);
        assert!(ends.clone().all(|((from, to), moved)| (from + moved - to).abs() < 1e-12));
        assert!(ends.into_iter().any(|(_, moved)| moved.abs() > 1e-3), "{moved:?}");
    }
}

#[test]
fn broken_columns_are_errors() {
    let config = DwellConfig::default();
    let bad =
        |joints: JointSamples| detect_dwells(0, &only_joints(joints), None, &config).expect_err("refused");
    assert!(matches!(bad(JointSamples::default()), DwellError::NoSamples { .. }));
    let joints = JointSamples { time_ns: vec![1, 2], joint_rad: vec![vec![0.0]], ..JointSamples::default() };
    assert!(matches!(bad(joints), DwellError::Shape { rows: 1, .. }));
    let joints =
        JointSamples { time_ns: vec![2, 2], joint_rad: vec![vec![0.0; 2]], ..JointSamples::default() };
    assert!(matches!(bad(joints), DwellError::Unordered { row: 1, .. }));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn time_shift_and_joint_order_change_nothing_else(seed in 0u64..1000, shift_ns in -1_000_000_000_000i64..1_000_000_000_000) {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 4, (0.5, 1.0), (0.5, 1.0));
        let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
        let mut other = joints.clone();
        other.time_ns.iter_mut().for_each(|t| *t += shift_ns);
        other.joint_rad.rotate_left(1);
        let (a, b) = (detect(&only_joints(joints)).0, detect(&only_joints(other)).0);
        prop_assert_eq!(a.len(), b.len());
        for (mut a, b) in a.into_iter().zip(b) {
            a.start_ns += shift_ns;
            a.end_ns += shift_ns;
            a.joint_rad.rotate_left(1);
            a.joint_spread_rad.rotate_left(1);
            a.joint_sigma_rad.rotate_left(1);
            a.arrival.rotate_left(1);
            a.path_memory_rad.rotate_left(1);
            a.moved_rad.iter_mut().for_each(|moved| moved.rotate_left(1));
            // Other joints are neighbours now.
            a.pair_memory_rad.clone_from(&b.pair_memory_rad);
            prop_assert_eq!(a, b);
        }
    }

    #[test]
    fn weird_input_never_panics(
        rows in 0usize..60,
        step_ns in 1i64..3_000_000_000_000_000,
        start_ns in prop_oneof![Just(i64::MIN), Just(0), Just(1i64 << 60)],
        values in prop::collection::vec(prop_oneof![Just(0.0), Just(1.0), Just(1e300), Just(-1e300), Just(f64::NAN), -1e-6..1e-6f64], 60),
        with_tip in any::<bool>(),
    ) {
        let time_ns: Vec<i64> = (0..rows as i64).map(|i| start_ns + i * step_ns).collect();
        let joint_rad = vec![values[..rows].to_vec(), values[..rows].iter().rev().copied().collect()];
        let tip = with_tip.then(|| PoseSamples {
            time_ns: time_ns.clone(),
            position_m: values[..rows].iter().map(|v| Vector3::new(*v, -v, 1.0)).collect(),
            ..PoseSamples::default()
        });
        let samples = Samples { joints: JointSamples { time_ns, joint_rad, ..JointSamples::default() }, tip, ..Samples::default() };
        let _ = detect_dwells(0, &samples, None, &DwellConfig::default());
        if let Some(tip) = &samples.tip {
            let _ = crate::mean_pose(tip);
            let arm = Formula { tip_m: |q: &[f64], _: &[f64]| Vector3::new(q[0], q[1], 0.0), uncertain: 0 };
            let _ = crate::align_clocks(&samples.joints, tip, &arm, &crate::ClockConfig::default());
        }
    }
}
