//! A kind of measurement of somebody else's program, in one file and one line: a wheel rolls along a straight rail, and a gauge
//! shows how far the tip is from it. No list of ours has it; it is registered, written in a pipeline, and calibrates an arm.

#![allow(clippy::expect_used, reason = "a test may stop")]

use armcal_calibrate::{FitConfig, HoldoutConfig, calibrate};
use armcal_config::{MeasureKind, MeasureSection};
use armcal_core::{Against, DwellId, Observation, Pose, Reference};
use armcal_model::{
    Chain, FixedPlace, Frame, Frames, Measurement, MeasurementKind, Model, Scalar, register_measurements,
};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::path::Path;

const ARM: &str = include_str!("../../../pipelines/models/right_arm.toml");
const SIGMA_M: f64 = 0.02e-3;

/// How far a point is from the z axis of its place.
static RAIL: MeasurementKind = MeasurementKind {
    name: "rail",
    preposition: "beside",
    is_against_plane: true,
    has_length: false,
    number: &BesideRail,
};

#[derive(Debug)]
struct BesideRail;

impl Measurement for BesideRail {
    fn number<D: Scalar>(&self, point_m: &Vector3<D>) -> D {
        (point_m.x * point_m.x + point_m.y * point_m.y).sqrt()
    }
}

/// Rails across the workspace: a point of each, and its direction.
fn rails() -> [(Vector3<f64>, Vector3<f64>); 3] {
    let along = |x: f64, y: f64, z: f64| Vector3::new(x, y, z).normalize();
    [
        (Vector3::new(0.3, 0.9, 0.1), along(1.0, 0.2, 0.1)),
        (Vector3::new(-0.7, 0.2, 0.4), along(0.1, 1.0, -0.3)),
        (Vector3::new(0.2, -0.6, -0.3), along(0.2, 0.1, 1.0)),
    ]
}

fn model() -> Model {
    let chain = Chain::from_dh_toml(ARM, Path::new("arm.toml")).expect("the shipped arm");
    let frames = Frames {
        base: Frame::given("base", Pose::identity()),
        tip: Frame::given("tip", Pose::identity()),
        markers: Vec::new(),
        boards: Vec::new(),
    };
    let place = |(k, (at_m, along)): (usize, (Vector3<f64>, Vector3<f64>))| {
        let turn = nalgebra::UnitQuaternion::rotation_between(&Vector3::z(), &along).expect("not opposite");
        let frame = Frame::given(format!("rail{k}"), Pose::from_parts(at_m.into(), turn));
        FixedPlace { frame, is_plane: true }
    };
    let places: Vec<FixedPlace> = rails().into_iter().enumerate().map(place).collect();
    let mut model = Model::new(chain, frames).and_then(|m| m.against(&places, &[])).expect("a model");
    model
        .set_parameter("*", |p| p.free = ["joint2.theta", "joint3.theta", "tool.d"].contains(&&*p.name))
        .expect("all");
    model
}

#[test]
fn a_measurement_registered_by_another_program_calibrates_an_arm() {
    register_measurements(&[&RAIL]).expect("nothing has asked for the kinds yet");
    assert!(register_measurements(&[&RAIL]).is_err(), "one process, one list");
    let section = |kind: &str| {
        let text = format!("kind = \"{kind}\"\nbetween = [\"tip\", \"rail0\"]\nsigma_mm = 0.02");
        toml::from_str::<MeasureSection>(&text)
    };
    assert!(section("rail").is_ok_and(|section| section.kind == MeasureKind::Number(&RAIL)));
    let refused = section("rial").expect_err("there is none").to_string();
    assert!(refused.contains("`coincide`, `distance`, `plane`, `rail`"), "{refused}");

    let (model, mut rng) = (model(), ChaCha8Rng::seed_from_u64(5));
    let mut truth = model.nominal();
    let index = |name: &str| model.index(name).expect("a parameter of the arm");
    for (name, off) in [("joint2.theta", 4e-3), ("joint3.theta", -6e-3), ("tool.d", 0.8e-3)] {
        truth[index(name)] += off;
    }
    let measured = |dwell: usize| {
        let joint_rad = [(-1.2, 1.2), (-1.3, 0.3), (-1.0, 0.9)].map(|(a, b)| rng.random_range(a..b)).to_vec();
        let tip_m = model.tip_in_base(&truth, &joint_rad).translation.vector;
        // By the cross product with the rail's direction, not by the kind's formula.
        let (at_m, along) = rails()[dwell % 3];
        let noise_m = SIGMA_M * rng.sample::<f64, _>(StandardNormal);
        let reading_m = along.cross(&(tip_m - at_m)).norm() + noise_m;
        let reference =
            Reference::Number { kind: "rail".into(), to: Against::Fixed(dwell % 3), length: None, reading_m };
        let dwell = DwellId { recording: 0, dwell };
        Observation {
            covariance_m2: Matrix3::identity() * SIGMA_M.powi(2),
            ..Observation::bare(dwell, joint_rad, reference)
        }
    };
    let observations: Vec<Observation> = (0..90).map(measured).collect();
    assert_eq!(model.measured_name(&observations[0]).as_deref(), Some("tip beside rail0"));

    let (_, jacobian) = model.residual_with_jacobian(&truth, &observations[0]);
    for name in ["joint2.theta", "tool.d"] {
        let row = |step: f64| {
            let mut p = truth.clone();
            p[index(name)] += step;
            model.residual(&p, &observations[0]).rows().sum::<f64>()
        };
        let by_difference = (row(1e-6) - row(-1e-6)) / 2e-6;
        assert!((jacobian[(0, index(name))] - by_difference).abs() < 1e-7, "{name}");
    }

    let holdout = HoldoutConfig::Random { share: 0.2, seed: 0 };
    let fitted = calibrate(&model, &observations, &FitConfig::default(), &holdout).expect("a calibration");
    for name in ["joint2.theta", "joint3.theta", "tool.d"] {
        let own = fitted.fit.estimates.iter().find(|e| e.parameter.name == name).expect("it is free");
        let off = own.value - truth[index(name)];
        assert!(off.abs() < 4.0 * own.sigma && own.sigma < 0.1e-3, "{name}: {off} of {}", own.sigma);
    }
    let judged = fitted.judged();
    assert!(
        judged.fitted.mean_m < 2.0 * SIGMA_M && judged.nominal.mean_m > 20.0 * judged.fitted.mean_m,
        "{judged:?}"
    );
}
