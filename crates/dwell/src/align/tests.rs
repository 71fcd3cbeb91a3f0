use super::*;
use crate::KnownClock;
use crate::testkit::{Formula, Random, Session, WRONG_SIGMA, Wrong, nominal, ns, tip_m};
use armcal_core::{Code, Severity};
use nalgebra::Rotation3;

/// Twenty-five dwells, about a minute and a half, seen by a sensor with noise, offset and drift.
fn session(seed: u64) -> (Random, Session) {
    let mut r = Random::new(seed);
    let session = Session::random(&mut r, 25, (0.8, 1.6), (0.8, 2.2));
    (r, session)
}

type Nominal = fn(&[f64], &[f64]) -> Vector3<f64>;

const ARM: &Formula<Nominal> = &Formula { tip_m: nominal, uncertain: WRONG_SIGMA.len() };

fn align(joints: &JointSamples, tip: &PoseSamples) -> (ClockAlignment, Vec<Warning>) {
    align_clocks(joints, tip, ARM, &ClockConfig::default()).expect("aligns")
}

/// Error of the conversion over its standard error, at a fraction of the recording.
fn pull(found: &ClockAlignment, tip: &PoseSamples, offset_s: f64, drift: f64, share: f64, end_s: f64) -> f64 {
    let row = ((tip.len() - 1) as f64 * share) as usize;
    let sensor_ns = tip.time_ns[row];
    // The planted clock is sensor = robot + offset + drift * (robot - middle).
    let robot_s = ((sensor_ns - ns(0.0)) as f64 * 1e-9 - offset_s + drift * 0.5 * end_s) / (1.0 + drift);
    (found.to_robot_ns(sensor_ns) - ns(robot_s)) as f64 * 1e-9 / found.sigma_s(sensor_ns)
}

/// An arm drawn from the prior of the nominal one.
fn arm(r: &mut Random) -> Wrong {
    WRONG_SIGMA.map(|sigma| sigma * r.normal())
}

#[test]
fn intervals_of_offset_and_drift_hold_the_truth_as_often_as_they_say() {
    // Poses at random, and four poses in a circle, where the error of the arm repeats and looks like one of the clock.
    let (mut middle, mut end, mut rate, mut sigmas, mut errors) = (0, 0, 0, Vec::new(), Vec::new());
    let seeds = 200;
    for seed in 0..seeds {
        let mut r = Random::new(seed);
        let (count, of) = if seed % 2 == 0 { (20, 20) } else { (24, 4) };
        let mut s = Session::random(&mut r, count, (0.8, 1.6), (0.8, 2.2));
        for k in of..count {
            s.poses_rad[k] = s.poses_rad[k % of].clone();
        }
        let (offset_s, drift, wrong) = (r.between(-1.5, 1.5), r.between(-3e-4, 3e-4), arm(&mut r));
        let joints = s.encoders(&mut r, 50.0, 2e-5, 0.0);
        let tip = s.tip_of(&mut r, &wrong, 60.0, 1.4e-4, offset_s, drift);
        let (found, warnings) = align(&joints, &tip);
        assert!(warnings.iter().all(|w| w.code != Code::ClockNotLinear), "seed {seed}: {warnings:?}");
        let at = |share| pull(&found, &tip, offset_s, drift, share, s.end_s());
        middle += u32::from(at(0.5).abs() < 1.96);
        end += u32::from(at(1.0).abs() < 1.96);
        rate += u32::from((found.drift - drift).abs() < 1.96 * found.drift_sigma);
        sigmas.push(found.offset_sigma_s);
        errors.push(at(0.5) * found.sigma_s(tip.time_ns[tip.len() / 2]));
    }
    let typical = percentile(&sigmas, 0.5);
    let error = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    for (what, inside) in [("middle", middle), ("end", end), ("drift", rate)] {
        assert!(inside >= 180, "{what}: {inside} of {seeds}");
    }
    // Nor are they wider than they need to be.
    assert!(typical < 1.5 * error, "typical sigma {typical}, error {error}");
    assert!(typical < 2e-4 && error < 2e-4, "typical sigma {typical}, error {error}");
}

#[test]
fn of_a_long_recording_pieces_tell_the_clocks() {
    // Half an hour, of which a part is looked at; an arm drawn from its prior each time.
    let (mut middle, mut end, mut rate, mut errors_s) = (0, 0, 0, Vec::new());
    let seeds = 50;
    for seed in 0..seeds {
        let mut r = Random::new(1000 + seed);
        let s = Session::random(&mut r, 650, (0.8, 1.6), (0.8, 2.2));
        let (offset_s, drift, wrong) = (r.between(-1.5, 1.5), r.between(-3e-4, 3e-4), arm(&mut r));
        let joints = s.encoders(&mut r, 50.0, 2e-5, 0.0);
        let tip = s.tip_of(&mut r, &wrong, 60.0, 1.4e-4, offset_s, drift);
        let (found, warnings) = align(&joints, &tip);
        assert!(warnings.is_empty(), "seed {seed}: {warnings:?}");
        let at = |share| pull(&found, &tip, offset_s, drift, share, s.end_s());
        middle += u32::from(at(0.5).abs() < 1.96);
        end += u32::from(at(1.0).abs() < 1.96);
        // Drift counts from the sensor's time, the planted one from the robot's: a square apart.
        rate += u32::from((found.drift - drift / (1.0 + drift)).abs() < 1.96 * found.drift_sigma);
        errors_s.push(at(0.5) * found.sigma_s(tip.time_ns[tip.len() / 2]));
    }
    for (what, inside) in [("middle", middle), ("end", end), ("drift", rate)] {
        assert!(inside >= 44, "{what}: {inside} of {seeds}");
    }
    let error_s = (errors_s.iter().map(|e| e * e).sum::<f64>() / errors_s.len() as f64).sqrt();
    assert!(error_s < 1.5e-5, "{error_s}");
}

#[test]
fn where_nothing_scatters_a_clock_is_right_to_a_fifth_of_a_microsecond() {
    let error_s = |seed| {
        let (mut r, s) = session(seed);
        let (offset_s, drift) = (0.0137 * seed as f64, 4e-5);
        let wrong = arm(&mut r);
        let joints = s.encoders(&mut r, 400.0, 1e-8, 0.0);
        let tip = s.tip_of(&mut r, &wrong, 170.0, 1e-8, offset_s, drift);
        let (found, _) = align(&joints, &tip);
        pull(&found, &tip, offset_s, drift, 0.5, s.end_s()) * found.sigma_s(tip.time_ns[tip.len() / 2])
    };
    let errors_s: Vec<f64> = (30..42).map(error_s).collect();
    let rms_s = (errors_s.iter().map(|e| e * e).sum::<f64>() / errors_s.len() as f64).sqrt();
    assert!(rms_s < 2e-7, "{rms_s} {errors_s:?}");
}

#[test]
fn a_clock_set_in_a_long_recording_is_noticed_where_it_was() {
    for (seed, by_s) in [(70, 0.03_f64), (72, 0.2)] {
        let mut r = Random::new(seed);
        let s = Session::random(&mut r, 650, (0.8, 1.6), (0.8, 2.2));
        let (joints, mut tip) = (s.encoders(&mut r, 50.0, 2e-5, 0.0), s.tip(&mut r, 60.0, 1e-4, 0.1, 0.0));
        let from = tip.len() * 2 / 3;
        let set_s = (tip.time_ns[from] - tip.time_ns[0]) as f64 * 1e-9;
        tip.time_ns[from..].iter_mut().for_each(|t| *t += (by_s * 1e9) as i64);
        let (_, warnings) = align(&joints, &tip);
        let said = warnings.iter().find(|w| w.code == Code::ClockNotLinear).expect("noticed");
        let number = |before: &str| -> f64 {
            let after = said.message.split(before).nth(1).and_then(|rest| rest.split(' ').next());
            after.and_then(|word| word.parse().ok()).unwrap_or_else(|| panic!("{}", said.message))
        };
        // A fiftieth of the recording is told as one movement.
        assert!((number("from ") - set_s).abs() < s.end_s() / 20.0, "{set_s}: {}", said.message);
        assert!((number("stamps are ") - by_s * 1e3).abs() < 5.0, "{}", said.message);
    }
}

#[test]
fn rows_denser_than_the_kernel_tell_nothing_more() {
    let (mut r, s) = session(20);
    let (joints, tip) = (s.encoders(&mut r, 1000.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 5e-5));
    let every: Vec<usize> = (0..joints.len()).step_by(10).collect();
    let thin = JointSamples {
        time_ns: every.iter().map(|row| joints.time_ns[*row]).collect(),
        joint_rad: joints.joint_rad.iter().map(|c| every.iter().map(|row| c[*row]).collect()).collect(),
        ..joints.clone()
    };
    let ([dense, thin], tip_ns) =
        ([&joints, &thin].map(|joints| align(joints, &tip).0), tip.time_ns[tip.len() / 2]);
    let apart_s = (dense.to_robot_ns(tip_ns) - thin.to_robot_ns(tip_ns)) as f64 * 1e-9;
    assert!(apart_s.abs() < 0.2 * dense.sigma_s(tip_ns), "{apart_s} {dense:?} {thin:?}");
}

#[test]
fn few_movements_are_no_clock_that_was_set() {
    for seed in 0..60 {
        let mut r = Random::new(seed);
        let (count, move_s) = [(8, (0.8, 2.2)), (12, (3.0, 6.0)), (25, (0.8, 2.2))][seed as usize % 3];
        let mut s = Session::random(&mut r, count, (0.8, 1.6), move_s);
        // Another region from the middle on, where the arm is wrong in another way.
        let half = count / 2;
        for pose in &mut s.poses_rad[half..] {
            pose[0] = 0.5 * pose[0] - 1.2;
            pose[2] += 0.6;
        }
        let wrong = arm(&mut r);
        let (joints, tip) =
            (s.encoders(&mut r, 50.0, 2e-5, 0.0), s.tip_of(&mut r, &wrong, 60.0, 1.4e-4, 0.2, 0.0));
        let Ok((_, warnings)) = align_clocks(&joints, &tip, ARM, &ClockConfig::default()) else { continue };
        assert!(warnings.iter().all(|w| w.code != Code::ClockNotLinear), "seed {seed}: {warnings:?}");
    }
}

#[test]
fn a_drift_beyond_the_limit_is_taken_on_it_and_reported() {
    let (mut r, s) = session(21);
    let (joints, tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 6e-4));
    let config = ClockConfig { max_drift_ppm: 200.0, ..ClockConfig::default() };
    let (found, warnings) = align_clocks(&joints, &tip, ARM, &config).expect("aligns");
    assert!((found.drift - 2e-4).abs() < 1e-12, "{found:?}");
    assert!(found.drift_sigma > 3e-4, "what the data want is not ruled out: {found:?}");
    let limited = warnings.iter().find(|w| w.code == Code::ClockDriftLimited).expect("reported");
    assert!(
        limited.severity == Severity::Inadequate && limited.message.contains("+60"),
        "{}",
        limited.message
    );
    let free = align(&joints, &tip).0;
    assert!((free.drift - 6e-4).abs() < 4.0 * free.drift_sigma && free.drift_sigma < 5e-5, "{free:?}");
}

#[test]
fn a_declared_clock_is_taken_and_contradicted_where_the_motion_does() {
    let (mut r, s) = session(22);
    let joints = s.encoders(&mut r, 100.0, 2e-5, 0.0);
    let same = ClockConfig { known: Some(KnownClock::Same), ..ClockConfig::default() };
    let tip = s.tip(&mut r, 100.0, 1e-4, 0.0, 0.0);
    let (found, warnings) = align_clocks(&joints, &tip, ARM, &same).expect("as declared");
    assert_eq!((found.offset_s, found.drift, found.declared), (0.0, 0.0, true));
    assert!(warnings.is_empty(), "{warnings:?}");
    let late = s.tip(&mut r, 100.0, 1e-4, 0.04, 0.0);
    let (found, warnings) = align_clocks(&joints, &late, ARM, &same).expect("as declared");
    assert_eq!(found.to_robot_ns(late.time_ns[7]), late.time_ns[7]);
    assert!(warnings.len() == 1 && warnings[0].code == Code::ClockContradicted, "{warnings:?}");
    assert!(warnings[0].message.contains("+40.0 ±"), "{}", warnings[0].message);
    // The declared offset holds at the sensor's first stamp.
    let drifting = s.tip(&mut r, 100.0, 1e-4, 0.04, 2e-4);
    let first_ms = 40.0 - 0.1 * s.end_s();
    let right = ClockConfig { offset_ms: Some(first_ms), drift_ppm: Some(200.0), ..ClockConfig::default() };
    let (found, warnings) = align_clocks(&joints, &drifting, ARM, &right).expect("as declared");
    assert!(warnings.is_empty(), "{warnings:?}");
    assert!((found.offset_s - first_ms * 1e-3).abs() < 1e-12 && found.reference_ns == drifting.time_ns[0]);
    // Too little motion to check is a notice, and the recording is kept.
    let still = JointSamples { joint_rad: vec![vec![0.3; joints.len()]; 3], ..joints };
    let (_, warnings) = align_clocks(&still, &tip, ARM, &same).expect("as declared");
    assert!(warnings.len() == 1 && warnings[0].code == Code::ClockUnchecked, "{warnings:?}");
    for bad in [
        ClockConfig { offset_ms: Some(1.0), ..same.clone() },
        ClockConfig { drift_ppm: Some(1.0), ..ClockConfig::default() },
        ClockConfig { offset_ms: Some(1.0), drift_ppm: Some(2e3), ..ClockConfig::default() },
    ] {
        assert!(matches!(bad.check(), Err(DwellError::Config { .. })), "{bad:?}");
    }
}

#[test]
fn rows_lost_at_random_cost_accuracy_and_no_recording() {
    let mut sigmas = Vec::new();
    for (seed, lost) in [(31, 0.5), (32, 0.5), (33, 0.7), (34, 0.7)] {
        let (mut r, s) = session(seed);
        let wrong = arm(&mut r);
        let (mut joints, mut tip) =
            (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip_of(&mut r, &wrong, 120.0, 1e-4, 0.3, 0.0));
        let kept: Vec<usize> = (0..joints.len()).filter(|_| r.uniform() > lost).collect();
        joints.time_ns = kept.iter().map(|i| joints.time_ns[*i]).collect();
        joints.joint_rad = joints.joint_rad.iter().map(|c| kept.iter().map(|i| c[*i]).collect()).collect();
        let kept: Vec<usize> = (0..tip.len()).filter(|_| r.uniform() > lost).collect();
        tip.time_ns = kept.iter().map(|i| tip.time_ns[*i]).collect();
        tip.position_m = kept.iter().map(|i| tip.position_m[*i]).collect();
        let (found, warnings) = align(&joints, &tip);
        assert!((found.offset_s - 0.3).abs() < 4.0 * found.offset_sigma_s, "{found:?}");
        assert!(warnings.iter().all(|w| w.severity == Severity::Notice), "{warnings:?}");
        sigmas.push(found.offset_sigma_s);
    }
    assert!(sigmas.iter().all(|s| *s < 5e-3), "{sigmas:?}");
}

#[test]
fn a_stream_in_shreds_is_refused_for_what_it_is() {
    let (mut r, s) = session(23);
    let (joints, mut tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 0.0));
    // Ten rows, then two tenths of a second of nothing.
    let kept: Vec<usize> = (0..tip.len()).filter(|i| i % 30 < 10).collect();
    tip.time_ns = kept.iter().map(|i| tip.time_ns[*i]).collect();
    tip.position_m = kept.iter().map(|i| tip.position_m[*i]).collect();
    let refused = align_clocks(&joints, &tip, ARM, &ClockConfig::default()).expect_err("shreds").to_string();
    assert!(refused.contains("tip stream has no unbroken stretch"), "{refused}");
    assert!(refused.contains("67 % of the rows of the tip stream are missing"), "{refused}");
    assert!(!refused.contains("unit"), "{refused}");
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
        align_clocks(&joints, &tip, ARM, &ClockConfig::default())
    else {
        panic!("must not align")
    };
    let config = ClockConfig { initial_offset_s: suggested_offset_s, ..ClockConfig::default() };
    let (found, _) = align_clocks(&joints, &tip, ARM, &config).expect("aligns");
    let truth_s = 0.25 - ns(0.0) as f64 * 1e-9;
    assert!((found.offset_s - truth_s).abs() < 3.0 * found.offset_sigma_s + 1e-6, "{found:?}");
}

#[test]
fn wrong_units_are_named() {
    let (mut r, s) = session(6);
    let (joints, tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 0.0));
    let refuse = |joints: &JointSamples, tip: &PoseSamples| {
        align_clocks(joints, tip, ARM, &ClockConfig::default()).expect_err("units").to_string()
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
        align_clocks(joints, tip, ARM, &ClockConfig::default()).expect_err("refused")
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
    let refused = align_clocks(&joints, &tip, ARM, &config);
    assert!(matches!(refused, Err(DwellError::OffsetAtEdge { .. })), "{refused:?}");
}

#[test]
fn a_clock_set_during_the_recording_is_noticed_with_its_size() {
    for (seed, by_s, share) in [(10, 0.12_f64, 0.67), (11, -0.031, 0.67), (12, 1.0, 0.8)] {
        let (mut r, s) = session(seed);
        let (joints, mut tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.1, 0.0));
        let half = (tip.len() as f64 * share) as usize;
        let set_s = (tip.time_ns[half] - tip.time_ns[0]) as f64 * 1e-9;
        tip.time_ns[half..].iter_mut().for_each(|t| *t += (by_s * 1e9) as i64);
        let mut rows: Vec<usize> = (0..tip.len()).collect();
        rows.sort_by_key(|row| tip.time_ns[*row]);
        tip.time_ns = rows.iter().map(|row| tip.time_ns[*row]).collect();
        tip.position_m = rows.iter().map(|row| tip.position_m[*row]).collect();
        let (_, warnings) = align(&joints, &tip);
        let said = warnings
            .iter()
            .find(|w| w.code == Code::ClockNotLinear)
            .unwrap_or_else(|| panic!("{seed}: {warnings:?}"));
        let later = if by_s > 0.0 { "later" } else { "earlier" };
        let size_ms: f64 = said
            .message
            .split("stamps are ")
            .nth(1)
            .and_then(|s| s.split(' ').next()?.parse().ok())
            .expect("a size");
        assert!((size_ms - by_s.abs() * 1e3).abs() < 5.0 && said.message.contains(later), "{}", said.message);
        let at_s: f64 = said
            .message
            .split("from ")
            .nth(1)
            .and_then(|s| s.split(' ').next()?.parse().ok())
            .unwrap_or_else(|| panic!("{}", said.message));
        assert!((at_s - set_s).abs() < 8.0, "{at_s} {set_s}: {}", said.message);
        assert!(said.message.contains("no rows come in bursts"), "{}", said.message);
    }
}

#[test]
fn stamps_of_a_recorder_that_stalls_are_not_a_clock_that_was_set() {
    let (mut r, s) = session(13);
    let (joints, mut tip) = (s.encoders(&mut r, 100.0, 2e-5, 0.0), s.tip(&mut r, 100.0, 1e-4, 0.0, 0.0));
    // For 20 s the recorder writes once in 0.8 s.
    let (from, to) = (ns(20.0), ns(40.0));
    let mut last = 0;
    for t in &mut tip.time_ns {
        if (from..to).contains(t) {
            let written = from + ((*t - from) / 800_000_000 + 1) * 800_000_000;
            *t = written.max(last + 1000);
        }
        *t = (*t).max(last + 1000);
        last = *t;
    }
    let (_, warnings) = align(&joints, &tip);
    for said in warnings.iter().filter(|w| w.code == Code::ClockNotLinear) {
        assert!(said.message.contains("bursts after stalls of up to 0.8 s"), "{}", said.message);
        assert!(!said.message.contains("clock was set"), "{}", said.message);
    }
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
        let at = |q: &[f64], _: &[f64]| Vector3::new(q[0], q[1] * 1e10, 0.0);
        let arm = &Formula { tip_m: at, uncertain: 2 };
        assert!(align_clocks(&joints, &tip, arm, &ClockConfig::default()).is_err());
    }
}
