//! Is a calibration whose observations are with shards the one of one process, to the last bit?

use super::rig;
use crate::elsewhere::{Answer, Elsewhere, Request, answer};
use crate::{CalibrateError, FitConfig, HoldoutConfig, Objective, Scale, calibrate, calibrate_elsewhere};
use armcal_core::{Observation, Pose, Reference};
use armcal_model::{EffectSpec, Frame, Model, RecordingStart, Session};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Shards that hold every `of`-th recording, and what was asked and answered; answers come as bytes, as through files.
struct Shards<'a> {
    model: &'a Model,
    observations: &'a [Observation],
    config: &'a FitConfig,
    of: usize,
    answered: BTreeMap<Vec<u8>, Vec<Vec<u8>>>,
    open: Mutex<BTreeMap<Vec<u8>, Request>>,
    settled: Mutex<BTreeMap<Vec<u8>, Vec<f64>>>,
}

impl Elsewhere for Shards<'_> {
    fn ask(&self, request: &Request) -> Result<Vec<Answer>, CalibrateError> {
        let key = rmp_serde::to_vec_named(request).unwrap();
        let Some(answers) = self.answered.get(&key) else {
            self.open.lock().unwrap().insert(key, request.clone());
            return Err(CalibrateError::Unanswered);
        };
        let told = answers.iter().map(|bytes| rmp_serde::from_slice(bytes));
        told.collect::<Result<_, _>>().map_err(|e| CalibrateError::Elsewhere(e.to_string()))
    }

    fn found(&self, key: &[u8]) -> Option<Vec<f64>> {
        self.settled.lock().unwrap().get(key).cloned()
    }

    fn keep(&self, key: Vec<u8>, found: &[f64]) {
        self.settled.lock().unwrap().insert(key, found.to_vec());
    }
}

impl Shards<'_> {
    /// Answers everything that is open, the last shard first; `false` where nothing is.
    fn answer(&mut self) -> bool {
        let open = std::mem::take(&mut *self.open.lock().unwrap());
        let is_open = !open.is_empty();
        for (key, request) in open {
            let mut all = BTreeMap::new();
            for shard in (0..self.of).rev() {
                let mut first = 0;
                for own in self.observations.chunk_by(|a, b| a.dwell.recording == b.dwell.recording) {
                    let recording = own[0].dwell.recording;
                    if recording % self.of == shard {
                        let told = answer(self.model, first, own, self.config, &request);
                        all.extend(told.map(|told| (recording, rmp_serde::to_vec_named(&told).unwrap())));
                    }
                    first += own.len();
                }
            }
            self.answered.insert(key, all.into_values().collect());
        }
        is_open
    }
}

/// Who it is, where the arm stood, what was measured.
fn light(o: &Observation) -> Observation {
    let (joint_sigma_rad, covariance_m2) = (Vec::new(), Matrix3::zeros());
    Observation { joint_sigma_rad, covariance_m2, path_memory_rad: None, pair_memory_rad: None, ..o.clone() }
}

/// Compares with one process; returns how many rounds it took.
fn compare(
    model: &Model,
    observations: &[Observation],
    config: &FitConfig,
    holdout: &HoldoutConfig,
    of: usize,
) -> usize {
    let config = &FitConfig { every_step: true, ..config.clone() };
    let whole = calibrate(model, observations, config, holdout).unwrap();
    let seen: Vec<Observation> = observations.iter().map(light).collect();
    let (open, settled) = Default::default();
    let mut shards = Shards { model, observations, config, of, answered: BTreeMap::new(), open, settled };
    for round in 1.. {
        match calibrate_elsewhere(model, &seen, config, holdout, &shards) {
            Err(CalibrateError::Unanswered) => assert!(shards.answer(), "nothing is asked"),
            Err(e) => panic!("round {round}: {e}"),
            Ok(found) => {
                assert_eq!(found.fit.estimates, whole.fit.estimates);
                assert_eq!(found, whole);
                println!("{of} shards: {round} rounds, {} questions", shards.answered.len());
                return round;
            }
        }
    }
    unreachable!()
}

/// An arm at a board of its own on every day.
fn days(sizes: &[usize], seed: u64, own: &[&str]) -> (Model, Vec<f64>, Vec<Observation>) {
    let mut rng = rig::rng(seed);
    let start = Pose::translation(0.4, 0.0, 0.1);
    let boards = (0..sizes.len()).map(|k| Frame::estimated(format!("board.day{k}"), start)).collect();
    let model = rig::model(Frame::given("base", Pose::identity()), boards);
    let truth = rig::planted(&model, &mut rng, 0.6);
    let mut observations = Vec::new();
    for (recording, &n) in sizes.iter().enumerate() {
        let turn = Vector3::new(0.02 * recording as f64, -0.05, 0.1);
        let mut day = rig::seated(&model, &truth, &[start * Pose::new(Vector3::zeros(), turn)], n, &mut rng);
        day.iter_mut().for_each(|o| (o.dwell.recording, o.joint_sigma_rad) = (recording, vec![2e-5; 3]));
        observations.extend(day);
    }
    let recording = |k: usize| RecordingStart { name: format!("day{k}"), base_in_world: None };
    let own: Vec<String> = own.iter().map(|name| (*name).to_owned()).collect();
    let pool = model.with_own(&(0..sizes.len()).map(recording).collect::<Vec<_>>(), &own).unwrap();
    (pool, truth, observations)
}

#[test]
fn shards_of_any_number_give_the_bits_of_one_process() {
    let (model, _, observations) = days(&[22, 9, 40, 12, 25], 1, &["joint2.theta"]);
    let config = FitConfig::default();
    let holdout = HoldoutConfig::RecordingFolds { k: 3 };
    let rounds: Vec<usize> =
        [1, 2, 5, 7].map(|of| compare(&model, &observations, &config, &holdout, of)).into();
    assert!(rounds.iter().all(|n| *n == rounds[0]), "{rounds:?}");
    compare(&model, &observations, &config, &HoldoutConfig::CavityFolds { k: 3 }, 2);
    compare(&model, &observations, &config, &HoldoutConfig::None, 2);
}

#[test]
fn outliers_active_bounds_and_recordings_too_short_too() {
    let (mut model, truth, mut observations) = days(&[25, 1, 40, 2, 30], 4, &[]);
    for o in observations.iter_mut().step_by(9) {
        if let Reference::Seated { in_board_m, .. } = &mut o.reference {
            in_board_m.x += 0.02;
        }
    }
    let a2 = model.index("joint2.a").unwrap();
    let half = 0.5 * (truth[a2] - model.parameters()[a2].nominal).abs();
    model.set_parameter("joint2.a", |p| (p.lower, p.upper) = (p.nominal - half, p.nominal + half)).unwrap();
    let once = HoldoutConfig::Recordings { recordings: vec![crate::RecordingKey::Index(2)] };
    for config in [
        FitConfig::default(),
        FitConfig { objective: Objective::LeastSquares, learn_priors: false, ..FitConfig::default() },
        FitConfig { scale: Scale::Declared, ..FitConfig::default() },
    ] {
        compare(&model, &observations, &config, &once, 3);
    }
    let fit = calibrate(&model, &observations, &FitConfig::default(), &once).unwrap().fit;
    assert!(fit.estimates[a2].at_bound && fit.weights.iter().any(|w| *w < 0.25));
}

#[test]
fn one_recording_and_a_tracked_arm_with_its_own_bases_too() {
    let (model, _, observations) = days(&[50], 5, &[]);
    compare(&model, &observations, &FitConfig::default(), &HoldoutConfig::CavityFolds { k: 4 }, 2);
    let mut rng = rig::rng(7);
    let model = rig::model(Frame::estimated("base", Pose::identity()), Vec::new());
    let truth = rig::planted(&model, &mut rng, 0.4);
    let mut observations = Vec::new();
    for day in 0..3 {
        let mut seen = rig::tracked(&model, &truth, 30, &mut rng);
        seen.iter_mut().for_each(|o| o.dwell.recording = day);
        observations.extend(seen);
    }
    let recordings = [0, 1, 2].map(|day| RecordingStart { name: format!("day{day}"), base_in_world: None });
    for own in [vec![], vec!["base.*".to_owned()]] {
        let pool = model.with_own(&recordings, &own).unwrap();
        compare(&pool, &observations, &FitConfig::default(), &HoldoutConfig::EachRecording, 2);
    }
}

#[test]
fn effects_that_remember_where_the_joints_came_from_too() {
    let (model, _, mut observations) = days(&[30, 30], 11, &[]);
    let flip = |k: usize| {
        if k.is_multiple_of(3) { armcal_core::Arrival::Negative } else { armcal_core::Arrival::Positive }
    };
    observations.iter_mut().enumerate().for_each(|(k, o)| o.arrival = vec![flip(k); 3]);
    let effects: Vec<EffectSpec> = vec![EffectSpec::new("backlash").at(1)];
    let pool = model.with_effects(&effects, &Session::of(&observations)).unwrap();
    compare(&pool, &observations, &FitConfig::default(), &HoldoutConfig::RecordingFolds { k: 2 }, 2);
}

#[test]
fn damaged_answers_end_in_an_error_or_in_numbers() {
    let (model, _, observations) = days(&[22, 9, 12], 3, &["joint2.theta"]);
    let (config, holdout) = (FitConfig::default(), HoldoutConfig::None);
    let seen: Vec<Observation> = observations.iter().map(light).collect();
    let (open, settled) = Default::default();
    let (answered, of) = (BTreeMap::new(), 2);
    let mut shards =
        Shards { model: &model, observations: &observations, config: &config, of, answered, open, settled };
    let fit = |shards: &Shards<'_>| calibrate_elsewhere(&model, &seen, &config, &holdout, shards);
    while let Err(CalibrateError::Unanswered) = fit(&shards) {
        assert!(shards.answer(), "nothing is asked");
    }
    let keys: Vec<Vec<u8>> = shards.answered.keys().cloned().collect();
    let (mut refused, mut other) = (0, 0);
    for k in 0..400 {
        let key = &keys[k % keys.len()];
        let sound = shards.answered[key].clone();
        let mut damaged = sound.clone();
        let bytes = &mut damaged[k % sound.len()];
        // Most of what is not a number stands in front.
        let at = if k % 2 == 0 { k % bytes.len().min(160) } else { (k * 7919) % bytes.len() };
        bytes[at] ^= 1 << (k % 8);
        shards.answered.insert(key.clone(), damaged);
        shards.settled.lock().unwrap().clear();
        match fit(&shards) {
            Err(CalibrateError::Elsewhere(_) | CalibrateError::Unreachable(_)) => refused += 1,
            _ => other += 1,
        }
        shards.open.lock().unwrap().clear();
        shards.answered.insert(key.clone(), sound);
    }
    assert!(refused > 20 && other > 20, "{refused} refused, {other} read");
    assert!(fit(&shards).is_ok(), "what is sound again");
}

#[test]
fn what_a_shard_cannot_evaluate_is_told_with_its_observation() {
    let (model, _, mut observations) = days(&[20, 20], 3, &[]);
    observations[25].covariance_m2 = Matrix3::zeros();
    observations[25].joint_sigma_rad = vec![0.0; 3];
    let config = FitConfig::default();
    let here = calibrate(&model, &observations, &config, &HoldoutConfig::None).unwrap_err().to_string();
    let (open, settled, of) = (Mutex::default(), Mutex::default(), 2);
    let (answered, model, all) = (BTreeMap::new(), &model, &observations);
    let mut shards = Shards { model, observations: all, config: &config, of, answered, open, settled };
    let there = loop {
        match calibrate_elsewhere(model, all, &config, &HoldoutConfig::None, &shards) {
            Err(CalibrateError::Unanswered) => assert!(shards.answer()),
            other => break other.unwrap_err().to_string(),
        }
    };
    assert_eq!(here, there);
    let paper = FitConfig { objective: Objective::Paper, ..config.clone() };
    let refused = calibrate_elsewhere(model, all, &paper, &HoldoutConfig::None, &shards).unwrap_err();
    assert!(refused.to_string().contains("fit.objective"), "{refused}");
}
