//! An effect of somebody else's program, in one file: the hose of a welder pulls a wrist aside the more, the further its base
//! joint has turned past a guide. No catalogue lists it; it is registered, planted by its own formula, named and fitted.

#![allow(clippy::expect_used, reason = "a test may stop")]

use armcal_calibrate::{Calibration, FitConfig, HoldoutConfig, calibrate};
use armcal_core::{DwellId, Observation, Pose, Reference};
use armcal_diagnose::{Calibrated, DiagnosisConfig, diagnose};
use armcal_model::effect_prelude::*;
use armcal_model::{Chain, EffectSpec, Frame, Frames, Model, Session, catalogue, find, register};
use nalgebra::Matrix3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::path::Path;

const ARM: &str = include_str!("../../../pipelines/models/right_arm.toml");
const SIGMA_M: f64 = 0.2e-3;
/// Where the guide is [rad], and how far the hose pulls a radian further on [rad].
const GUIDE_RAD: f64 = 0.3;
const PULL: f64 = 0.012;

/// `dq = pull max(0, q1 - guide)`.
static HOSE_PULL: EffectKind = EffectKind {
    name: "hose_pull",
    source: include_str!("custom_effect.rs"),
    summary: "a hose pulls a joint aside once the base has turned past its guide",
    family: Family::Elasticity,
    target: Target::Joint,
    place: |context| {
        let joint = context.joint()?;
        let pull =
            amplitude("pull", Unit::One, 0.01, 0.2, "turn of the joint for each radian past the guide");
        Ok(Placement::new(vec![pull], HosePull { joint }))
    },
    look_at: "Look at the hose: is it long enough past its guide?",
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct HosePull {
    joint: usize,
}

impl Physics for HosePull {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, theta[0] * (x.joint_rad(0) - GUIDE_RAD).max(0.0));
    }
}

fn model() -> Model {
    let chain = Chain::from_dh_toml(ARM, Path::new("arm.toml")).expect("the shipped arm");
    let tip = Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) };
    let base = Frame::given("base", Pose::identity());
    Model::new(chain, Frames { base, tip, markers: Vec::new(), boards: Vec::new() }).expect("a model")
}

/// Tracked poses of a nominal arm whose joint 2 turns with the hose: the formula is written here a second time.
fn pulled(model: &Model) -> Vec<Observation> {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let p = model.nominal();
    let pose = |dwell: usize| {
        let read = [(-1.2, 1.2), (-1.3, 0.3), (-1.0, 0.9)].map(|(a, b)| rng.random_range(a..b));
        let noise = Vector3::from_fn(|_, _| SIGMA_M * rng.sample::<f64, _>(StandardNormal));
        let at = |joint_rad: [f64; 3]| {
            let dwell = DwellId { recording: 0, dwell };
            Observation::bare(dwell, joint_rad.to_vec(), Reference::position(Vector3::zeros()))
        };
        let past_rad = if read[0] > GUIDE_RAD { read[0] - GUIDE_RAD } else { 0.0 };
        let position_m = model.predicted_tip_in_world(&p, &at([read[0], read[1] + PULL * past_rad, read[2]]));
        Observation {
            time_ns: dwell as i64 * 10_000_000_000,
            covariance_m2: Matrix3::identity() * SIGMA_M.powi(2),
            reference: Reference::position(position_m + noise),
            ..at(read)
        }
    };
    (0..120).map(pose).collect()
}

fn calibrated(model: &Model, observations: &[Observation]) -> Calibration {
    let holdout = HoldoutConfig::CavityFolds { k: 5 };
    calibrate(model, observations, &FitConfig::default(), &holdout).expect("a calibration")
}

#[test]
fn an_effect_registered_by_another_program_is_named_and_fitted() {
    static NAMELESS: EffectKind =
        EffectKind { name: "hose pull", family: Family::Elasticity, ..EffectKind::PLAIN };
    assert!(register(&[&NAMELESS]).is_err(), "a spec cannot have that name");
    static TWICE: EffectKind =
        EffectKind { name: "backlash", family: Family::LostMotion, ..EffectKind::PLAIN };
    assert!(register(&[&TWICE]).is_err(), "there is one already");
    register(&[&HOSE_PULL]).expect("nothing has read the catalogue yet");
    assert!(register(&[&HOSE_PULL]).is_err(), "one process, one catalogue");
    assert!(find("hose_pull").is_some_and(|kind| kind.docs().starts_with("An effect of somebody else's")));
    assert_eq!(catalogue().last().map(|kind| kind.name), Some("hose_pull"));

    let model = model();
    let observations = pulled(&model);
    let session = Session::of(&observations);
    let before = calibrated(&model, &observations);
    let (fit, holdout) = (FitConfig::default(), HoldoutConfig::CavityFolds { k: 5 });
    let config = DiagnosisConfig { resamplings: 199, ..DiagnosisConfig::default() };
    let c = Calibrated {
        model: &model,
        calibration: &before,
        observations: &observations,
        session: &session,
        fit: &fit,
        holdout: &holdout,
    };
    let found = diagnose(&c, &config).expect("a diagnosis");
    let sets: Vec<&Vec<String>> = found.effects.iter().map(|effect| &effect.set).collect();
    assert!(
        sets.len() == 1 && sets[0].iter().any(|name| name == "hose_pull:2"),
        "{:?} {sets:?}",
        found.verdict
    );

    let spec: EffectSpec = model.effect("hose_pull:2").expect("a spec of the arm");
    let with_it = model.with_effects(&[spec], &session).expect("a place for it");
    let after = calibrated(&with_it, &observations);
    let pull = after.fit.estimates.iter().find(|e| e.parameter.name == "hose_pull:2.pull").expect("its size");
    assert!(
        (pull.value - PULL).abs() < 4.0 * pull.sigma && pull.sigma < 0.1 * PULL,
        "{} {}",
        pull.value,
        pull.sigma
    );
    let [without_m, with_m] = [&before, &after].map(|c| c.judged().fitted.mean_m);
    assert!(with_m < 0.8 * without_m, "{without_m} {with_m}");
}
