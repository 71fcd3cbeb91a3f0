use super::rig;
use crate::{CalibrateError, Calibration, FitConfig, HoldoutConfig, calibrate, fit};
use armcal_core::{Observation, Pose, Reference};
use armcal_model::Model;
use nalgebra::Vector3;

fn run(model: &Model, observations: &[Observation], holdout: &str) -> Result<Calibration, CalibrateError> {
    let holdout: HoldoutConfig = toml::from_str(holdout).unwrap();
    calibrate(model, observations, &FitConfig::default(), &holdout)
}

fn tracked() -> (Model, Vec<Observation>) {
    let model = rig::tracked_model();
    let mut rng = rig::rng(31);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let observations = rig::tracked(&model, &truth, 80, &mut rng);
    (model, observations)
}

fn boards() -> (Model, Vec<Observation>) {
    let model = rig::board_model();
    let mut rng = rig::rng(32);
    let truth = rig::planted(&model, &mut rng, 0.8);
    let boards = [(0.45, 0.0), (0.5, 0.1), (0.4, -0.1)]
        .map(|(x, tilt)| Pose::new(Vector3::new(x, 0.0, 0.1), Vector3::new(tilt, 0.05, 0.0)));
    let observations = rig::seated(&model, &truth, &boards, 33, &mut rng);
    (model, observations)
}

#[test]
fn what_is_held_out_does_not_touch_the_fit() {
    let (model, observations) = tracked();
    let holdout = "kind = \"random\"\nshare = 0.25\nseed = 3";
    let before = run(&model, &observations, holdout).unwrap();
    let mut changed = observations.clone();
    for (o, r) in changed.iter_mut().zip(&before.residuals).filter(|(_, r)| r.held_out) {
        if let Reference::Tracked { position_m, .. } = &mut o.reference {
            position_m.z += 0.1;
        }
        assert_eq!(o.dwell, r.dwell);
    }
    let after = run(&model, &changed, holdout).unwrap();
    assert_eq!(before.fit, after.fit);
    assert_eq!(before.train, after.train);
    assert_eq!(before.holdout.fitted.n, 20);
    assert!(after.holdout.fitted.mean_m > 0.09 && before.holdout.fitted.mean_m < 1e-3);
    // Held out is honest: the same numbers as a fit that was never given them.
    let seen: Vec<Observation> = observations
        .iter()
        .zip(&before.residuals)
        .filter(|(_, r)| !r.held_out)
        .map(|(o, _)| o.clone())
        .collect();
    let alone = fit(&model, &seen, &FitConfig::default()).unwrap();
    assert_eq!(alone.values(), before.fit.values());
}

#[test]
fn held_out_error_is_near_the_noise_floor_and_far_below_nominal() {
    let (model, observations) = tracked();
    let c = run(&model, &observations, "kind = \"cavity-folds\"\nk = 8").unwrap();
    println!(
        "holdout {:.3} mm (nominal {:.2}), floor {:.3} mm, train {:.3} mm",
        1e3 * c.holdout.fitted.mean_m,
        1e3 * c.holdout.nominal.mean_m,
        1e3 * c.noise_floor_m,
        1e3 * c.train.fitted.mean_m
    );
    // Isotropic noise: sqrt(8/pi) sigma.
    assert!((c.noise_floor_m / ((8.0 / std::f64::consts::PI).sqrt() * rig::SIGMA_M) - 1.0).abs() < 1e-3);
    assert!(c.holdout.fitted.mean_m < 1.15 * c.noise_floor_m);
    assert!(c.holdout.nominal.mean_m > 10.0 * c.holdout.fitted.mean_m);
    assert_eq!((c.holdout.fitted.n, c.train.fitted.n), (80, 80));
    // The parameters written are those of all observations.
    let all = run(&model, &observations, "kind = \"none\"").unwrap();
    assert_eq!(c.fit.values(), all.fit.values());
    assert_eq!(all.holdout.fitted.n, 0);
}

#[test]
fn a_recording_held_out_gets_its_own_board_and_nothing_else() {
    let (model, observations) = boards();
    let c = run(&model, &observations, "kind = \"recordings\"\nrecordings = [\"roll\"]").unwrap();
    assert_eq!(c.holdout.fitted.n, 33);
    assert!(c.holdout.fitted.mean_m < 1.2 * c.noise_floor_m, "{}", c.holdout.fitted.mean_m);
    let warning = c.warnings.iter().find(|w| w.code == "frame-fitted-on-holdout").unwrap();
    assert_eq!(warning.subject, "board.roll");
    let roll = c.fit.estimates.iter().find(|e| e.parameter.name == "board.roll.x").unwrap();
    assert!((roll.value - 0.5).abs() < 0.05 && roll.sigma > 0.0);
    // Robot parameters are those of the other two recordings.
    let others: Vec<Observation> = observations.iter().filter(|o| o.dwell.recording != 1).cloned().collect();
    let alone = fit(&model, &others, &FitConfig::default()).unwrap();
    for (a, b) in
        c.fit.estimates.iter().zip(&alone.estimates).filter(|(a, _)| !a.parameter.name.contains("roll"))
    {
        assert!((a.value - b.value).abs() < 1e-7, "{}: {} {}", a.parameter.name, a.value, b.value);
    }
    let turns = run(&model, &observations, "kind = \"each-recording\"").unwrap();
    assert_eq!(turns.holdout.fitted.n, 99);
    assert!(turns.residuals.iter().all(|r| r.held_out));
}

#[test]
fn the_same_input_gives_the_same_result() {
    let (model, observations) = boards();
    let holdout = "kind = \"every-nth-cavity\"\nn = 4\noffset = 1";
    let (a, b) = (run(&model, &observations, holdout).unwrap(), run(&model, &observations, holdout).unwrap());
    assert_eq!(a, b);
    // Cavities c0, c1, ... in natural order, whatever their text order: c1, c5, c9, c13, ...
    for (o, r) in observations.iter().zip(&a.residuals) {
        assert_eq!(r.held_out, o.dwell.dwell % 4 == 1, "{:?}", o.cavity());
    }
}

#[test]
fn named_things_are_held_out_and_misspelt_ones_named() {
    let (model, observations) = boards();
    let c = run(&model, &observations, "kind = \"cavities\"\nnames = [\"c3\", \"c17\"]").unwrap();
    assert_eq!(c.holdout.fitted.n, 6);
    let c = run(&model, &observations, "kind = \"dwells\"\ndwells = [[0, 5], [2, 1]]").unwrap();
    let held: Vec<_> = c.residuals.iter().filter(|r| r.held_out).map(|r| r.dwell.to_string()).collect();
    assert_eq!(held, ["recording 0 dwell 5", "recording 2 dwell 1"]);
    for (holdout, hint) in [
        ("kind = \"cavities\"\nnames = [\"C3\"]", "did you mean"),
        ("kind = \"recordings\"\nrecordings = [\"rol\"]", "did you mean `roll`"),
        ("kind = \"recordings\"\nrecordings = [7]", "index in the pipeline"),
        ("kind = \"dwells\"\ndwells = [[0, 999]]", "[0, 999]"),
        ("kind = \"random\"\nshare = 1.5", "between 0 and 1"),
        ("kind = \"cavity-folds\"\nk = 1", "from 2 to"),
        ("kind = \"recordings\"\nrecordings = [0, 1, 2]", "outside the hold-out"),
    ] {
        let error = run(&model, &observations, holdout).unwrap_err().to_string();
        assert!(error.contains(hint), "{error}");
    }
}
