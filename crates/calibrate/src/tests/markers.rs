//! Several markers a pose: they share the encoders' noise, their side of the hold-out, and their weight.

use super::rig;
use crate::fit;
use crate::objective::problem::Problem as _;
use crate::{FitConfig, HoldoutConfig, ModelProblem, align_frames, calibrate, fit_frames, holdout_turns};
use armcal_core::{Code, DwellId, FeatureId, Observation, Pose, Reference};
use armcal_model::{Chain, Frame, Frames, Marker, Model};
use nalgebra::{DMatrix, Matrix3xX, Vector3};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

const ARM: &str = include_str!("../../../../pipelines/models/right_arm.toml");
/// Noise of an encoder: at the tip twice the sensor's own.
const ENCODER_RAD: f64 = 2e-3;

/// The paper's arm with two markers beside the tip: one on the tool's link, one on the forearm, their places not known.
fn model() -> Model {
    let chain = Chain::from_dh_toml(ARM, Path::new("arm.toml")).unwrap();
    let marker = |name: &str, link: &str| Marker {
        link: link.into(),
        frame: Frame { free_rotation: false, ..Frame::estimated(name, Pose::identity()) },
    };
    let frames = Frames {
        tip: Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) },
        markers: vec![marker("hand", "tool"), marker("forearm", "joint2")],
        ..Frames::of_bare_arm()
    };
    Model::new(chain, frames).unwrap()
}

/// A truth with markers a few centimetres off their links.
fn planted(model: &Model, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut truth = rig::planted(model, rng, 0.9);
    for (name, at) in [("hand", [0.04, -0.03, -0.05]), ("forearm", [-0.05, 0.06, 0.02])] {
        for (axis, at) in ["x", "y", "z"].iter().zip(at) {
            truth[model.index(&format!("{name}.{axis}")).unwrap()] = at;
        }
    }
    truth
}

/// `n` poses in which the sensor saw tip and both markers, and the encoders erred once for all three.
fn seen(model: &Model, truth: &[f64], n: usize, rng: &mut ChaCha8Rng) -> Vec<Observation> {
    let mut all = Vec::with_capacity(3 * n);
    for (dwell, q) in rig::poses(n, rng).into_iter().enumerate() {
        let off = rig::gauss3(rng, ENCODER_RAD);
        let read: Vec<f64> = q.iter().zip(off.iter()).map(|(q, off)| q + off).collect();
        for (feature, _) in model.features() {
            let id = DwellId { recording: 0, dwell };
            let nowhere = Reference::position(Vector3::zeros());
            let stands = Observation { feature, ..rig::observation(id, q.clone(), nowhere) };
            let position_m = model.predicted_tip_in_world(truth, &stands) + rig::gauss3(rng, rig::SIGMA_M);
            all.push(Observation {
                joint_rad: read.clone(),
                joint_sigma_rad: vec![ENCODER_RAD; 3],
                reference: Reference::position(position_m),
                ..stands
            });
        }
    }
    all
}

#[test]
fn intervals_of_three_markers_a_pose_hold_the_truth_95_percent_of_the_time() {
    let model = model();
    let (mut inside, mut total, mut alone, mut of_alone) = (0, 0, 0, 0);
    for seed in 0..200 {
        let mut rng = rig::rng(seed);
        let truth = planted(&model, &mut rng);
        let observations = seen(&model, &truth, 33, &mut rng);
        let start = fit_frames(&model, &observations, &FitConfig::default()).unwrap();
        for name in ["hand", "forearm"] {
            let x = model.index(&format!("{name}.x")).unwrap();
            assert!(
                (start[x] - truth[x]).abs() < 0.02,
                "{name} starts at {} m, is at {} m",
                start[x],
                truth[x]
            );
        }
        let config = FitConfig::default();
        for e in fit(&model, &observations, &config).unwrap().estimates.iter().zip(&truth) {
            if e.0.parameter.free && e.0.determined {
                total += 1;
                inside += usize::from(e.0.ci95[0] <= *e.1 && *e.1 <= e.0.ci95[1]);
            }
        }
        // The same rows as if each had noise of its own: the dwells are numbered apart.
        if seed < 40 {
            let apart = observations.iter().enumerate().map(|(i, o)| {
                let dwell = DwellId { dwell: i, ..o.dwell };
                Observation { dwell, ..o.clone() }
            });
            for e in fit(&model, &apart.collect::<Vec<_>>(), &config).unwrap().estimates.iter().zip(&truth) {
                if e.0.parameter.free && e.0.determined {
                    of_alone += 1;
                    alone += usize::from(e.0.ci95[0] <= *e.1 && *e.1 <= e.0.ci95[1]);
                }
            }
        }
    }
    let share = f64::from(inside as u32) / f64::from(total as u32);
    let apart = f64::from(alone as u32) / f64::from(of_alone as u32);
    println!("coverage {share:.4} of {total}; with noise of their own {apart:.4} of {of_alone}");
    assert!((0.93..0.97).contains(&share), "coverage {share} over {total}");
    assert!(apart < share - 0.02, "noise that is shared narrows what is thought to be independent: {apart}");
}

#[test]
fn a_block_is_a_pose_and_its_covariance_is_that_of_all_its_rows() {
    let model = model();
    let mut rng = rig::rng(3);
    let truth = planted(&model, &mut rng);
    let observations = seen(&model, &truth, 5, &mut rng);
    let problem = ModelProblem::new(&model, &observations, &FitConfig::default()).unwrap();
    assert_eq!((problem.blocks(), problem.observations_of(2)), (5, 3));
    let of_pose = &observations[6..9];
    let mut spread = DMatrix::zeros(9, 3);
    for (k, o) in of_pose.iter().enumerate() {
        let own: Matrix3xX<f64> = model.joint_jacobian(&truth, o) * ENCODER_RAD;
        spread.rows_mut(3 * k, 3).copy_from(&own);
    }
    let expected = DMatrix::identity(9, 9) * rig::SIGMA_M.powi(2) + &spread * spread.transpose();
    let found = problem.covariance(2, &truth);
    assert!((&found - &expected).amax() < 1e-12 * expected.amax(), "{found} {expected}");
    let (residual, jacobian) = problem.linearised(2, &truth);
    for (k, o) in of_pose.iter().enumerate() {
        let (own, by) = model.residual_with_jacobian(&truth, o);
        assert_eq!(residual.rows(3 * k, 3), own.position_m);
        assert_eq!(jacobian.rows(3 * k, 3), by);
    }
    let mut each = Vec::new();
    problem.linearised_each(0..5, &truth, &|_| true, &mut |block, linearised| {
        each.push((block, linearised.into_owned()))
    });
    assert_eq!(each[2], (2, (residual, jacobian)));
}

#[test]
fn a_pose_is_held_out_whole_and_weighs_as_one() {
    let model = model();
    let mut rng = rig::rng(5);
    let truth = planted(&model, &mut rng);
    let mut observations = seen(&model, &truth, 40, &mut rng);
    for holdout in [
        HoldoutConfig::CavityFolds { k: 5 },
        HoldoutConfig::Random { share: 0.3, seed: 1 },
        HoldoutConfig::Dwells { dwells: vec![[0, 3], [0, 17]] },
    ] {
        for turn in holdout_turns(&model, &observations, &holdout).unwrap() {
            let dwells: std::collections::BTreeSet<DwellId> =
                turn.iter().map(|i| observations[*i].dwell).collect();
            assert_eq!(turn.len(), 3 * dwells.len(), "{holdout:?}");
        }
    }
    // One marker is knocked in one pose.
    let at = observations.iter().position(|o| o.dwell.dwell == 7 && o.feature == FeatureId(1)).unwrap();
    if let Reference::Tracked { position_m, .. } = &mut observations[at].reference {
        position_m.x += 0.05;
    }
    let calibration = calibrate(&model, &observations, &FitConfig::default(), &HoldoutConfig::None).unwrap();
    assert_eq!(calibration.fit.weights.len(), observations.len());
    assert_eq!(calibration.residuals.len(), observations.len());
    for pose in calibration.fit.weights.chunks(3) {
        assert!(pose.iter().all(|w| *w == pose[0]), "{pose:?}");
    }
    assert!(calibration.fit.weights[at] < 0.1, "{}", calibration.fit.weights[at]);
    let outliers = calibration.warnings.iter().find(|w| w.code == Code::Outliers).unwrap();
    assert_eq!(outliers.subject, observations[at].dwell.to_string());
    assert!(outliers.message.starts_with("3 of 120 observations"), "{}", outliers.message);
}

#[test]
fn markers_are_placed_on_their_links_before_anything_is_fitted() {
    let model = model();
    let mut rng = rig::rng(9);
    let mut truth = model.nominal();
    for (k, p) in model.parameters().iter().enumerate().filter(|(_, p)| p.name.starts_with("hand.")) {
        truth[k] = 0.3 + p.nominal;
    }
    let observations = seen(&model, &truth, 20, &mut rng);
    let placed = align_frames(&model, &observations, &FitConfig::default()).unwrap();
    for (found, truth) in placed.iter().zip(&truth) {
        assert!((found - truth).abs() < 1e-3, "{found} {truth}");
    }
    // What was not measured stays where it was.
    let of_tip: Vec<Observation> = observations.into_iter().filter(|o| o.feature == FeatureId::TIP).collect();
    let placed = align_frames(&model, &of_tip, &FitConfig::default()).unwrap();
    let x = model.index("hand.x").unwrap();
    assert_eq!(placed[x], 0.0);
}
