use super::*;
use crate::testkit::{Random, Session, ns, tip_m};
use nalgebra::Rotation3;

/// Twenty-five dwells, about a minute and a half, seen by a sensor with noise, offset and drift.
fn session(seed: u64) -> (Random, Session) {
    let mut r = Random::new(seed);
    let session = Session::random(&mut r, 25, (0.8, 1.6), (0.8, 2.2));
    (r, session)
}

fn nominal(q: &[f64]) -> Vector3<f64> {
    tip_m(q, 0.0)
}

fn align(joints: &JointSamples, tip: &PoseSamples) -> (ClockAlignment, Vec<Warning>) {
    align_clocks(joints, tip, &nominal, &ClockConfig::default()).expect("aligns")
}

/// Error of the conversion over its standard error, at a fraction of the recording.
fn pull(found: &ClockAlignment, tip: &PoseSamples, offset_s: f64, drift: f64, share: f64, end_s: f64) -> f64 {
    let row = ((tip.len() - 1) as f64 * share) as usize;
    let sensor_ns = tip.time_ns[row];
    // The planted clock is sensor = robot + offset + drift * (robot - middle).
    let robot_s = ((sensor_ns - ns(0.0)) as f64 * 1e-9 - offset_s + drift * 0.5 * end_s) / (1.0 + drift);
    (found.to_robot_ns(sensor_ns) - ns(robot_s)) as f64 * 1e-9 / found.sigma_s(sensor_ns)
}

#[test]
fn planted_offset_and_drift_lie_within_two_sigma() {
    let seeds = 120;
    let (mut middle, mut end, mut rate, mut sigmas) = (0, 0, 0, Vec::new());
    for seed in 0..seeds {
        let (mut r, s) = session(seed);
        let (offset_s, drift) = (r.between(-1.5, 1.5), r.between(-3e-4, 3e-4));
        let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
        let tip = s.tip(&mut r, 120.0, 1.4e-4, offset_s, drift);
        let (found, _) = align(&joints, &tip);
        middle += u32::from(pull(&found, &tip, offset_s, drift, 0.5, s.end_s()).abs() < 2.0);
        end += u32::from(pull(&found, &tip, offset_s, drift, 1.0, s.end_s()).abs() < 2.0);
        rate += u32::from((found.drift - drift).abs() < 2.0 * found.drift_sigma);
        sigmas.push(found.offset_sigma_s);
    }
    // 95 % of 120 is 114; three standard deviations of a binomial are 7.
    for (what, inside) in [("middle", middle), ("end", end), ("drift", rate)] {
        assert!((107..=120).contains(&inside), "{what}: {inside} of {seeds}");
    }
    let typical = percentile(&sigmas, 0.5);
    assert!(typical < 2e-3, "typical sigma {typical}");
}

#[test]
fn streams_with_the_same_stamps_have_no_offset() {
    let (mut r, s) = session(1);
    let joints = s.encoders(&mut r, 50.0, 2e-5, 0.0);
    let position_m = (0..joints.len()).map(|i| tip_m(&joints.row_rad(i), 1.0)).collect();
    let tip = PoseSamples { time_ns: joints.time_ns.clone(), position_m, ..PoseSamples::default() };
    let (found, warnings) = align(&joints, &tip);
    assert!(found.offset_s.abs() < 2.5 * found.offset_sigma_s.max(1e-4), "{found:?}");
    assert!(found.offset_sigma_s < 2e-3 && found.correlation > 0.98, "{found:?}");
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn another_path_between_the_same_poses_is_timed_by_its_beginnings_and_ends() {
    // As in recordings put together from poses: the tip goes straight, the joints swing an arc to elsewhere.
    for seed in 0..5 {
        let mut r = Random::new(seed);
        let mut s = Session::random(&mut r, 60, (0.8, 0.8), (0.5, 0.5));
        for pose in &mut s.poses_rad {
            pose[0] *= 3.0;
            pose[1] *= 2.0;
            pose[2] *= 4.0;
        }
        let joints = s.encoders(&mut r, 50.0, 2e-5, 0.0);
        let tips: Vec<Vector3<f64>> = s.poses_rad.iter().map(|q| tip_m(q, 1.0)).collect();
        let straight = |t_s: f64| {
            let next = s.dwells_s.partition_point(|d| d.0 <= t_s).min(tips.len() - 1);
            let at = s.dwells_s.partition_point(|d| d.0 <= t_s).saturating_sub(1);
            let u = ((t_s - s.dwells_s[at].1) / 0.5).clamp(0.0, 1.0);
            tips[at] + (tips[next] - tips[at]) * (u.powi(3) * (10.0 - 15.0 * u + 6.0 * u * u))
        };
        let mut tip = PoseSamples::default();
        for i in 0..(s.end_s() * 60.0) as usize {
            let t_s = i as f64 / 60.0;
            tip.time_ns.push(ns(t_s + 0.15));
            tip.position_m.push(straight(t_s) + Vector3::from_fn(|_, _| 2e-5 * r.normal()));
        }
        let (found, _) = align(&joints, &tip);
        assert!((found.offset_s - 0.15).abs() < 4.0 * found.offset_sigma_s + 1e-3, "seed {seed}: {found:?}");
        assert!(found.offset_sigma_s < 5e-3, "seed {seed}: {found:?}");
    }
}

#[test]
fn gaps_occlusion_and_jitter_are_survived() {
    let (mut r, s) = session(2);
    let mut joints = s.encoders(&mut r, 125.0, 2e-5, std::f64::consts::TAU / 16384.0);
    for t in &mut joints.time_ns {
        *t += (1e-3 * r.uniform() * 1e9) as i64;
    }
    let mut tip = s.tip(&mut r, 60.0, 2e-4, 0.3, 0.0);
    // Every third second unseen, and one frame in ten lost.
    let keep: Vec<bool> =
        tip.time_ns.iter().map(|t| ((t - ns(0.0)) / 1_000_000_000) % 3 != 1 && r.uniform() > 0.1).collect();
    let mut kept = keep.iter();
    tip.time_ns.retain(|_| *kept.next().unwrap_or(&true));
    let mut kept = keep.iter();
    tip.position_m.retain(|_| *kept.next().unwrap_or(&true));
    let (found, _) = align(&joints, &tip);
    // The stamps of the robot are late by 0.5 ms on average.
    assert!((found.offset_s - 0.2995).abs() < 3.0 * found.offset_sigma_s, "{found:?}");
    assert!(found.offset_sigma_s < 5e-3, "{found:?}");
}

#[test]
fn the_frame_of_the_sensor_does_not_matter() {
    let (mut r, s) = session(3);
    let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
    let tip = s.tip(&mut r, 100.0, 1e-4, 0.1, 0.0);
    let mut moved = tip.clone();
    let turn = Rotation3::from_euler_angles(0.3, -1.0, 2.0);
    for p in &mut moved.position_m {
        *p = turn * *p + Vector3::new(3.0, -7.0, 1.0);
    }
    let (a, b) = (align(&joints, &tip).0, align(&joints, &moved).0);
    assert!((a.offset_s - b.offset_s).abs() < 1e-7 && (a.drift - b.drift).abs() < 1e-9);
}

#[test]
fn shifting_both_streams_shifts_the_reference_only() {
    let (mut r, s) = session(4);
    let (mut joints, mut tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 1e-4));
    let before = align(&joints, &tip).0;
    let shift_ns = 12_345_678_901_234;
    joints.time_ns.iter_mut().chain(&mut tip.time_ns).for_each(|t| *t += shift_ns);
    let after = align(&joints, &tip).0;
    assert_eq!(after.reference_ns - shift_ns, before.reference_ns);
    assert!((after.offset_s - before.offset_s).abs() < 1e-12, "{before:?} {after:?}");
}

#[test]
fn another_epoch_is_refused_and_bridged_by_the_configuration() {
    let (mut r, s) = session(5);
    let (joints, mut tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.25, 0.0));
    tip.time_ns.iter_mut().for_each(|t| *t -= ns(0.0));
    let Err(DwellError::NoOverlap { suggested_offset_s, .. }) =
        align_clocks(&joints, &tip, &nominal, &ClockConfig::default())
    else {
        panic!("must not align")
    };
    let config = ClockConfig { initial_offset_s: suggested_offset_s, ..ClockConfig::default() };
    let (found, _) = align_clocks(&joints, &tip, &nominal, &config).expect("aligns");
    let truth_s = 0.25 - ns(0.0) as f64 * 1e-9;
    assert!((found.offset_s - truth_s).abs() < 3.0 * found.offset_sigma_s + 1e-6, "{found:?}");
}

#[test]
fn wrong_units_are_named() {
    let (mut r, s) = session(6);
    let (joints, tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 0.0));
    let refuse = |joints: &JointSamples, tip: &PoseSamples| {
        align_clocks(joints, tip, &nominal, &ClockConfig::default()).expect_err("units").to_string()
    };
    let mut mm = tip.clone();
    mm.position_m.iter_mut().for_each(|p| *p *= 1e3);
    assert!(refuse(&joints, &mm).contains("unit = \"mm\" for the tip stream"));
    let mut degrees = joints.clone();
    degrees.joint_rad.iter_mut().flatten().for_each(|q| *q = q.to_degrees());
    assert!(refuse(&degrees, &tip).contains("unit = \"deg\" for"), "{}", refuse(&degrees, &tip));
    let mut radians_as_degrees = joints;
    radians_as_degrees.joint_rad.iter_mut().flatten().for_each(|q| *q = q.to_radians());
    let said = refuse(&radians_as_degrees, &tip);
    assert!(said.contains("declared unit = \"deg\"") || said.contains("never moves"), "{said}");
}

#[test]
fn nothing_to_align_by_is_refused() {
    let (mut r, s) = session(7);
    let (joints, tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 0.0));
    let refuse = |joints: &JointSamples, tip: &PoseSamples| {
        align_clocks(joints, tip, &nominal, &ClockConfig::default()).expect_err("refused")
    };
    let mut still = tip.clone();
    still.position_m.iter_mut().for_each(|p| *p = Vector3::new(1.0, 2.0, 3.0));
    assert!(matches!(refuse(&joints, &still), DwellError::NoMotion { .. }));
    let mut frozen = joints.clone();
    frozen.joint_rad.iter_mut().flatten().for_each(|q| *q = 0.3);
    assert!(matches!(refuse(&frozen, &tip), DwellError::NoMotion { .. }));
    // The tip of another session.
    let (mut r, other) = session(8);
    let foreign = other.tip(&mut r, 100.0, 1e-4, 0.0, 0.0);
    assert!(matches!(refuse(&joints, &foreign), DwellError::CorrelationTooLow { .. }));
    assert!(matches!(refuse(&joints, &PoseSamples::default()), DwellError::NoSamples { .. }));
}

#[test]
fn an_offset_beyond_the_search_is_said() {
    let (mut r, s) = session(9);
    let (joints, tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.25, 0.0));
    let config = ClockConfig { max_offset_s: 0.2, ..ClockConfig::default() };
    let refused = align_clocks(&joints, &tip, &nominal, &config);
    assert!(matches!(refused, Err(DwellError::OffsetAtEdge { .. })), "{refused:?}");
}

#[test]
fn a_clock_set_during_the_recording_is_noticed() {
    let (mut r, s) = session(10);
    let (joints, mut tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 0.0));
    let half = tip.len() * 2 / 3;
    tip.time_ns[half..].iter_mut().for_each(|t| *t += 120_000_000);
    let (_, warnings) = align(&joints, &tip);
    assert!(warnings.iter().any(|w| w.code == "clock-not-linear"), "{warnings:?}");
}

#[test]
fn strange_numbers_do_not_panic() {
    let huge = 1e300;
    for n in [1, 2, 3, 500] {
        let time_ns: Vec<i64> = (0..n).map(|i| i64::MIN / 2 + i as i64 * 10_000_000).collect();
        let column: Vec<f64> = (0..n).map(|i| if i % 2 == 0 { huge } else { -huge }).collect();
        let joints =
            JointSamples { time_ns: time_ns.clone(), joint_rad: vec![column; 3], ..JointSamples::default() };
        let position_m = (0..n).map(|i| Vector3::new(huge, f64::from(i), -huge)).collect();
        let tip = PoseSamples { time_ns, position_m, ..PoseSamples::default() };
        let at = |q: &[f64]| Vector3::new(q[0], q[1] * 1e10, 0.0);
        assert!(align_clocks(&joints, &tip, &at, &ClockConfig::default()).is_err());
    }
}
