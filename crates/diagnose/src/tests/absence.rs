//! Names that a search found, each by its absence from the refitted model, on an arm whose joints have play.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::{clearly_needed, needed};
use crate::diagnosis::{Diagnosis, Verdict};
use crate::observed::Calibrated;
use crate::tests::{planar_arm, planted, quick};
use crate::{LinearRefit, diagnose_problem};
use armcal_calibrate::{FitConfig, HoldoutConfig, calibrate};
use armcal_core::{Arrival, DwellId, Observation, Reference};
use armcal_model::{EffectSpec, Session};
use nalgebra::{Matrix3, Vector3};

const SIGMA_M: f64 = 1e-4;
const JOINTS: [&str; 3] = ["joint1", "joint2", "wrist"];

fn spec(name: &str) -> EffectSpec {
    EffectSpec::parse(name, &JOINTS.map(str::to_owned)).unwrap()
}

/// Sixty poses of an arm with these effects at their typical size, seen with noise; joints come from either side.
fn observed(hidden: &[&str]) -> Vec<Observation> {
    observed_at(&hidden.iter().map(|name| (*name, 1.0)).collect::<Vec<_>>())
}

/// The same, each effect at so many of its typical size.
fn observed_at(hidden: &[(&str, f64)]) -> Vec<Observation> {
    let side = |positive: bool| if positive { Arrival::Positive } else { Arrival::Negative };
    let wave = |k: usize, rate: f64| (k as f64 * rate).sin();
    let pose = |dwell: usize| {
        let joint_rad = vec![1.2 * wave(dwell, 1.7), 0.4 + 0.9 * wave(dwell, 2.9), 0.7 * wave(dwell, 0.9)];
        let id = DwellId { recording: 0, dwell };
        Observation {
            time_ns: dwell as i64,
            covariance_m2: Matrix3::identity() * SIGMA_M.powi(2),
            arrival: vec![side(dwell.is_multiple_of(2)), side(dwell.is_multiple_of(3)), side(dwell % 5 < 2)],
            ..Observation::bare(id, joint_rad, Reference::position(Vector3::zeros()))
        }
    };
    let mut all: Vec<Observation> = (0..60).map(pose).collect();
    let specs: Vec<EffectSpec> = hidden.iter().map(|(name, _)| spec(name)).collect();
    let truth = planar_arm().with_effects(&specs, &Session::of(&all)).unwrap();
    let typical = |p: &armcal_core::Parameter| p.nominal + p.prior_sigma.unwrap_or(0.0);
    let mut values = truth.nominal();
    for (effect, (_, size)) in truth.effects().iter().zip(hidden) {
        effect.parameters.clone().for_each(|k| values[k] = size * typical(&truth.parameters()[k]));
    }
    for (k, o) in all.iter_mut().enumerate() {
        let noise = Vector3::new(wave(k, 12.9898), wave(k, 78.233), wave(k, 37.719)) * SIGMA_M;
        o.reference = Reference::position(truth.predicted_tip_in_world(&values, o) + noise);
    }
    all
}

/// Something of the nominal arm calibrated on `observations`.
fn calibrated<T>(observations: &[Observation], of: impl FnOnce(&Calibrated<'_>) -> T) -> T {
    let (model, session, fit) = (planar_arm(), Session::of(observations), FitConfig::default());
    let holdout = HoldoutConfig::CavityFolds { k: 5 };
    let calibration = calibrate(&model, observations, &fit, &holdout).unwrap();
    of(&Calibrated {
        model: &model,
        calibration: &calibration,
        observations,
        session: &session,
        fit: &fit,
        holdout: &holdout,
    })
}

/// What is left of names that a search found in `observed`, with the evidence of each.
fn kept(observations: &[Observation], found: &[(&str, f64)]) -> Diagnosis {
    let linear = LinearRefit::new(planted(&[("backlash:1", 1.0)], 0, 3));
    let mut diagnosis = diagnose_problem(&mut { linear }, &quick()).unwrap();
    let one = diagnosis.effects.swap_remove(0);
    diagnosis.effects = found
        .iter()
        .map(|(name, log_evidence)| crate::FoundEffect {
            name: (*name).to_owned(),
            set: vec![(*name).to_owned()],
            log_evidence: *log_evidence,
            ..one.clone()
        })
        .collect();
    let left = calibrated(observations, |calibrated| {
        let refitted = calibrated.with(found.iter().map(|(name, _)| spec(name)).collect()).unwrap();
        diagnosis.each_by_its_absence(calibrated, refitted, &quick())
    });
    let names: Vec<String> = left.effects.iter().map(ToString::to_string).collect();
    assert_eq!(names, diagnosis.effects.iter().map(|e| e.name.clone()).collect::<Vec<_>>());
    diagnosis
}

#[test]
fn a_second_name_without_effect_is_taken_back_and_reported() {
    let observations = observed(&["backlash:1"]);
    // Whatever its evidence in the linearised model, and wherever it stands.
    for found in [[("backlash:1", 90.0), ("backlash:2", 8.0)], [("backlash:2", 90.0), ("backlash:1", 8.0)]] {
        let d = kept(&observations, &found);
        assert_eq!((d.verdict, d.names.as_slice()), (Verdict::Identified, &["backlash:1".to_owned()][..]));
        let said: Vec<_> = d.warnings.iter().filter(|w| w.code == "name-not-needed").collect();
        assert!(
            matches!(said[..], [w] if w.subject == "backlash:2" && w.message.contains("p = ")),
            "{said:?}"
        );
    }
}

#[test]
fn names_that_are_all_needed_stay() {
    let d = kept(&observed(&["backlash:1", "backlash:2"]), &[("backlash:1", 90.0), ("backlash:2", 8.0)]);
    assert_eq!(d.effects.len(), 2, "{:?}", d.warnings);
    assert!(d.warnings.iter().all(|w| w.code != "name-not-needed"));
}

/// What one fit to all points says at once, the turns of the hold-out say too.
#[test]
fn a_name_that_is_clearly_needed_is_needed_in_every_turn() {
    let clear = [0.0, 0.02, 0.05, 0.1, 0.2, 1.0].map(|size| {
        calibrated(&observed_at(&[("backlash:1", 1.0), ("backlash:2", size)]), |calibrated| {
            let both = calibrated.with(vec![spec("backlash:1"), spec("backlash:2")]).unwrap();
            let one = calibrated.with(vec![spec("backlash:1")]).unwrap();
            let clear = clearly_needed(&one.effects, calibrated, &both, &quick());
            let by_turns = needed(&one.calibration, &both.calibration, calibrated, &quick());
            assert!(by_turns || !clear, "{size} of its typical size");
            clear
        })
    });
    assert!(!clear[0] && clear[5], "{clear:?}");
}
