//! Calibration without a camera: by a ballbar to a post, by a gauge above a plate, by a point that the tip is brought into.

use super::rig;
use crate::fit;
use crate::{Fit, FitConfig, HoldoutConfig, calibrate, fit_frames};
use armcal_core::{Against, DwellId, Observation, Pose, Reference};
use armcal_model::{Chain, FixedPlace, Frame, Frames, Knowledge, Length, Model};
use nalgebra::{Matrix3, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::path::Path;

const SIGMA_M: f64 = 20e-6;
/// Where the post really is; the model starts elsewhere.
const POST_M: [f64; 3] = [0.52, -0.35, -0.12];
const BAR_M: f64 = 0.1504;

fn place(name: &str, at: Pose, is_plane: bool) -> FixedPlace {
    FixedPlace { frame: Frame::estimated(name, at), is_plane }
}

/// The paper's arm beside a post and above a plate, neither of which is known well, with a bar known to 10 um.
fn model() -> Model {
    let places = [
        place("post", Pose::translation(0.5, -0.3, -0.1), false),
        place("plate", Pose::translation(0.3, 0.1, -0.2), true),
    ];
    let knowledge = Knowledge::Measured { sigma_m: 10e-6, sigma_rad: 0.0 };
    let bar = Length { name: "bar".into(), length_m: 0.1504, knowledge };
    rig::tracked_model().against(&places, &[bar]).unwrap()
}

fn planted(model: &Model, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut truth = rig::planted(model, rng, 0.9);
    let mut set = |name: &str, value: f64| truth[model.index(name).unwrap()] = value;
    for (axis, value) in ["x", "y", "z"].iter().zip(POST_M) {
        set(&format!("post.{axis}"), value);
    }
    set("plate.z", 4e-3);
    set("plate.rx", 0.02);
    set("plate.ry", -0.03);
    set("bar.length", BAR_M + 10e-6 * rng.sample::<f64, _>(StandardNormal));
    truth
}

/// What a ballbar and a gauge read: worked out from where the tip is, not from the model's rows.
fn measured(model: &Model, truth: &[f64], n: usize, rng: &mut ChaCha8Rng) -> Vec<Observation> {
    let value = |name: &str| truth[model.index(name).unwrap()];
    let plate = Pose::translation(0.3, 0.1, -0.2);
    let normal =
        nalgebra::UnitQuaternion::from_scaled_axis(Vector3::new(value("plate.rx"), value("plate.ry"), 0.0))
            * Vector3::z();
    let origin_m = plate.translation.vector + Vector3::z() * value("plate.z");
    let mut all = Vec::new();
    for (dwell, q) in rig::poses(n, rng).into_iter().enumerate() {
        let dwell = DwellId { recording: 0, dwell };
        let tip_m = model.tip_in_base(truth, &q).translation.vector;
        let mut noise = || SIGMA_M * rng.sample::<f64, _>(StandardNormal);
        let distance_m = (tip_m - Vector3::from(POST_M)).norm() - value("bar.length") + noise();
        let height_m = normal.dot(&(tip_m - origin_m)) + noise();
        for reference in
            [Reference::distance(Against::Fixed(0), 0, distance_m), Reference::height(1, height_m)]
        {
            all.push(Observation {
                covariance_m2: Matrix3::identity() * SIGMA_M.powi(2),
                ..Observation::bare(dwell, q.clone(), reference)
            });
        }
    }
    all
}

fn estimate<'f>(fit: &'f Fit, name: &str) -> &'f crate::Estimate {
    fit.estimates.iter().find(|e| e.parameter.name == name).unwrap()
}

#[test]
fn intervals_from_distances_and_heights_hold_the_planted_truth_95_percent_of_the_time() {
    let model = model();
    let mut coverage = rig::Coverage::default();
    // Truths are drawn evenly between the bounds: where the prior has a say, through another parameter too, intervals hold more.
    // Places have no bounds and go with the joints' zeros.
    let of_the_data = |e: &crate::Estimate| {
        let half = 0.5 * (e.parameter.upper - e.parameter.lower);
        e.determined && half.is_finite() && e.sigma <= 0.05 * half
    };
    for seed in 0..100 {
        let mut rng = rig::rng(seed);
        let truth = planted(&model, &mut rng);
        let observations = measured(&model, &truth, 120, &mut rng);
        let fit = fit(&model, &observations, &FitConfig::default()).unwrap();
        coverage.count(&fit, &truth, of_the_data);
    }
    let share = coverage.share();
    assert!((0.93..0.975).contains(&share), "coverage {share}");
}

#[test]
fn places_are_found_from_starts_that_are_off_and_both_measurements_of_a_dwell_stay_on_one_side() {
    let model = model();
    let mut rng = rig::rng(7);
    let truth = planted(&model, &mut rng);
    let observations = measured(&model, &truth, 120, &mut rng);
    let frames = fit_frames(&model, &observations, &FitConfig::default()).unwrap();
    let post_m = model.place_in_world(&frames, 0).translation.vector;
    // With the arm at nominal, as far as its errors of millimetres let them.
    assert!((post_m - Vector3::from(POST_M)).norm() < 30e-3, "{post_m:?}");
    let found = calibrate(
        &model,
        &observations,
        &FitConfig::default(),
        &HoldoutConfig::Random { share: 0.25, seed: 3 },
    );
    let found = found.unwrap();
    for pair in found.residuals.chunks(2) {
        assert_eq!((pair[0].dwell, pair[0].held_out), (pair[1].dwell, pair[1].held_out));
    }
    let (nominal, fitted) = (found.holdout.nominal.mean_m, found.holdout.fitted.mean_m);
    assert!(nominal > 1e-3 && fitted < 2.0 * SIGMA_M, "{nominal} {fitted}");
    // How far it is from the first axis; where around that, and how high, goes with the zero of the first joint and its height.
    let [x, y] = ["x", "y"].map(|axis| estimate(&found.fit, &format!("post.{axis}")).value);
    let off_m = x.hypot(y) - POST_M[0].hypot(POST_M[1]);
    assert!(off_m.abs() < 0.3e-3, "{off_m}");
}

/// The table of a UR10, every entry of which may be off.
fn six_axes() -> Model {
    let rows = [
        (127.3, 0.0, 90.0),
        (0.0, -612.0, 0.0),
        (0.0, -572.3, 0.0),
        (163.9, 0.0, 90.0),
        (115.7, 0.0, -90.0),
        (92.2, 0.0, 0.0),
    ];
    let row = |(at, (d, a, alpha)): (usize, &(f64, f64, f64))| {
        format!(
            "[[rows]]\nname = \"joint{}\"\ntheta_deg = 0.0\nd_mm = {d:?}\na_mm = {a:?}\nalpha_deg = {alpha:?}\n",
            at + 1
        )
    };
    let text = "name = \"six\"\n".to_owned() + &rows.iter().enumerate().map(row).collect::<String>();
    let chain = Chain::from_dh_toml(&text, Path::new("six.toml")).unwrap();
    let tip = Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) };
    Model::new(chain, Frames { tip, ..Frames::of_bare_arm() }).unwrap()
}

/// A point that the tip is brought into from many sides tells angles and proportions, and no size; a bar to it does.
#[test]
fn one_point_from_many_sides_leaves_the_scale_open_and_a_known_distance_closes_it() {
    let post = place("post", Pose::translation(-0.7, 0.1, 0.3), false);
    let bar = Length { name: "bar".into(), length_m: 0.15, knowledge: Knowledge::Given };
    let model = six_axes().against(&[post], &[bar]).unwrap();
    let mut rng = rig::rng(5);
    let mut truth = rig::planted(&model, &mut rng, 0.5);
    for (axis, value) in ["x", "y", "z"].iter().zip([-0.72, 0.08, 0.31]) {
        truth[model.index(&format!("post.{axis}")).unwrap()] = value;
    }
    let post = Against::Fixed(0);
    let touched = reached(&model, &truth, &Reference::Joined { to: post }, 80, &mut rng);
    let apart = Reference::distance(post, 0, 0.0);
    let spun = reached(&model, &truth, &apart, 80, &mut rng);
    let open = |observations: &[Observation]| {
        let found = fit(&model, observations, &FitConfig::default()).unwrap();
        let texts: Vec<String> = found.undetermined.iter().map(|d| d.text.clone()).collect();
        let forearm = estimate(&found, "joint3.a");
        let off_m = forearm.value - truth[model.index("joint3.a").unwrap()];
        println!("{off_m:e} {:e}\n  {}", forearm.sigma, texts.join("\n  "));
        assert!(off_m.abs() < 4.0 * forearm.sigma, "{off_m} {}", forearm.sigma);
        let elbow = estimate(&found, "joint3.theta");
        assert!(elbow.determined && elbow.sigma < 1e-3, "{elbow:?}");
        (texts.iter().any(|t| t.starts_with("scale (every length of the arm")), forearm.sigma)
    };
    let (scale_is_open, sigma_m) = open(&touched);
    assert!(scale_is_open && sigma_m > 0.5e-3, "{sigma_m}");
    let (scale_is_open, sigma_m) = open(&spun);
    assert!(!scale_is_open && sigma_m < 0.2e-3, "{sigma_m}");
}

/// Poses in which the tip of the true arm is where the reference has it, by Newton's method from random ones; then it sits a
/// little beside.
fn reached(
    model: &Model,
    truth: &[f64],
    reference: &Reference,
    n: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<Observation> {
    let mut all: Vec<Observation> = Vec::new();
    while all.len() < n {
        let q: Vec<f64> = [0.0, -1.2, 1.6, -1.0, -1.5, 0.0].map(|q| q + rng.random_range(-1.2..1.2)).to_vec();
        let mut o = Observation::bare(DwellId { recording: 0, dwell: all.len() }, q, reference.clone());
        let by = |o: &mut Observation, off: Option<Vector3<f64>>| {
            let (residual, jacobian) = model.residual_with_joint_jacobian(truth, o);
            let rows: Vec<f64> = match off {
                Some(off) => off.iter().copied().take(residual.len()).collect(),
                None => residual.rows().collect(),
            };
            let step = jacobian.pseudo_inverse(1e-3).unwrap() * nalgebra::DVector::from_vec(rows);
            o.joint_rad.iter_mut().zip(step.iter()).for_each(|(q, step)| *q -= step.clamp(-0.3, 0.3));
        };
        (0..40).for_each(|_| by(&mut o, None));
        if model.residual(truth, &o).position_m.norm() < 1e-10 {
            by(&mut o, Some(rig::gauss3(rng, SIGMA_M)));
            o.covariance_m2 = Matrix3::identity() * SIGMA_M.powi(2);
            all.push(o);
        }
    }
    all
}
