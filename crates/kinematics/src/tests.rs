//! Is it the model of the file, is a set-point where it should be, and does what makes no sense change nothing?

use crate::{CalibratedArm, Conditions, Driven, KinematicsError, Motion, Point};
use armcal_core::{Arrival, DwellId, Observation, Reference};
use nalgebra::Vector3;

const RIG: &str = include_str!("../../../fixtures/models/paper-play.json");
const PANDA: &str = include_str!("../../../fixtures/models/panda.json");
const UR10: &str = include_str!("../../../fixtures/models/ur10.json");

fn arm(text: &str) -> CalibratedArm {
    CalibratedArm::from_json(text).unwrap()
}

/// Readings inside what was recorded, in an order in which every joint comes from either side [rad].
fn readings(arm: &CalibratedArm, count: usize) -> Vec<Vec<f64>> {
    let at = |k: usize, j: usize| ((k * (7 + 2 * j) + 3 * j) % 11) as f64 / 10.0;
    let within = |k: usize, (j, [low, high]): (usize, &[f64; 2])| low + (high - low) * (0.2 + 0.6 * at(k, j));
    (0..count)
        .map(|k| arm.file.range_rad.iter().enumerate().map(|range| within(k, range)).collect())
        .collect()
}

/// The tip by the model itself, told all of a path [m].
fn told_the_path(arm: &CalibratedArm, path: &[Vec<f64>], load_kg: f64) -> Vector3<f64> {
    let (joints, rest) = (arm.joint_count(), &path[path.len() - 1]);
    let over = |f: &dyn Fn(&Vec<f64>) -> f64| path.iter().map(f).collect::<Vec<f64>>();
    let way = |j: usize| path.windows(2).rev().map(|w| w[1][j] - w[0][j]).find(|way| *way != 0.0);
    let arrival = |j: usize| {
        way(j).map_or(Arrival::Unknown, |way| if way > 0.0 { Arrival::Positive } else { Arrival::Negative })
    };
    let facts = arm.file.recordings.last().unwrap();
    let dwell = DwellId { recording: arm.file.recordings.len() - 1, dwell: facts.last_dwell };
    let o = Observation {
        time_ns: facts.last_ns,
        arrival: (0..joints).map(arrival).collect(),
        path_memory_rad: Some((0..joints).map(|j| over(&|q| q[j])).collect()),
        pair_memory_rad: Some(
            (1..joints).map(|j| [over(&|q| q[j] + q[j - 1]), over(&|q| q[j] - q[j - 1])]).collect(),
        ),
        moved_rad: path
            .windows(2)
            .last()
            .map(|w| w[1].iter().zip(&w[0]).map(|(to, from)| to - from).collect()),
        temperature_c: facts.temperature_c,
        load_kg,
        ..Observation::bare(dwell, rest.clone(), Reference::position(Vector3::zeros()))
    };
    arm.models.model.predicted_tip_in_world(&arm.models.values, &o)
}

#[test]
fn the_tip_after_a_path_is_what_the_model_has_that_is_told_all_of_it() {
    for text in [RIG, PANDA, UR10] {
        let arm = arm(text);
        let conditions = Conditions { load_kg: Some(2.0), ..Conditions::default() };
        let mut motion = arm.motion(&conditions).unwrap();
        let path = readings(&arm, 9);
        motion.start(Some(&path[0])).unwrap();
        for k in 1..path.len() {
            let there = motion.tip(&path[k], &Driven::default()).unwrap();
            let off_m = there.translation.vector - told_the_path(&arm, &path[..=k], 2.0);
            assert!(off_m.norm() < 1e-15, "{off_m}");
            motion.go(&path[k]).unwrap();
            assert_eq!(motion.stands_rad().as_ref(), Some(&path[k]));
            // Standing there says nothing new.
            assert_eq!(motion.tip(&path[k], &Driven::default()).unwrap().rotation, there.rotation);
        }
    }
}

/// A direction that is told is that of a long way in it, for the belt that two neighbours share too.
#[test]
fn a_direction_is_a_long_way_in_it() {
    let arm = arm(RIG);
    let mut motion = arm.motion(&Conditions::default()).unwrap();
    let q = [0.1, -0.4, 0.3];
    let mut seen: Vec<Vector3<f64>> = Vec::new();
    for signs in [[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]] {
        motion.start(None).unwrap();
        let driven = Driven { direction: Some(&signs), ..Driven::default() };
        let told = motion.tip(&q, &driven).unwrap().translation.vector;
        let far: Vec<f64> = q.iter().zip(signs).map(|(q, sign)| q - 0.25 * sign).collect();
        motion.start(Some(&far)).unwrap();
        let come = motion.tip(&q, &Driven::default()).unwrap().translation.vector;
        // Belts whose sum stands still are where they were, which nobody knows here: their play is 0.01 mm.
        assert!((told - come).norm() < 2e-5, "{signs:?}: {}", (told - come).norm());
        assert!(seen.iter().all(|other| (other - told).norm() > 1e-3), "{signs:?} is like another");
        seen.push(told);
    }
}

/// The calibrated tip goes where the nominal one was meant to be; joints and a place are two ways to say it.
#[test]
fn a_corrected_set_point_brings_the_tip_to_where_the_nominal_arm_has_it() {
    for (text, in_base) in [(RIG, false), (RIG, true), (PANDA, true), (UR10, true), (UR10, false)] {
        let arm = arm(text);
        let conditions = Conditions { in_base, ..Conditions::default() };
        let [mut by_joints, mut by_place] = [0, 1].map(|_| arm.motion(&conditions).unwrap());
        let path = readings(&arm, 8);
        let mut corrected_path = vec![path[0].clone()];
        for motion in [&mut by_joints, &mut by_place] {
            motion.start(Some(&path[0])).unwrap();
        }
        for nominal in &path[1..] {
            let wanted = by_joints.nominal_tip(nominal).unwrap();
            let before = by_joints.clone();
            let corrected = by_joints.correct(nominal, None).unwrap();
            let reached = corrected.reached.clone().unwrap();
            let there = before.tip(&corrected.joint_rad, &Driven::default()).unwrap();
            let off_m = (there.translation.vector - wanted.translation.vector).norm();
            assert!(off_m < 1e-6 && (off_m - reached.after_m).abs() < 1e-9, "{off_m} {reached:?}");
            let has_orientation = nominal.len() >= 6;
            assert!(!has_orientation || there.rotation.angle_to(&wanted.rotation) < 1e-6);
            let missed = before.tip(nominal, &Driven::default()).unwrap().translation.vector;
            assert!((missed - wanted.translation.vector).norm() > 1e-4, "nothing to correct");
            corrected_path.push(corrected.joint_rad.clone());
            // The same place, told as a place: a redundant or bent arm may take another posture there.
            let orientation = has_orientation.then_some(wanted.rotation);
            let place = Point { position_m: wanted.translation.vector, orientation, time_s: None };
            let placed = by_place.set_point(&place).unwrap();
            assert!(placed.reached.unwrap().after_m < 1e-6);
        }
        if !in_base {
            let there = told_the_path(&arm, &corrected_path, arm.file.recordings.last().unwrap().load_kg);
            let wanted = by_joints.nominal_tip(&path[7]).unwrap().translation.vector;
            assert!((there - wanted).norm() < 1e-6);
        }
    }
}

#[test]
fn conditions_matter_where_an_effect_needs_them_and_only_there() {
    let (panda, ur10) = (arm(PANDA), arm(UR10));
    let tip = |arm: &CalibratedArm, conditions: Conditions, driven: &Driven<'_>| {
        arm.motion(&conditions).unwrap().tip(&readings(arm, 3)[2], driven).unwrap().translation.vector
    };
    let loaded = Conditions { load_kg: Some(3.0), ..Conditions::default() };
    let rest = tip(&panda, Conditions::default(), &Driven::default());
    assert!((tip(&panda, loaded, &Driven::default()) - rest).norm() > 1e-4, "a spring feels a load");
    let moving = Driven { velocity_radps: Some(&[0.5; 7]), effort_nm: Some(&[9.0; 7]), ..Driven::default() };
    assert_eq!(tip(&panda, Conditions::default(), &moving), rest);
    let warm = Conditions { temperature_c: Some(60.0), ..Conditions::default() };
    let rest = tip(&ur10, Conditions::default(), &Driven::default());
    assert_eq!(tip(&ur10, warm, &Driven::default()), rest);
}

#[test]
fn what_makes_no_sense_is_refused_by_name_and_changes_nothing() {
    let arm = arm(RIG);
    let mut motion = arm.motion(&Conditions::default()).unwrap();
    motion.start(Some(&[0.0, -0.5, 0.2])).unwrap();
    let stands = motion.stands_rad();
    let nan = [0.0, f64::NAN, 0.0];
    let far = Point { position_m: Vector3::new(9.0, 0.0, 0.0), orientation: None, time_s: None };
    let turned = Point { orientation: Some(nalgebra::UnitQuaternion::identity()), ..far };
    type Try<'t> = &'t dyn Fn(&mut Motion<'_>) -> Result<(), KinematicsError>;
    let tries: [(Try<'_>, &str); 8] = [
        (&|m| m.start(Some(&[0.0; 4])), "4 were given, the arm has 3 joints"),
        (&|m| m.go(&nan), "joint2 is NaN"),
        (&|m| m.tip(&nan, &Driven::default()).map(drop), "joint2 is NaN"),
        (
            &|m| m.tip(&[0.0; 3], &Driven { direction: Some(&[1.0]), ..Driven::default() }).map(drop),
            "directions",
        ),
        (
            &|m| m.tip(&[0.0; 3], &Driven { effort_nm: Some(&[1.0]), ..Driven::default() }).map(drop),
            "efforts",
        ),
        (&|m| m.correct(&nan, None).map(drop), "joint2 is NaN"),
        (&|m| m.set_point(&far).map(drop), "mm away from it"),
        (&|m| m.set_point(&turned).map(drop), "cannot be given an orientation"),
    ];
    for (attempt, words) in tries {
        let error = attempt(&mut motion).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
        assert_eq!(motion.stands_rad(), stands);
    }
    for (conditions, words) in [
        (Conditions { tip: 1, ..Conditions::default() }, "there are 1, counted from 0"),
        (Conditions { recording: Some(1), ..Conditions::default() }, "recording"),
        (Conditions { load_kg: Some(-1.0), ..Conditions::default() }, "kg"),
        (Conditions { temperature_c: Some(f64::INFINITY), ..Conditions::default() }, "degC"),
    ] {
        assert!(arm.motion(&conditions).unwrap_err().to_string().contains(words));
    }
}

/// Every kind of damage to the file ends in words: cut anywhere, numbers away, lists shortened.
#[test]
fn a_file_that_is_none_is_refused_with_what_to_do() {
    let whole: serde_json::Value = serde_json::from_str(RIG).unwrap();
    let refused = |text: &str| CalibratedArm::from_json(text).unwrap_err().to_string();
    for cut in (0..RIG.len() - 2).step_by(RIG.len() / 61).filter(|at| RIG.is_char_boundary(*at)) {
        assert!(refused(&RIG[..cut]).contains("run the pipeline again"));
    }
    for (key, value) in [
        ("schema", serde_json::json!("armcal.model/9")),
        ("range_rad", serde_json::json!([[0.0, 1.0]])),
        ("postures_rad", serde_json::json!([[0.0]])),
        ("parameters", serde_json::json!([])),
        ("effects", serde_json::json!([{"kind": "backlash", "target": 9}])),
    ] {
        let mut broken = whole.clone();
        broken[key] = value;
        let said = refused(&broken.to_string());
        assert!(said.len() > 20, "{key}: {said}");
    }
    // Whatever key is taken out, it is words or a model.
    for key in whole.as_object().unwrap().keys() {
        let mut broken = whole.clone();
        broken.as_object_mut().unwrap().remove(key);
        let _ = CalibratedArm::from_json(&broken.to_string());
    }
}

#[test]
fn an_arm_is_for_many_threads_and_a_motion_for_one_after_the_other() {
    fn shared<T: Send + Sync>() {}
    fn handed_on<T: Send>() {}
    shared::<CalibratedArm>();
    handed_on::<Motion<'_>>();
    shared::<crate::c_abi::ArmHandle>();
    handed_on::<crate::c_abi::MotionHandle>();
}

#[test]
fn a_panic_stops_at_the_border() {
    assert_eq!(crate::c_abi::run_guarded(|| panic!("meant")), crate::c_abi::Code::Internal);
}
