//! Parameters of single recordings: is each predicted by its own, and by nothing of the others?

use super::*;
use crate::{EffectSpec, Frame, Knowledge, RecordingStart, Session};

const MEASURED: Knowledge = Knowledge::Measured { sigma_m: 1e-3, sigma_rad: 2e-3 };

fn pose(x: f64, yaw: f64) -> Pose {
    Pose::new(Vector3::new(x, 0.2, 0.1), Vector3::new(0.1, 0.0, yaw))
}

/// Three days of an arm with play in its second joint, and where its base was measured on each of them.
fn days() -> (Model, Vec<Pose>) {
    let frames = Frames {
        base: Frame { knowledge: MEASURED, ..Frame::given("base", pose(1.0, 0.5)) },
        tip: Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) },
        markers: Vec::new(),
        boards: ["a", "b", "c"].map(|day| Frame::estimated(format!("board.{day}"), pose(0.4, 0.0))).to_vec(),
    };
    let model = Model::new(dh(RIGHT_ARM), frames).expect("valid");
    let effects = [EffectSpec::new("backlash").at(1)];
    let model = model.with_effects(&effects, &Session::of(&[])).expect("play");
    (model, [0.5, 1.4, -2.0].map(|yaw| pose(1.0 + yaw, yaw)).to_vec())
}

fn starts(bases: &[Pose]) -> Vec<RecordingStart> {
    let start = |(day, base): (&str, &Pose)| RecordingStart { name: day.into(), base_in_world: Some(*base) };
    ["a", "b", "c"].into_iter().zip(bases).map(start).collect()
}

fn with_own(own: &[&str]) -> Model {
    let (model, bases) = days();
    let own: Vec<String> = own.iter().map(|name| (*name).to_owned()).collect();
    model.with_own(&starts(&bases), &own).expect("days")
}

fn on_day(recording: usize) -> Observation {
    let mut o = seated(&[0.2, -0.4, 0.3], Vector3::new(0.08, -0.03, 0.01));
    o.dwell.recording = recording;
    o
}

#[test]
fn each_recording_moves_with_its_own_parameters_alone() {
    let model = with_own(&["base.*", "joint2.theta", "backlash:2.width"]);
    let p: Vec<f64> =
        (0..model.parameters().len()).map(|k| model.nominal()[k] + 1e-3 * (k % 7) as f64).collect();
    for recording in 0..3 {
        let o = on_day(recording);
        let (residual, exact) = model.residual_with_jacobian(&p, &o);
        assert_eq!(residual.position_m, model.residual(&p, &o).position_m);
        let moves: Vec<usize> = (0..p.len()).filter(|k| exact.column(*k).norm() > 0.0).collect();
        let known = model.known_in(recording).expect("a day");
        assert!(moves.iter().all(|k| known.contains(k)), "{moves:?}");
        assert!(model.own_parameters(recording).iter().filter(|k| model.copies().contains(k)).count() == 8);
        for k in 0..p.len() {
            let at = |step: f64| {
                let mut p = p.clone();
                p[k] += step;
                model.residual(&p, &o).position_m
            };
            let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
            let off = (slope - exact.fixed_view::<3, 1>(0, k)).norm();
            assert!(off < 1e-7, "{} in recording {recording}: {off:e}", model.parameters()[k].name);
        }
    }
}

/// A camera that was set up anew sees the arm as a model of that day alone does, effects included.
#[test]
fn a_base_of_its_own_turns_from_where_it_was_measured() {
    let model = with_own(&["base.*"]);
    let (alone, bases) = days();
    let mut p = model.nominal();
    for (recording, base) in bases.iter().enumerate() {
        let mut frames = Frames::of_bare_arm();
        frames.base = Frame { knowledge: MEASURED, ..Frame::given("base", *base) };
        frames.tip = Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) };
        let of_day = Model::new(dh(RIGHT_ARM), frames).expect("valid");
        let specs: Vec<EffectSpec> = alone.effects().iter().map(|e| e.spec.clone()).collect();
        let of_day = of_day.with_effects(&specs, &Session::of(&[])).expect("play");
        let mut q = of_day.nominal();
        for (name, turned_rad) in [("base.rz", 0.02), ("joint3.theta", 0.01), ("backlash:2.width", 0.004)] {
            let at = model.index(name).expect("a parameter");
            let own = model.in_place_of(at, recording);
            assert_eq!(own != at, name.starts_with("base."));
            p[own] = model.nominal()[own] + turned_rad;
            q[of_day.index(name).expect("a parameter")] += turned_rad;
        }
        let tip = model.predicted_tip_in_world(&p, &on_day(recording));
        assert!((tip - of_day.predicted_tip_in_world(&q, &on_day(recording))).norm() < 1e-12);
    }
}

#[test]
fn what_is_shared_is_predicted_as_without_own_parameters() {
    let (alone, _) = days();
    let pool = with_own(&[]);
    let p: Vec<f64> = alone.nominal().iter().enumerate().map(|(k, v)| v + 1e-3 * (k % 5) as f64).collect();
    for o in (0..3).map(on_day) {
        let ((a, by_a), (b, by_b)) =
            (alone.residual_with_jacobian(&p, &o), pool.residual_with_jacobian(&p, &o));
        assert_eq!((a.position_m, by_a), (b.position_m, by_b));
    }
}

#[test]
fn effects_come_behind_what_is_asked_for_and_may_be_asked_for() {
    let (alone, bases) = days();
    let mut asked = Model::new(dh(RIGHT_ARM), Frames::of_bare_arm()).expect("valid");
    asked.ask_own(starts(&bases), vec!["backlash:2.width".into()]);
    let session = Session::of(&[]);
    let specs: Vec<EffectSpec> = alone.effects().iter().map(|e| e.spec.clone()).collect();
    assert!(asked.with_effects(&[], &session).is_err(), "no play, so no width of it");
    let model = asked.with_effects(&specs, &session).expect("play");
    assert_eq!(model.copies().len(), 3);
    let more = model.with_effects(&[EffectSpec::new("backlash").at(2)], &session).expect("more play");
    assert_eq!(more.copies(), model.copies());
    assert_eq!(more.parameters()[..model.parameters().len()], *model.parameters());
}
