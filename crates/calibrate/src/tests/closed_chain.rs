//! Two arms of the lab, which lays out its own axes, against the two models, tips joined.

use crate::problem::Problem as _;
use crate::{
    CalibrateError, ChainArm, ClosedChain, ClosedChainProblem, ClosedObservation, Closure, FitConfig,
    HoldoutConfig, LengthKnowledge, Objective, calibrate_closed_chain,
};
use armcal_core::Pose;
use armcal_lab::pair::{ObservedPair, PairConfig, PairTruth, observe};
use armcal_model::{Chain, Frame, Frames, Model};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use std::collections::BTreeMap;
use std::path::Path;

const LAB: &str = include_str!("../../../../pipelines/lab/two-arms.toml");
const RIGHT: &str = include_str!("../../../../pipelines/models/right_arm.toml");
const LEFT: &str = include_str!("../../../../pipelines/models/left_arm.toml");
const LINK: Closure = Closure::RigidLink { length_m: 0.2, knowledge: LengthKnowledge::Given };
const IN_TURN: HoldoutConfig = HoldoutConfig::CavityFolds { k: 5 };

fn lab(seed: u64, poses: usize, length_mm: Option<f64>) -> ObservedPair {
    let mut config = PairConfig::from_toml(LAB, Path::new("two-arms.toml")).unwrap();
    config.seed = seed;
    config.task.poses = poses;
    config.joined.length_mm = length_mm;
    observe(&config).unwrap()
}

fn arm(name: &str, dh: &str, base: Frame) -> ChainArm {
    let chain = Chain::from_dh_toml(dh, Path::new(name)).unwrap();
    let tip = Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) };
    let model = Model::new(chain, Frames { base, tip, markers: Vec::new(), boards: Vec::new() }).unwrap();
    ChainArm { name: name.into(), model }
}

/// Right arm at the world's origin; nobody knows where the left one is.
fn chain(closure: Closure) -> ClosedChain {
    let right = arm("right", RIGHT, Frame::given("base", Pose::identity()));
    let left = arm("left", LEFT, Frame::estimated("base", Pose::identity()));
    ClosedChain::new([right, left], closure).unwrap()
}

fn closed(observed: &ObservedPair) -> Vec<ClosedObservation> {
    let joined = |arms: &[_; 2]| ClosedObservation { arms: arms.clone(), contact_sigma_m: 0.05e-3 };
    observed.dwells.iter().map(joined).collect()
}

fn placed(closure: Closure, observations: &[ClosedObservation]) -> ClosedChain {
    let mut chain = chain(closure);
    chain.place_bases(observations).unwrap();
    chain
}

/// True values by parameter name; a base relative to where its frame started.
fn truth(truth: &PairTruth, chain: &ClosedChain) -> BTreeMap<String, f64> {
    let mut values: BTreeMap<String, f64> =
        truth.arms.iter().flat_map(|a| &a.deviations).map(|d| (d.name.clone(), d.value)).collect();
    let base = &truth.arms[1].world_from_base;
    let [x, y, z, w] = base.quaternion_xyzw;
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    let at: Pose = Isometry3::from_parts(Translation3::from(base.xyz_m), rotation);
    let start = chain.arms()[1].model.base_in_world(&chain.arms()[1].model.nominal());
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
    let observations = closed(&lab(3, 4, Some(200.0)));
    for closure in [Closure::SamePoint, LINK] {
        let chain = chain(closure);
        let problem = ClosedChainProblem::new(&chain, &observations).unwrap();
        let p: Vec<f64> = chain.nominal().iter().enumerate().map(|(k, v)| v + 1e-3 * k as f64).collect();
        for block in 0..observations.len() {
            let (residual, jacobian) = problem.linearised(block, &p);
            assert_eq!(residual, problem.residual(block, &p));
            for k in 0..p.len() {
                let at = |step: f64| {
                    let mut moved = p.clone();
                    moved[k] += step;
                    problem.residual(block, &moved)
                };
                let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                let off = (slope - jacobian.column(k)).amax();
                assert!(off < 1e-8, "{} {}: {off}", closure.word(), chain.parameters()[k].name);
            }
        }
    }
}

#[test]
fn determined_parameters_of_both_arms_lie_within_their_intervals() {
    for (what, closure, length_mm) in [("same point", Closure::SamePoint, None), ("link", LINK, Some(200.0))]
    {
        let (mut inside, mut total, mut free, mut of) = (0, 0, 0, BTreeMap::<String, [usize; 2]>::new());
        for seed in 0..30 {
            let observed = lab(seed, 80, length_mm);
            let observations = closed(&observed);
            let chain = placed(closure, &observations);
            let truth = truth(&observed.truth, &chain);
            let config = FitConfig::default();
            let fit =
                calibrate_closed_chain(&chain, &observations, &config, &HoldoutConfig::None).unwrap().fit;
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
    for (closure, length_mm) in [(Closure::SamePoint, None), (LINK, Some(200.0))] {
        let observations = closed(&lab(5, 100, length_mm));
        let chain = placed(closure, &observations);
        let result = calibrate_closed_chain(&chain, &observations, &FitConfig::default(), &IN_TURN).unwrap();
        let (side, floor) = (&result.holdout, result.noise_floor_m);
        println!(
            "{}: {} dwells held out, nominal {:.3} mm, calibrated {:.4} mm, floor {:.4} mm",
            closure.word(),
            side.fitted.n,
            side.nominal.mean_m * 1e3,
            side.fitted.mean_m * 1e3,
            floor * 1e3
        );
        assert_eq!(side.fitted.n, 100);
        // An estimated base takes up most of what nominal arms miss; what is left is still far from noise.
        assert!(side.nominal.mean_m > 20.0 * floor && side.fitted.mean_m < 1.5 * floor, "{side:?} {floor}");
        assert!((0.8..1.3).contains(&result.fit.sigma_scale), "{}", result.fit.sigma_scale);

        // Eq. 4 of the paper, the sum of distances within the bounds, is about closing errors just as well.
        let paper = FitConfig { objective: Objective::Paper, ..FitConfig::default() };
        let result = calibrate_closed_chain(&chain, &observations, &paper, &HoldoutConfig::None).unwrap();
        assert!(result.train.fitted.mean_m < 1.5 * floor, "{:?}", result.train);
    }
}

#[test]
fn without_a_known_length_the_scale_is_open_and_a_known_link_closes_it() {
    let scale = |closure, length_mm| {
        let observations = closed(&lab(5, 100, length_mm));
        let chain = placed(closure, &observations);
        let config = FitConfig::default();
        let fit = calibrate_closed_chain(&chain, &observations, &config, &HoldoutConfig::None).unwrap().fit;
        let texts: Vec<String> = fit.undetermined.iter().map(|d| d.text.clone()).collect();
        println!("{}:\n  {}", closure.word(), texts.join("\n  "));
        let sigma_of = |name: &str| fit.estimates.iter().find(|e| e.parameter.name == name).unwrap().sigma;
        (texts.iter().any(|t| t.starts_with("scale")), sigma_of("right.joint2.a"))
    };
    let (open, sigma_m) = scale(Closure::SamePoint, None);
    // 400 mm known to 4 mm, 354.3 mm likewise, in both arms: 0.53 % of 400 mm is what the priors leave.
    assert!(open && (1.8e-3..2.3e-3).contains(&sigma_m), "{open} {sigma_m}");
    let (open, sigma_m) = scale(LINK, Some(200.0));
    assert!(!open && sigma_m < 0.5e-3, "{open} {sigma_m}");
    let estimated = Closure::RigidLink { length_m: 0.19, knowledge: LengthKnowledge::Estimated };
    let (open, _) = scale(estimated, Some(200.0));
    assert!(open, "an unmeasured link knows no scale");
}

#[test]
fn what_cannot_be_joined_is_said() {
    let given = || Frame::given("base", Pose::identity());
    let free = || Frame::estimated("base", Pose::identity());
    let says = |arms: [ChainArm; 2], closure| ClosedChain::new(arms, closure).unwrap_err().to_string();
    let same = says([arm("left", LEFT, given()), arm("left", LEFT, free())], Closure::SamePoint);
    assert!(same.contains("both arms are named `left`"), "{same}");
    let adrift = says([arm("right", RIGHT, free()), arm("left", LEFT, free())], Closure::SamePoint);
    assert!(adrift.contains("bases of right and left are both free"), "{adrift}");
    let short = Closure::RigidLink { length_m: -0.1, knowledge: LengthKnowledge::Given };
    let short = says([arm("right", RIGHT, given()), arm("left", LEFT, free())], short);
    assert!(short.contains("above zero"), "{short}");

    let (chain, mut observations) = (chain(Closure::SamePoint), closed(&lab(1, 6, None)));
    let fit = |o: &[ClosedObservation], holdout: &HoldoutConfig| {
        calibrate_closed_chain(&chain, o, &FitConfig::default(), holdout).unwrap_err()
    };
    let cavity = HoldoutConfig::EveryNthCavity { n: 4, offset: 0 };
    assert!(fit(&observations, &cavity).to_string().contains("none in common"));
    assert!(matches!(fit(&[], &HoldoutConfig::None), CalibrateError::NoObservations { .. }));
    observations[2].arms[1].joint_rad[0] = f64::NAN;
    let broken = fit(&observations, &HoldoutConfig::None).to_string();
    assert!(broken.contains("recording 0 dwell 2 of the left arm"), "{broken}");
    observations[2].arms[1].joint_rad.pop();
    let broken = fit(&observations, &HoldoutConfig::None).to_string();
    assert!(broken.contains("2 joint readings for an arm of 3"), "{broken}");
}
