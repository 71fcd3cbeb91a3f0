//! Frames that nobody could know: closed-form start, then a fit of these alone.
//!
//! Alternates, with the arm at nominal: base and boards by the weighted Kabsch rotation, the tip's orientation by the
//! mean of what the sensor saw, the tip's offset by the linear least squares it enters with. Each step is robust
//! (Huber weights on the distances, scale by their median) and closed-form, so the start values may be metres and half
//! turns off. What remains is left to the solver, over these parameters alone.

use crate::model_problem::ModelProblem;
use crate::problem::Problem as _;
use crate::rigid_fit::{Pair, rigid_fit, weights_of};
use crate::whitened::Whitened;
use crate::{CalibrateError, FitConfig, Objective, Scene, fit};
use armcal_core::{Observation, Parameter, Pose, Reference, Role};
use armcal_model::Model;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Rounds of the alternation, and the change [m, rad] below which it ends.
const ROUNDS: usize = 200;
const SETTLED: f64 = 1e-6;

/// Closed-form start: nominal, with the estimated frames placed onto the observations.
///
/// A frame without observations, or all boards together with the base when nothing ties them to the world, stays at
/// nominal. Deterministic.
pub fn align_frames(
    model: &Model,
    observations: &[Observation],
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    Ok(aligned(&problem, config, model.nominal(), &|_| true))
}

/// The parameter vector with only [`Role::EstimatedFrame`] parameters fitted: what the arm would do with nominal
/// geometry if every frame were known.
pub fn fit_frames(
    model: &Model,
    observations: &[Observation],
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    fit_on(&ModelProblem::new(model, observations, config)?, config)
}

/// The same from given values of all parameters, for those frames `which` accepts; the arm stays as `start` has it.
pub fn fit_frames_from(
    model: &Model,
    observations: &[Observation],
    start: Vec<f64>,
    config: &FitConfig,
    which: &dyn Fn(&Parameter) -> bool,
) -> Result<Vec<f64>, CalibrateError> {
    let problem = ModelProblem::new(model, observations, config)?;
    let touched = touched(&problem);
    fit_some(&problem, start, config, &|p| which(p) && touched.contains(frame_of(p)))
}

/// [`fit_frames`] on observations already checked.
pub(crate) fn fit_on(problem: &ModelProblem<'_>, config: &FitConfig) -> Result<Vec<f64>, CalibrateError> {
    let touched = touched(problem);
    fit_some(problem, problem.scene().nominal(), config, &|p| touched.contains(frame_of(p)))
}

fn touched(problem: &ModelProblem<'_>) -> BTreeSet<String> {
    touched_frames(problem.scene(), problem.observations()).into_iter().collect()
}

/// Fits only the estimated-frame parameters `which` accepts, the others at `start`.
pub(crate) fn fit_some(
    problem: &ModelProblem<'_>,
    start: Vec<f64>,
    config: &FitConfig,
    which: &dyn Fn(&Parameter) -> bool,
) -> Result<Vec<f64>, CalibrateError> {
    config.check()?;
    let free = |p: &Parameter| p.free && p.role == Role::EstimatedFrame && which(p);
    if problem.blocks() == 0 || !problem.parameters().iter().any(free) {
        return Ok(start);
    }
    let start = aligned(problem, config, start, &free);
    let white = Whitened::new(Box::new(problem), &start, &free, config)?;
    // Frames are never the subject of eq. 4; they are fitted robustly under it.
    let objective = if config.objective == Objective::Paper { Objective::Robust } else { config.objective };
    let solved = fit::solve(&white, None, &FitConfig { objective, ..config.clone() })?;
    Ok(white.parameters_at(&solved.at.x))
}

/// The alternation on all observations; what a recording of a pool has for itself then on its own ones.
fn aligned(
    problem: &ModelProblem<'_>,
    config: &FitConfig,
    start: Vec<f64>,
    which: &dyn Fn(&Parameter) -> bool,
) -> Vec<f64> {
    let scene = problem.scene();
    let all = Alignment::new(scene.model(), problem.observations(), config);
    let Scene::Pooled(pool) = scene else { return all.run(start, which) };
    let mut p = start;
    let of_model = all.run(p[..scene.model().parameters().len()].to_vec(), which);
    p[..of_model.len()].copy_from_slice(&of_model);
    for run in scene.alike(problem.observations()) {
        let Some(view) = run.first().and_then(|o| pool.views().get(o.dwell.recording)) else { continue };
        let own = view.model.parameters().iter().zip(&view.index);
        let own = own.filter(|(_, global)| pool.is_copy(**global) && which(&pool.parameters()[**global]));
        let own: BTreeSet<&str> = own.map(|(local, _)| local.name.as_str()).collect();
        let local: Vec<f64> = view.index.iter().map(|&index| p[index]).collect();
        let placed = Alignment::new(&view.model, run, config).run(local, &|p| own.contains(p.name.as_str()));
        view.index.iter().zip(placed).for_each(|(&index, value)| p[index] = value);
    }
    p
}

/// Names of the frames the observations say something about: the base, the tip, and the boards with seated dwells;
/// then what else the observed recordings of a pool have for themselves.
pub(crate) fn touched_frames(scene: Scene<'_>, observations: &[&Observation]) -> Vec<String> {
    let names = frame_names(scene.model());
    let mut touched: Vec<String> = names.iter().take(2).cloned().collect();
    let seated: BTreeSet<usize> =
        observations.iter().filter(|o| o.cavity().is_some()).map(|o| o.dwell.recording).collect();
    let boards = names.iter().skip(2).enumerate();
    touched.extend(boards.filter(|(recording, _)| seated.contains(recording)).map(|(_, name)| name.clone()));
    touched.extend(scene.own_parts(observations));
    touched
}

/// Frames of the model in its documented order: base, tip, then one board a recording.
pub(crate) fn frame_names(model: &Model) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for p in model.parameters().iter().filter(|p| matches!(p.role, Role::EstimatedFrame | Role::KnownFrame)) {
        let name = frame_of(p);
        if names.last().is_none_or(|last| last != name) {
            names.push(name.to_string());
        }
    }
    names
}

/// The part of the rig a parameter belongs to, such as the frame it places.
pub(crate) fn frame_of(parameter: &Parameter) -> &str {
    parameter.name.rsplit_once('.').map_or(parameter.name.as_str(), |(frame, _)| frame)
}

/// Indices of a frame's parameters that may be placed.
struct Place {
    position: Option<[usize; 3]>,
    rotation: Option<[usize; 3]>,
    /// Rotation where its rotation vector is zero.
    nominal: UnitQuaternion<f64>,
}

impl Place {
    fn new(model: &Model, frame: &str, nominal: &Pose, which: &dyn Fn(&Parameter) -> bool) -> Place {
        let index = |quantity: &str| {
            model.index(&format!("{frame}.{quantity}")).filter(|&i| {
                let p = &model.parameters()[i];
                p.free && p.role == Role::EstimatedFrame && which(p)
            })
        };
        let three = |a, b, c| Some([index(a)?, index(b)?, index(c)?]);
        Place { position: three("x", "y", "z"), rotation: three("rx", "ry", "rz"), nominal: nominal.rotation }
    }

    fn put(&self, p: &mut [f64], pose: &Pose) {
        if let Some(index) = self.position {
            (0..3).for_each(|k| p[index[k]] = pose.translation.vector[k]);
        }
        if let Some(index) = self.rotation {
            let turn = (self.nominal.inverse() * pose.rotation).scaled_axis();
            (0..3).for_each(|k| p[index[k]] = turn[k]);
        }
    }
}

/// The alternation over one set of observations.
struct Alignment<'a> {
    model: &'a Model,
    observations: &'a [&'a Observation],
    use_orientation: bool,
    names: Vec<String>,
}

impl<'a> Alignment<'a> {
    fn new(model: &'a Model, observations: &'a [&'a Observation], config: &FitConfig) -> Alignment<'a> {
        Alignment { model, observations, use_orientation: config.use_orientation, names: frame_names(model) }
    }

    fn run(&self, mut p: Vec<f64>, which: &dyn Fn(&Parameter) -> bool) -> Vec<f64> {
        let nominal = self.model.nominal();
        let place = |name: &str, pose: &Pose| Place::new(self.model, name, pose, which);
        let [base_name, tip_name, boards @ ..] = self.names.as_slice() else {
            return p;
        };
        let base = place(base_name, &self.model.base_in_world(&nominal));
        let tip = place(tip_name, &self.model.tip_in_last_link(&nominal));
        let boards: Vec<(usize, Place)> = boards
            .iter()
            .enumerate()
            .filter_map(|(r, name)| Some((r, place(name, &self.model.board_in_world(&nominal, r)?))))
            .filter(|(_, place)| place.position.is_some())
            .collect();
        if base.position.is_none() && tip.position.is_none() && boards.is_empty() {
            return p;
        }
        let links = self.last_links_in_base(&p);
        let mut seated: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (at, o) in self.observations.iter().enumerate().filter(|(_, o)| o.cavity().is_some()) {
            seated.entry(o.dwell.recording).or_default().push(at);
        }
        for _ in 0..ROUNDS {
            let before = p.clone();
            self.place_base(&mut p, &base, &boards, &links);
            for (recording, board) in &boards {
                let own = seated.get(recording).map_or(&[][..], Vec::as_slice);
                self.place_board(&mut p, *recording, board, own, &links);
            }
            self.place_tip(&mut p, &tip, &links);
            if p.iter().zip(&before).all(|(a, b)| (a - b).abs() < SETTLED) {
                break;
            }
        }
        p
    }

    /// base_from_last_link of every observation: the part of the arm that stays at nominal.
    fn last_links_in_base(&self, p: &[f64]) -> Vec<Pose> {
        let link_from_tip = self.model.tip_in_last_link(p);
        let link = |o: &&Observation| self.model.tip_in_base(p, &o.joint_rad) * link_from_tip.inverse();
        self.observations.iter().map(link).collect()
    }

    /// world_from_base from points known in the world.
    fn place_base(&self, p: &mut [f64], base: &Place, boards: &[(usize, Place)], links: &[Pose]) {
        if base.position.is_none() {
            return;
        }
        let tip = self.model.tip_in_last_link(p);
        let placed: BTreeSet<usize> = boards.iter().map(|(recording, _)| *recording).collect();
        let anchored = |o: &Observation| o.cavity().is_none() || !placed.contains(&o.dwell.recording);
        let pairs: Vec<Pair> = self
            .observations
            .iter()
            .zip(links)
            .filter(|(o, _)| anchored(o))
            .map(|(o, link)| Pair {
                from: (link * tip).translation.vector,
                to: self.model.measured_tip_in_world(p, o),
            })
            .collect();
        let current = self.model.base_in_world(p);
        base.put(p, &rigid_fit(&pairs, &current, base.rotation.is_some()));
    }

    /// world_from_board of one recording from where the arm was while seated in it.
    fn place_board(&self, p: &mut [f64], recording: usize, board: &Place, seated: &[usize], links: &[Pose]) {
        let Some(current) = self.model.board_in_world(p, recording) else {
            return;
        };
        let (base, tip) = (self.model.base_in_world(p), self.model.tip_in_last_link(p));
        let mut pairs = Vec::new();
        for &at in seated {
            if let Reference::Seated { in_board_m, .. } = &self.observations[at].reference {
                pairs.push(Pair { from: *in_board_m, to: (base * links[at] * tip).translation.vector });
            }
        }
        board.put(p, &rigid_fit(&pairs, &current, board.rotation.is_some()));
    }

    /// last link_from_tip: the offset t of `y = A (L t)` by weighted linear least squares (A world_from_base, L
    /// base_from_last_link), the orientation by the mean of `(A L)^-1 R_measured`.
    fn place_tip(&self, p: &mut [f64], tip: &Place, links: &[Pose]) {
        if tip.position.is_none() && tip.rotation.is_none() {
            return;
        }
        let base = self.model.base_in_world(p);
        let mut pose = self.model.tip_in_last_link(p);
        let frames: Vec<Pose> = links.iter().map(|link| base * link).collect();
        let errors: Vec<Vector3<f64>> = self
            .observations
            .iter()
            .zip(&frames)
            .map(|(o, frame)| self.model.measured_tip_in_world(p, o) - (frame * pose).translation.vector)
            .collect();
        if tip.position.is_some() {
            // Rotations leave the normal matrix a multiple of the identity: the solution is the weighted mean.
            let weights = weights_of(&errors);
            let sum: Vector3<f64> =
                (0..errors.len()).map(|j| frames[j].rotation.inverse() * errors[j] * weights[j]).sum();
            let total: f64 = weights.iter().sum();
            if total > 0.0 {
                pose.translation.vector += sum / total;
            }
        }
        if tip.rotation.is_some() && self.use_orientation {
            pose.rotation = self.mean_orientation(&frames, &pose.rotation);
        }
        tip.put(p, &pose);
    }

    /// Chordal mean of the tip's orientation in the last link.
    fn mean_orientation(&self, frames: &[Pose], current: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let mut sum = Matrix3::zeros();
        for (o, frame) in self.observations.iter().zip(frames) {
            if let Reference::Tracked { orientation: Some(measured), .. } = &o.reference {
                sum += (frame.rotation.inverse() * measured).to_rotation_matrix().into_inner();
            }
        }
        if sum == Matrix3::zeros() {
            return *current;
        }
        crate::rigid_fit::nearest_rotation(&sum, current)
    }
}
