//! Several markers a pose: their rows share the encoders' noise, and one that came loose is told from all else.

use super::quick;
use crate::robot::knowledge::Knowledge;
use crate::robot::view::View;
use crate::{Calibrated, Candidate, Diagnosis, EntersAt, Problem, Verdict, diagnose};
use armcal_calibrate::{FitConfig, HoldoutConfig, calibrate};
use armcal_core::{DwellId, FeatureId, Observation, Pose, Reference};
use armcal_model::{Chain, Frame, Frames, Marker, Model, Session};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

const ARM: &str = include_str!("../../../../pipelines/models/right_arm.toml");
const SIGMA_M: f64 = 0.1e-3;
/// At the tip twice the sensor's own noise.
const ENCODER_RAD: f64 = 0.4e-3;

/// The paper's arm with two markers beside its tip, one on the tool, one on the upper arm.
fn model() -> Model {
    let chain = Chain::from_dh_toml(ARM, Path::new("arm.toml")).unwrap();
    let marker = |name: &str, link: &str, at: [f64; 3]| Marker {
        link: link.into(),
        frame: Frame {
            free_rotation: false,
            ..Frame::estimated(name, Pose::translation(at[0], at[1], at[2]))
        },
    };
    let markers =
        vec![marker("elbow", "joint2", [0.02, -0.05, 0.03]), marker("hand", "tool", [-0.04, 0.03, -0.05])];
    let tip = Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) };
    Model::new(chain, Frames { tip, markers, ..Frames::of_bare_arm() }).unwrap()
}

struct Rig {
    model: Model,
    observations: Vec<Observation>,
    session: Session,
    fit: FitConfig,
}

/// What the sensor saw of an arm as designed in `n` poses; from dwell `loose` on the marker on the tool is 1.5 mm off.
fn rig(seed: u64, n: usize, loose: Option<usize>) -> Rig {
    let model = model();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = |sigma: f64| Vector3::from_fn(|_, _| sigma * rng.sample::<f64, _>(StandardNormal));
    let mut observations = Vec::new();
    for dwell in 0..n {
        let turn = |k: f64| (dwell as f64 * k).sin();
        let q = vec![1.2 * turn(1.7), -0.5 + 0.8 * turn(2.9), 0.95 * turn(0.83)];
        let off = noise(ENCODER_RAD);
        for (feature, name) in model.features() {
            let id = DwellId { recording: 0, dwell };
            let stands = Observation {
                feature,
                time_ns: dwell as i64 * 5_000_000_000,
                joint_sigma_rad: vec![ENCODER_RAD; 3],
                covariance_m2: Matrix3::identity() * SIGMA_M.powi(2),
                ..Observation::bare(id, q.clone(), Reference::position(Vector3::zeros()))
            };
            let mut truth = model.nominal();
            if name == "hand" && loose.is_some_and(|from| dwell >= from) {
                truth[model.index("hand.y").unwrap()] += 1.5e-3;
            }
            let position_m = model.predicted_tip_in_world(&truth, &stands) + noise(SIGMA_M);
            observations.push(Observation {
                joint_rad: q.iter().zip(off.iter()).map(|(q, off)| q + off).collect(),
                reference: Reference::position(position_m),
                ..stands
            });
        }
    }
    let session = Session::of(&observations);
    Rig { model, observations, session, fit: FitConfig::default() }
}

impl Rig {
    /// As the diagnosis sees it at the truth.
    fn problem(&self) -> Problem {
        self.problem_at(self.model.nominal(), &RefCell::default())
    }

    /// At other parameters, with what is known from other fits.
    fn problem_at(&self, values: Vec<f64>, products: &RefCell<BTreeMap<String, Candidate>>) -> Problem {
        let sizes = BTreeMap::new();
        let knowledge = Knowledge::of(&quick(), self.model.chain().joint_names()).unwrap();
        let Rig { model, observations, session, fit } = self;
        View {
            model,
            values: &values,
            observations,
            session,
            fit,
            sizes: &sizes,
            knowledge: &knowledge,
            places: &crate::problem::places::places_of_poses(observations),
            products,
        }
        .problem()
        .unwrap()
    }

    fn diagnosed(&self) -> Diagnosis {
        let holdout = HoldoutConfig::CavityFolds { k: 5 };
        let Rig { model, observations, session, fit } = self;
        let calibration = calibrate(model, observations, fit, &holdout).unwrap();
        let calibrated =
            Calibrated { model, calibration: &calibration, observations, session, fit, holdout: &holdout };
        diagnose(&calibrated, &quick()).unwrap()
    }
}

#[test]
fn what_was_seen_of_a_pose_is_independent_once_it_is_whitened() {
    let rig = rig(1, 400, None);
    let problem = rig.problem();
    problem.check().unwrap();
    assert_eq!((problem.dwells.len(), problem.rows()), (400, 9 * 400));
    let mut covariance = DMatrix::<f64>::zeros(9, 9);
    for d in &problem.dwells {
        let own = problem.residual.rows(d.first_row, d.rows);
        covariance += own * own.transpose() / 400.0;
    }
    // A mean of 400 products of standard normal numbers scatters by 0.05, one of squares by 0.07.
    let off = (&covariance - DMatrix::identity(9, 9)).amax();
    assert!(off < 0.25, "{off} {covariance}");
    // The encoders' noise of one pose is in all of its rows, and taken apart it would be seen.
    let o = &rig.observations[0];
    let lever = rig.model.joint_jacobian(&rig.model.nominal(), o).norm() * ENCODER_RAD;
    assert!(lever > SIGMA_M, "{lever}");
}

/// What turns one joint is known from one fit to the next: its columns around another fit are those of a problem that knows
/// nothing.
#[test]
fn products_with_a_joint_hold_around_another_fit() {
    let rig = rig(4, 30, None);
    let known = RefCell::default();
    rig.problem_at(rig.model.nominal(), &known);
    assert!(known.borrow().len() > 20, "{}", known.borrow().len());
    let mut values = rig.model.nominal();
    values.iter_mut().zip(rig.model.parameters()).filter(|(_, p)| p.free).for_each(|(v, _)| *v += 3e-3);
    let found = rig.problem_at(values.clone(), &known);
    let anew = rig.problem_at(values, &RefCell::default());
    let all = |p: &Problem| -> Vec<Candidate> {
        p.candidates.iter().chain(p.scans.iter().flat_map(|s| &s.points)).cloned().collect()
    };
    assert_eq!(all(&found).len(), all(&anew).len());
    for (a, b) in all(&found).iter().zip(&all(&anew)) {
        let [own, other] = [a, b].map(|c| c.columns.dense(&anew.dwells, 1.0));
        assert_eq!((&a.spec, &a.amplitudes, a.toggle), (&b.spec, &b.amplitudes, b.toggle));
        assert!((&own - &other).amax() <= 1e-9 * (1.0 + other.amax()), "{}", a.spec);
    }
}

#[test]
fn rows_are_told_in_metres_by_what_they_measure() {
    let mut rig = rig(2, 12, None);
    // One marker was hidden once: the other rows of that pose stay.
    rig.observations.retain(|o| !(o.dwell.dwell == 5 && o.feature == FeatureId(1)));
    let problem = rig.problem();
    let p = rig.model.nominal();
    let mut told = problem.dwells.iter().flat_map(|d| d.errors_m(&problem.residual));
    for o in &rig.observations {
        let error_m = rig.model.residual(&p, o).position_m.norm();
        let found = told.next().unwrap();
        assert!((found - error_m).abs() < 1e-12, "{found} {error_m}");
    }
    assert!(told.next().is_none());
    assert_eq!(problem.dwells[5].rows, 6);
    assert_eq!(problem.dwells[5].rows_as_in(&problem.dwells[6]), 3, "tip and hand against tip and elbow");
}

#[test]
fn a_joint_that_is_off_moves_all_rows_of_its_pose() {
    let rig = rig(3, 12, None);
    let (step, p) = (1e-6, rig.model.nominal());
    let problem = rig.problem();
    let channel = problem.channels.iter().find(|c| c.enters == EntersAt::Joint(1)).unwrap();
    for (d, own) in problem.dwells.iter().zip(rig.observations.chunks(3)) {
        let stacked = |by: f64| {
            let rows = own.iter().flat_map(|o| {
                let mut o = o.clone();
                o.joint_rad[1] += by;
                let error_m: [f64; 3] = rig.model.residual(&p, &o).position_m.into();
                error_m
            });
            DVector::from_iterator(9, rows)
        };
        let fall = (stacked(-step) - stacked(step)) / (2.0 * step);
        let mut raw = DMatrix::zeros(9, 9);
        for (k, part) in d.parts.iter().enumerate() {
            raw.rows_mut(3 * k, 3).copy_from(&part.metres);
        }
        let found = raw * channel.columns.rows(d.first_row, d.rows).column(0);
        assert!((&found - &fall).amax() < 1e-6, "{found} {fall}");
    }
}

#[test]
fn a_marker_that_came_loose_is_named_first_and_nothing_else_is_named() {
    for seed in 11..14 {
        let found = rig(seed, 48, Some(25)).diagnosed();
        assert_eq!(found.effects.len(), 1, "{seed}: {:?}", found.names);
        assert!(found.names.iter().all(|n| n.starts_with("marker_shift:hand@0.2")), "{:?}", found.names);
        // Other moments of it are no other name, but each has its own share.
        let standings = found.candidates.iter().filter_map(|c| Some((&c.spec, c.standing?.probability)));
        let hand = standings.filter(|(spec, _)| spec.starts_with("marker_shift:hand@")).collect::<Vec<_>>();
        let share: f64 = hand.iter().map(|(_, p)| p).sum();
        assert!(!found.names[0].contains('-') && share > 0.99, "{seed}: {:?} {hand:?}", found.names);
        assert!(hand.iter().all(|(_, p)| *p <= found.effects[0].probability), "{seed}: {hand:?}");
        let clean = rig(seed, 48, None).diagnosed();
        assert_eq!(clean.verdict, Verdict::NothingMissing, "{seed}: {:?}", clean.names);
    }
}

#[test]
fn a_marker_that_came_loose_and_stayed_so_did_not_go_back() {
    for seed in 11..14 {
        let found = rig(seed, 48, Some(25)).diagnosed();
        assert_eq!((found.verdict, found.names.len()), (Verdict::Identified, 1), "{seed}: {:?}", found.names);
    }
}
