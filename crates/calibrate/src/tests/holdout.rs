use super::rig;
use crate::fit;
use crate::{CalibrateError, Calibration, FitConfig, HoldoutConfig, calibrate};
use armcal_core::{Code, DwellId, Observation, Pose, Reference};
use armcal_model::{Frame, Model};
use nalgebra::Vector3;
use proptest::prelude::*;
use std::collections::BTreeSet;

fn run(model: &Model, observations: &[Observation], holdout: &str) -> Result<Calibration, CalibrateError> {
    let holdout: HoldoutConfig = toml::from_str(holdout).unwrap();
    calibrate(model, observations, &FitConfig::default(), &holdout)
}

fn tracked() -> (Model, Vec<Observation>) {
    tracked_often(80)
}

fn tracked_often(dwells: usize) -> (Model, Vec<Observation>) {
    on(rig::tracked_model(), dwells)
}

/// Nobody measured where the base stands.
fn placed_somewhere(dwells: usize) -> (Model, Vec<Observation>) {
    on(rig::model(Frame::estimated("base", Pose::identity()), Vec::new()), dwells)
}

fn on(model: Model, dwells: usize) -> (Model, Vec<Observation>) {
    let mut rng = rig::rng(31);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let observations = rig::tracked(&model, &truth, dwells, &mut rng);
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

/// A turn that begins with what the fit to all saw, and ends a negligible step along its linearisation, ends where a fit that
/// evaluates everything does; one of many dwells too, to which the derivative of that fit is enough.
#[test]
fn shorter_ways_end_at_the_same_place() {
    for (model, observations) in [tracked(), boards(), tracked_often(1_400), placed_somewhere(1_400)] {
        let holdout: HoldoutConfig = toml::from_str("kind = \"cavity-folds\"\nk = 4").unwrap();
        let of = |every_step| {
            let config = FitConfig { every_step, ..FitConfig::default() };
            calibrate(&model, &observations, &config, &holdout).unwrap()
        };
        let (short, long) = (of(false), of(true));
        for (a, b) in short.fit.estimates.iter().zip(&long.fit.estimates) {
            assert!((a.value - b.value).abs() <= 1e-5 * a.sigma, "{}", a.parameter.name);
            assert!((a.sigma - b.sigma).abs() <= 1e-5 * a.sigma, "{}", a.parameter.name);
        }
        for (a, b) in short.residuals.iter().zip(&long.residuals) {
            assert!((a.whitened - b.whitened).amax() < 1e-4, "{}", a.dwell);
            assert!((a.nominal_m - b.nominal_m).amax() < 1e-4 * rig::SIGMA_M, "{}", a.dwell);
        }
    }
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

/// Of few dwells a fit learns a part of their noise too, so that it predicts others worse than noise alone: by how much is
/// known beforehand.
#[test]
fn what_few_dwells_do_not_tell_is_expected_of_the_held_out_ones() {
    let model = rig::tracked_model();
    for (dwells, at_least) in [(30, 1.05), (80, 1.015)] {
        let (mut found, mut expected) = (0.0, 0.0);
        for seed in 0..20 {
            let mut rng = rig::rng(400 + seed);
            let truth = rig::planted(&model, &mut rng, 0.9);
            let observations = rig::tracked(&model, &truth, dwells, &mut rng);
            let c = run(&model, &observations, "kind = \"cavity-folds\"\nk = 5").unwrap();
            found += c.times_floor() / 20.0;
            expected += c.prediction_factor / 20.0;
        }
        println!("{dwells} dwells: {found:.3} floors, {expected:.3} expected");
        assert!(expected > at_least && (found / expected - 1.0).abs() < 0.04, "{found} {expected}");
    }
    let (model, observations) = tracked();
    assert_eq!(run(&model, &observations, "kind = \"none\"").unwrap().prediction_factor, 1.0);
}

/// A turn that leaves out the only poses in which a joint moves knows its length no more than the prior does; of parts that are
/// alike each turn knows as much as the share of the poses that it has.
#[test]
fn what_a_turn_leaves_out_it_is_less_certain_of() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(7);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let mut observations = rig::tracked(&model, &truth, 80, &mut rng);
    let of = |observations: &[Observation], holdout: &str| {
        let c = run(&model, observations, holdout).unwrap();
        let of_elbow = |e: &crate::Estimate| e.parameter.name == "joint2.a";
        let at = c.fit.estimates.iter().position(of_elbow).unwrap();
        c.turn_sigma_ratio.get(at).copied()
    };
    let alike = of(&observations, "kind = \"cavity-folds\"\nk = 5").unwrap();
    assert!((alike / (1.0f64 / 0.8).sqrt() - 1.0).abs() < 0.1, "{alike}");
    assert_eq!(of(&observations, "kind = \"none\""), None);
    // All but the first twenty in one posture: without these nobody tells the upper arm from the base.
    let still = observations[20].clone();
    for (k, o) in observations.iter_mut().enumerate() {
        o.dwell.recording = usize::from(k >= 20);
        if k >= 20 {
            (o.joint_rad, o.reference) = (still.joint_rad.clone(), still.reference.clone());
        }
    }
    let alone = of(&observations, "kind = \"each-recording\"").unwrap();
    assert!(alone > 3.0, "{alone}");
}

/// Whether few dwells err by much or all by a little more than declared: above twice the floor the model is inadequate, and
/// that is one warning.
#[test]
fn errors_above_twice_the_floor_are_inadequate_whatever_the_scatter_says() {
    let (model, observations) = tracked();
    let grave = |observations: &[Observation]| -> (Vec<Code>, Calibration) {
        let c = run(&model, observations, "kind = \"cavity-folds\"\nk = 8").unwrap();
        let grave = c.warnings.iter().filter(|w| w.severity == armcal_core::Severity::Inadequate);
        (grave.map(|w| w.code).collect(), c)
    };
    assert!(grave(&observations).0.is_empty());
    let erring = |from: usize, by_m: f64| {
        let mut all = observations.clone();
        for o in all.iter_mut().skip(from) {
            let armcal_core::Reference::Tracked { position_m, .. } = &mut o.reference else {
                panic!("not tracked")
            };
            position_m.x += by_m;
        }
        all
    };
    let (codes, few) = grave(&erring(70, 40.0 * rig::SIGMA_M));
    assert!(few.fit.sigma_scale < crate::INADEQUATE && few.times_floor() > 2.5, "{}", few.times_floor());
    assert_eq!(codes, [Code::ErrorsAboveFloor]);
    let mut sharper = observations.clone();
    sharper.iter_mut().for_each(|o| o.covariance_m2 /= 9.0);
    let (codes, all) = grave(&sharper);
    assert!(all.fit.sigma_scale > crate::INADEQUATE && all.times_floor() > 2.5, "{}", all.times_floor());
    assert_eq!(codes, [Code::ResidualsAboveNoise]);
}

#[test]
fn a_recording_held_out_gets_its_own_board_and_nothing_else() {
    let (model, observations) = boards();
    let c = run(&model, &observations, "kind = \"recordings\"\nrecordings = [\"roll\"]").unwrap();
    assert_eq!(c.holdout.fitted.n, 33);
    assert!(c.holdout.fitted.mean_m < 1.2 * c.noise_floor_m, "{}", c.holdout.fitted.mean_m);
    let warning = c.warnings.iter().find(|w| w.code == Code::FrameFittedOnHoldout).unwrap();
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

/// A dwell: how the arm stood, and the cavity the tip was in, if any.
fn stands(dwell: usize, joint_rad: Vec<f64>, cavity: Option<usize>) -> Observation {
    let reference = match cavity {
        Some(c) => Reference::Seated { cavity: format!("c{c}"), in_board_m: Vector3::zeros() },
        None => Reference::position(Vector3::zeros()),
    };
    // Dwells of three recordings, as they come.
    Observation::bare(DwellId { recording: dwell % 3, dwell }, joint_rad, reference)
}

fn turns(holdout: &str, observations: &[Observation]) -> (Vec<Vec<usize>>, usize) {
    let config: HoldoutConfig = toml::from_str(holdout).unwrap();
    let found = crate::holdout::resolve(&config, observations, &[]).unwrap();
    let warned = found.warnings.iter().filter(|w| w.code == Code::PoseOnBothSides).count();
    (found.turns, warned)
}

proptest! {
    /// Some poses are visited again and again, each time a little differently; whichever hold-out draws the dwells itself
    /// never shows the fit one of two dwells and asks for the other.
    #[test]
    fn no_pose_stands_on_both_sides_of_a_holdout_that_draws_its_dwells(
        visits in proptest::collection::vec((0_usize..25, -4e-3..4e-3_f64, -4e-3..4e-3_f64), 30..120),
        seated in 0_usize..4,
        seed in 0_u64..1000,
        share in 0.1..0.6_f64,
        k in 2_usize..5,
    ) {
        // Poses of the first few numbers are cavities; 0.05 rad lie between poses, so that all are different.
        let observations: Vec<Observation> = visits
            .iter()
            .enumerate()
            .map(|(dwell, (pose, a, b))| {
                let joint_rad = vec![0.05 * *pose as f64 + a, -0.07 * *pose as f64 + b];
                stands(dwell, joint_rad, (*pose < 5 * seated && dwell % 4 > 0).then_some(*pose))
            })
            .collect();
        let mut holdouts = vec![
            format!("kind = \"random\"\nshare = {share}\nseed = {seed}"),
            format!("kind = \"cavity-folds\"\nk = {k}"),
        ];
        if observations.iter().filter_map(Observation::cavity).collect::<BTreeSet<_>>().len() > 2 {
            holdouts.push("kind = \"every-nth-cavity\"\nn = 3".into());
        }
        for holdout in holdouts {
            let (turns, warned) = turns(&holdout, &observations);
            prop_assert_eq!(warned, 0, "{}", holdout);
            for turn in &turns {
                let poses: BTreeSet<usize> = turn.iter().map(|i| visits[*i].0).collect();
                let all = (0..visits.len()).filter(|i| poses.contains(&visits[*i].0));
                prop_assert_eq!(turn, &all.collect::<Vec<usize>>(), "{}", holdout);
            }
            let held: usize = turns.iter().map(Vec::len).sum();
            prop_assert!(holdout.starts_with("kind = \"random\"") || held > 0);
        }
    }
}

#[test]
fn a_listed_holdout_that_parts_a_pose_is_done_and_said() {
    let poses = [0.1, 0.1002, 0.5, 0.9, 0.9];
    let observations: Vec<Observation> =
        poses.iter().enumerate().map(|(dwell, q)| stands(dwell, vec![*q, 0.0], None)).collect();
    assert_eq!(turns("kind = \"dwells\"\ndwells = [[1, 1], [2, 2]]", &observations), (vec![vec![1, 2]], 1));
    assert_eq!(turns("kind = \"dwells\"\ndwells = [[0, 0], [1, 1]]", &observations), (vec![vec![0, 1]], 0));
    // Dwells 0 and 1, 3 and 4 are of one pose, but of different recordings.
    let config: HoldoutConfig = toml::from_str("kind = \"each-recording\"").unwrap();
    let found = crate::holdout::resolve(&config, &observations, &[]).unwrap();
    assert_eq!(found.turns, [vec![0, 3], vec![1, 4], vec![2]]);
    assert!(found.warnings[0].message.starts_with("4 of the 5 held-out dwells"), "{:?}", found.warnings);
    // Neighbouring cavities are different poses, however close.
    let mut neighbours = observations;
    neighbours[3].reference = Reference::Seated { cavity: "a".into(), in_board_m: Vector3::zeros() };
    neighbours[4].reference = Reference::Seated { cavity: "b".into(), in_board_m: Vector3::zeros() };
    assert_eq!(turns("kind = \"cavities\"\nnames = [\"a\"]", &neighbours).1, 0);
}
