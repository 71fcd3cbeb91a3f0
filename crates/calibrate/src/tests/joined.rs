//! Two arms of the lab, which lays out its own axes, against the two models, tips joined.

use crate::objective::problem::Problem as _;
use crate::{
    CalibrateError, Calibration, FitConfig, HoldoutConfig, ModelProblem, Objective, align_frames, calibrate,
};
use armcal_core::{Against, DwellId, FeatureId, Observation, Pose, Reference};
use armcal_lab::pair::{ObservedPair, PairConfig, PairTruth, observe};
use armcal_model::{ArmFrames, Chain, Frame, Knowledge, Length, Model, ModelError};
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion};
use std::collections::BTreeMap;
use std::path::Path;

/// How long a link is [m], and how well that is known.
type Link = (f64, Knowledge);

const LAB: &str = include_str!("../../../../pipelines/lab/two-arms.toml");
const RIGHT: &str = include_str!("../../../../pipelines/models/right_arm.toml");
const LEFT: &str = include_str!("../../../../pipelines/models/left_arm.toml");
const LINK: Option<Link> = Some((0.2, Knowledge::Given));
const ONE_POINT: Option<Link> = None;
const IN_TURN: HoldoutConfig = HoldoutConfig::CavityFolds { k: 5 };

fn lab(seed: u64, poses: usize, length_mm: Option<f64>) -> ObservedPair {
    let mut config = PairConfig::from_toml(LAB, Path::new("two-arms.toml")).unwrap();
    config.seed = seed;
    config.task.poses = poses;
    config.joined.length_mm = length_mm;
    observe(&config).unwrap()
}

/// Two arms, each with its name, table and base.
fn arms(arms: [(&str, &str, Frame); 2], link: Option<Link>) -> Result<Model, ModelError> {
    let tip =
        |name: &str| Frame { free_rotation: false, ..Frame::given(format!("{name}.tip"), Pose::identity()) };
    let chains = arms
        .iter()
        .map(|(name, dh, _)| ((*name).to_owned(), Chain::from_dh_toml(dh, Path::new(name)).unwrap()));
    let chain = Chain::joined(chains.collect())?;
    let frames = arms.into_iter().map(|(name, _, base)| ArmFrames {
        base: Frame { name: format!("{name}.base"), ..base },
        tip: tip(name),
    });
    let link = link.map(|(length_m, knowledge)| Length::of_link(length_m, knowledge));
    Model::of_arms(chain, frames.collect())?.against(&[], link.as_slice())
}

/// Right arm at the world's origin; nobody knows where the left one is.
fn pair(link: Option<Link>) -> Model {
    let given = Frame::given("base", Pose::identity());
    let estimated = Frame::estimated("base", Pose::identity());
    arms([("right", RIGHT, given), ("left", LEFT, estimated)], link).unwrap()
}

/// Both arms of a dwell as one observation: the tip of the first is the reference of the second.
fn both([first, second]: &[Observation; 2], apart: bool) -> Observation {
    let mut joint_rad = first.joint_rad.clone();
    joint_rad.extend(&second.joint_rad);
    let other = Against::Feature(FeatureId::TIP);
    let joined = match apart {
        true => Reference::distance(other, 0, 0.0),
        false => Reference::Joined { to: other },
    };
    let mut both = Observation { feature: FeatureId(1), ..Observation::bare(first.dwell, joint_rad, joined) };
    both.joint_sigma_rad = [&first.joint_sigma_rad[..], &second.joint_sigma_rad].concat();
    both.covariance_m2 = Matrix3::identity() * 0.05e-3f64.powi(2);
    both
}

fn closed(observed: &ObservedPair, link: Option<Link>) -> Vec<Observation> {
    observed.dwells.iter().map(|arms| both(arms, link.is_some())).collect()
}

fn placed(link: Option<Link>, observations: &[Observation]) -> Model {
    let mut model = pair(link);
    let aligned = align_frames(&model, observations, &FitConfig::default()).unwrap();
    let base = model.arm_base_in_world(&aligned, 1);
    model.set_base_start(1, base);
    model
}

fn calibrated(model: &Model, observations: &[Observation], holdout: &HoldoutConfig) -> Calibration {
    calibrate(model, observations, &FitConfig::default(), holdout).unwrap()
}

fn word(link: Option<Link>) -> &'static str {
    if link.is_some() { "rigid link" } else { "same point" }
}

/// True values by parameter name; a base relative to where its frame started.
fn truth(truth: &PairTruth, model: &Model) -> BTreeMap<String, f64> {
    let mut values: BTreeMap<String, f64> =
        truth.arms.iter().flat_map(|a| &a.deviations).map(|d| (d.name.clone(), d.value)).collect();
    let base = &truth.arms[1].world_from_base;
    let [x, y, z, w] = base.quaternion_xyzw;
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    let at: Pose = Isometry3::from_parts(Translation3::from(base.xyz_m), rotation);
    let start = model.arm_base_in_world(&model.nominal(), 1);
    let turn = (start.rotation.inverse() * at.rotation).scaled_axis();
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        values.insert(format!("left.base.{axis}"), at.translation.vector[k]);
        values.insert(format!("left.base.r{axis}"), turn[k]);
    }
    values.insert("link.length".into(), truth.link_m);
    values
}

#[test]
fn the_derivative_is_that_of_the_closing_error() {
    for link in [ONE_POINT, LINK] {
        let observations = closed(&lab(3, 4, Some(200.0)), link);
        let model = pair(link);
        let problem = ModelProblem::new(&model, &observations, &FitConfig::default()).unwrap();
        let p: Vec<f64> = model.nominal().iter().enumerate().map(|(k, v)| v + 1e-3 * k as f64).collect();
        for (block, o) in observations.iter().enumerate() {
            let (residual, jacobian) = problem.linearised(block, &p);
            assert_eq!(residual.len(), if link.is_some() { 1 } else { 3 });
            assert!((&residual - problem.residual(block, &p)).amax() < 1e-15);
            for k in 0..p.len() {
                let at = |step: f64| {
                    let mut moved = p.clone();
                    moved[k] += step;
                    problem.residual(block, &moved)
                };
                let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                let off = (slope - jacobian.column(k)).amax();
                assert!(off < 1e-8, "{} {}: {off}", word(link), model.parameters()[k].name);
            }
            // The covariance is that of the readings, carried by differences of the residual.
            let mut spread = jacobian.columns(0, o.joint_rad.len()).into_owned() * 0.0;
            for j in 0..o.joint_rad.len() {
                let at = |step: f64| {
                    let mut moved = o.clone();
                    moved.joint_rad[j] += step;
                    let rows = model.residual(&p, &moved);
                    rows.rows().collect::<Vec<f64>>()
                };
                for (r, (a, b)) in at(1e-6).into_iter().zip(at(-1e-6)).enumerate() {
                    spread[(r, j)] = (a - b) / 2e-6 * o.joint_sigma_rad[j];
                }
            }
            let mut expected = &spread * spread.transpose();
            (0..expected.nrows()).for_each(|r| expected[(r, r)] += 0.05e-3f64.powi(2));
            let covariance = problem.covariance(block, &p);
            assert!((covariance - &expected).amax() < 1e-6 * expected.amax(), "{}", word(link));
        }
    }
}

#[test]
fn determined_parameters_of_both_arms_lie_within_their_intervals() {
    for (what, link, length_mm) in [("same point", ONE_POINT, None), ("link", LINK, Some(200.0))] {
        let (mut inside, mut total, mut free, mut of) = (0, 0, 0, BTreeMap::<String, [usize; 2]>::new());
        for seed in 0..30 {
            let observed = lab(seed, 80, length_mm);
            let observations = closed(&observed, link);
            let model = placed(link, &observations);
            let truth = truth(&observed.truth, &model);
            let fit = calibrated(&model, &observations, &HoldoutConfig::None).fit;
            for e in fit.estimates.iter().filter(|e| e.parameter.free) {
                free += 1;
                if e.determined {
                    let truth = truth[&e.parameter.name];
                    let hit = usize::from(e.ci95[0] <= truth && truth <= e.ci95[1]);
                    (inside, total) = (inside + hit, total + 1);
                    let count = of.entry(e.parameter.name.clone()).or_default();
                    *count = [count[0] + hit, count[1] + 1];
                }
            }
        }
        let share = inside as f64 / total as f64;
        println!("{what}: coverage {share:.3} of {total} determined parameters ({free} free in 30 pairs)");
        println!("{of:?}");
        assert!((0.88..0.995).contains(&share), "{what}: {share}");
        // Both arms have their say: elbows and twists are seen from the other arm.
        for arm in ["right", "left"] {
            let determined = of.keys().filter(|name| name.starts_with(arm)).count();
            assert!(determined >= 4, "{what}: {determined} parameters of {arm} are ever determined: {of:?}");
        }
    }
}

#[test]
fn closing_errors_of_dwells_never_seen_fall_to_the_noise() {
    for (link, length_mm) in [(ONE_POINT, None), (LINK, Some(200.0))] {
        let observations = closed(&lab(5, 100, length_mm), link);
        let model = placed(link, &observations);
        let result = calibrated(&model, &observations, &IN_TURN);
        let (side, floor) = (&result.holdout, result.noise_floor_m);
        println!(
            "{}: {} dwells held out, nominal {:.3} mm, calibrated {:.4} mm, floor {:.4} mm",
            word(link),
            side.fitted.n,
            side.nominal.mean_m * 1e3,
            side.fitted.mean_m * 1e3,
            floor * 1e3
        );
        assert_eq!(side.fitted.n, 100);
        // An estimated base takes up most of what nominal arms miss; what is left is still far from noise.
        assert!(side.nominal.mean_m > 20.0 * floor && side.fitted.mean_m < 1.5 * floor, "{side:?} {floor}");
        assert!((0.8..1.3).contains(&result.fit.sigma_scale), "{}", result.fit.sigma_scale);
        // A distance is one row: what the fit uses up weighs three times as much there.
        let rows = if link.is_some() { 80.0 } else { 240.0 };
        let expected = (1.0 + result.fit.rank as f64 / rows).sqrt();
        assert!(
            (result.prediction_factor - expected).abs() < 0.02,
            "{} {expected}",
            result.prediction_factor
        );

        // Eq. 4 of the paper, the sum of distances within the bounds, is about closing errors just as well.
        let paper = FitConfig { objective: Objective::Paper, ..FitConfig::default() };
        let result = calibrate(&model, &observations, &paper, &HoldoutConfig::None).unwrap();
        assert!(result.train.fitted.mean_m < 1.5 * floor, "{:?}", result.train);
    }
}

#[test]
fn without_a_known_length_the_scale_is_open_and_a_known_link_closes_it() {
    let scale = |link, length_mm| {
        let observations = closed(&lab(5, 100, length_mm), link);
        let fit = calibrated(&placed(link, &observations), &observations, &HoldoutConfig::None).fit;
        let texts: Vec<String> = fit.undetermined.iter().map(|d| d.text.clone()).collect();
        println!("{}:\n  {}", word(link), texts.join("\n  "));
        let sigma_of = |name: &str| fit.estimates.iter().find(|e| e.parameter.name == name).unwrap().sigma;
        (texts.iter().any(|t| t.starts_with("scale")), sigma_of("right.joint2.a"))
    };
    let (open, sigma_m) = scale(ONE_POINT, None);
    // 400 mm known to 4 mm, 354.3 mm likewise, in both arms: 0.53 % of 400 mm is what the priors leave.
    assert!(open && (1.8e-3..2.3e-3).contains(&sigma_m), "{open} {sigma_m}");
    let (open, sigma_m) = scale(LINK, Some(200.0));
    assert!(!open && sigma_m < 0.5e-3, "{open} {sigma_m}");
    let estimated = (0.19, Knowledge::Estimated);
    let (open, _) = scale(Some(estimated), Some(200.0));
    assert!(open, "an unmeasured link knows no scale");
}

#[test]
fn what_cannot_be_joined_is_said() {
    let given = || Frame::given("base", Pose::identity());
    let free = || Frame::estimated("base", Pose::identity());
    let says = |all, link| arms(all, link).unwrap_err().to_string();
    let same = says([("left", LEFT, given()), ("left", LEFT, free())], ONE_POINT);
    assert!(same.contains("both are named `left`"), "{same}");
    let adrift = says([("right", RIGHT, free()), ("left", LEFT, free())], ONE_POINT);
    assert!(adrift.contains("bases of right and left are both free"), "{adrift}");
    let short = Some((-0.1, Knowledge::Given));
    let short = says([("right", RIGHT, given()), ("left", LEFT, free())], short);
    assert!(short.contains("the length of link is -0.1 m"), "{short}");

    let (model, mut observations) = (pair(ONE_POINT), closed(&lab(1, 6, None), ONE_POINT));
    let fit = |o: &[Observation], holdout: &HoldoutConfig| {
        calibrate(&model, o, &FitConfig::default(), holdout).unwrap_err()
    };
    assert!(matches!(fit(&[], &HoldoutConfig::None), CalibrateError::NoObservations { .. }));
    let linked = Reference::distance(Against::Feature(FeatureId::TIP), 0, 0.0);
    observations[1].reference = linked;
    let linkless = fit(&observations, &HoldoutConfig::None).to_string();
    assert!(
        linkless.contains("recording 0 dwell 1 was measured against length 0, and the model has 0"),
        "{linkless}"
    );
    observations[1].reference = Reference::Joined { to: Against::Feature(FeatureId(2)) };
    assert!(fit(&observations, &HoldoutConfig::None).to_string().contains("dwell 1"));
    observations.remove(1);
    observations[1].joint_rad[3] = f64::NAN;
    let broken = fit(&observations, &HoldoutConfig::None).to_string();
    assert!(broken.contains(&DwellId { recording: 0, dwell: 2 }.to_string()), "{broken}");
    observations[1].joint_rad.pop();
    let broken = fit(&observations, &HoldoutConfig::None).to_string();
    assert!(broken.contains('5') && broken.contains('6'), "{broken}");
}
