//! Is the nominal arm carried from one calibration to another the one that would have been found?

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::of_turns;
use crate::tests::rig;
use crate::{FitConfig, HoldoutConfig, calibrate, calibrate_beside};
use armcal_model::{Model, Session};

/// The tracked rig, and the same with play and an eccentric encoder, of which one is there at nominal where asked.
fn models(at_nominal: &str) -> (Model, Model, Vec<armcal_core::Observation>) {
    let model = rig::tracked_model();
    let mut rng = rig::rng(31);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let observations = rig::tracked(&model, &truth, 80, &mut rng);
    let session = Session::of(&observations);
    let specs = ["backlash:1", "eccentricity:2"].map(|spec| {
        let mut spec = model.effect(spec).unwrap();
        if spec.kind == "backlash" && !at_nominal.is_empty() {
            spec.overrides.insert("width".to_owned(), toml::from_str(at_nominal).unwrap());
        }
        spec
    });
    let with = model.with_effects(&specs, &session).unwrap();
    (model, with, observations)
}

#[test]
fn the_nominal_arm_is_the_same_beside_effects_that_do_nothing_there() {
    let (model, with, observations) = models("");
    for holdout in ["kind = \"cavity-folds\"\nk = 5", "kind = \"random\"\nshare = 0.25\nseed = 3"] {
        let (fit, holdout) = (FitConfig::default(), toml::from_str::<HoldoutConfig>(holdout).unwrap());
        let plain = calibrate(&model, &observations, &fit, &holdout).unwrap();
        let alone = calibrate(&with, &observations, &fit, &holdout).unwrap();
        let beside = calibrate_beside(Some(&plain), &with, &observations, &fit, &holdout).unwrap();
        assert!(!plain.turn_nominal_values.is_empty());
        assert_eq!(beside.turn_nominal_values.len(), alone.turn_nominal_values.len());
        for (k, sigma) in alone.fit.estimates.iter().map(|e| e.sigma).enumerate() {
            let off = (beside.fit.estimates[k].value - alone.fit.estimates[k].value).abs();
            assert!(off <= 1e-4 * sigma, "parameter {k}: {off} of {sigma}");
        }
        let off_m = |(a, b): (&crate::Residual, &crate::Residual)| (a.nominal_m - b.nominal_m).norm();
        let most_m = beside.residuals.iter().zip(&alone.residuals).map(off_m).fold(0.0, f64::max);
        assert!(most_m < 1e-8, "{most_m}");
    }
}

#[test]
fn what_an_effect_does_at_nominal_is_no_nominal_arm_of_the_model_without_it() {
    let fit = FitConfig::default();
    let holdout: HoldoutConfig = toml::from_str("kind = \"cavity-folds\"\nk = 5").unwrap();
    let (model, with, observations) = models("");
    let plain = calibrate(&model, &observations, &fit, &holdout).unwrap();
    assert!(of_turns(&plain, &with).is_some());
    let (_, preloaded, _) = models("start = 0.2");
    assert!(of_turns(&plain, &preloaded).is_none(), "play that is there from the start");
    let beside = calibrate(&with, &observations, &fit, &holdout).unwrap();
    assert!(of_turns(&beside, &model).is_none(), "a model with fewer effects");
}
