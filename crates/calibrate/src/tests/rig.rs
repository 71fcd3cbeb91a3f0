//! The paper's arm with planted deviations, seen by a sensor or seated on a board.

use crate::{Estimate, Fit};
use armcal_core::{DwellId, Observation, Pose, Reference};
use armcal_model::{Chain, Frame, Frames, Knowledge, Model};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::path::Path;

pub const SIGMA_M: f64 = 0.28e-3;

const PAPER_ARM: &str = include_str!("../../../../pipelines/models/right_arm.toml");

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn model(base: Frame, boards: Vec<Frame>) -> Model {
    let chain = Chain::from_dh_toml(PAPER_ARM, Path::new("paper.toml")).unwrap();
    let tip = Frame { free_rotation: false, ..Frame::given("tip", Pose::identity()) };
    Model::new(chain, Frames { base, tip, markers: Vec::new(), boards }).unwrap()
}

/// Base known, no board: tracked observations only.
pub fn tracked_model() -> Model {
    model(Frame::given("base", Pose::identity()), Vec::new())
}

/// Base measured by the camera, three boards estimated.
pub fn board_model() -> Model {
    let board = |name: &str| Frame::estimated(format!("board.{name}"), Pose::translation(0.4, 0.0, 0.1));
    let base = Frame { knowledge: Knowledge::Given, ..Frame::given("base", Pose::identity()) };
    model(base, vec![board("normal"), board("roll"), board("pitch")])
}

/// A truth: robot parameters uniform within `share` of their bounds, everything else at nominal.
pub fn planted(model: &Model, rng: &mut ChaCha8Rng, share: f64) -> Vec<f64> {
    model
        .parameters()
        .iter()
        .map(|p| {
            let half = 0.5 * (p.upper - p.lower);
            if p.free && half.is_finite() {
                p.nominal + share * half * rng.random_range(-1.0..1.0)
            } else {
                p.nominal
            }
        })
        .collect()
}

/// Joint readings of `n` poses spread over the workspace [rad].
pub fn poses(n: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    (0..n)
        .map(|_| {
            [(-1.2, 1.2), (-1.3, 0.3), (-1.0, 0.9)].map(|(from, to)| rng.random_range(from..to)).to_vec()
        })
        .collect()
}

/// How many 95 % intervals hold the planted truth.
#[derive(Default)]
pub struct Coverage {
    inside: usize,
    total: usize,
    left_out: usize,
}

impl Coverage {
    /// Counts the free parameters of a fit that `counts` accepts.
    pub fn count(&mut self, fit: &Fit, truth: &[f64], counts: impl Fn(&Estimate) -> bool) {
        for (e, truth) in fit.estimates.iter().zip(truth).filter(|(e, _)| e.parameter.free) {
            if !counts(e) {
                self.left_out += 1;
                continue;
            }
            self.total += 1;
            self.inside += usize::from(e.ci95[0] <= *truth && *truth <= e.ci95[1]);
        }
    }

    /// The share of those counted.
    pub fn share(&self) -> f64 {
        let share = self.inside as f64 / self.total as f64;
        println!("coverage {share:.4} of {} intervals; {} left out", self.total, self.left_out);
        share
    }
}

pub fn gauss3(rng: &mut ChaCha8Rng, sigma: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| sigma * rng.sample::<f64, _>(StandardNormal))
}

pub fn observation(dwell: DwellId, joint_rad: Vec<f64>, reference: Reference) -> Observation {
    Observation {
        time_ns: dwell.dwell as i64 * 1_000_000_000,
        covariance_m2: Matrix3::identity() * SIGMA_M.powi(2),
        ..Observation::bare(dwell, joint_rad, reference)
    }
}

/// Tracked positions of a planted arm with Gaussian noise.
pub fn tracked(model: &Model, truth: &[f64], n: usize, rng: &mut ChaCha8Rng) -> Vec<Observation> {
    poses(n, rng)
        .into_iter()
        .enumerate()
        .map(|(dwell, q)| {
            let reference = Reference::Tracked {
                position_m: Vector3::zeros(),
                orientation: None,
                orientation_sigma_rad: 0.0,
            };
            let mut o = observation(DwellId { recording: 0, dwell }, q, reference);
            let position_m = model.predicted_tip_in_world(truth, &o) + gauss3(rng, SIGMA_M);
            o.reference = Reference::Tracked { position_m, orientation: None, orientation_sigma_rad: 0.0 };
            o
        })
        .collect()
}

/// Seated dwells: `n` a recording, cavity `c<dwell>`, whose place on the board is where the planted arm reaches it.
pub fn seated(
    model: &Model,
    truth: &[f64],
    world_from_board: &[Pose],
    n: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<Observation> {
    let mut all = Vec::new();
    for (recording, pose) in world_from_board.iter().enumerate() {
        for (dwell, q) in poses(n, rng).into_iter().enumerate() {
            let reference = Reference::Seated { cavity: format!("c{dwell}"), in_board_m: Vector3::zeros() };
            let mut o = observation(DwellId { recording, dwell }, q, reference);
            let tip = model.predicted_tip_in_world(truth, &o) + gauss3(rng, SIGMA_M);
            let in_board_m = pose.inverse() * nalgebra::Point3::from(tip);
            o.reference = Reference::Seated { cavity: format!("c{dwell}"), in_board_m: in_board_m.coords };
            all.push(o);
        }
    }
    all
}
