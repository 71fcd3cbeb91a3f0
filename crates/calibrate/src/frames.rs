//! Frames that nobody could know: closed-form start, then a fit of these alone.
//!
//! Alternates, with the arm at nominal: bases and boards by the weighted Kabsch rotation, the orientation of tip and markers by
//! the mean of what the sensor saw, their offsets by the linear least squares they enter with. Each step is robust
//! (Huber weights on the distances, scale by their median) and closed-form, so the start values may be metres and half
//! turns off. What remains is left to the solver, over these parameters alone.

use crate::model_problem::ModelProblem;
use crate::problem::Problem;
use crate::remembered::{self, Looked, Remembered};
use crate::rigid_fit::{Pair, rigid_fit, weights_of};
use crate::whitened::Whitened;
use crate::{CalibrateError, FitConfig, Objective, fit};
use armcal_core::{Against, FeatureId, Observation, Parameter, Pose, Role};
use armcal_model::{Model, ModelResidual};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Rounds of the alternation, and the change [m, rad] below which it ends: the solver, which goes on from there, closes in on the
/// minimum much faster.
const ROUNDS: usize = 200;
const SETTLED: f64 = 1e-3;

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
    fit_some(problem, problem.model().nominal(), config, &|p| touched.contains(frame_of(p)))
}

/// A problem where its frames ended, as fits of them to most of its observations will ask of it; none where no frame is free.
pub(crate) fn look(
    problem: &ModelProblem<'_>,
    values: &[f64],
    config: &FitConfig,
) -> Result<Option<Arc<Looked>>, CalibrateError> {
    let touched = touched(problem);
    let free = |p: &Parameter| is_free(p) && touched.contains(frame_of(p));
    let any = problem.parameters().iter().any(free);
    any.then(|| remembered::look(problem, values, &free, config)).transpose()
}

/// [`fit_on`] from where the frames of more observations ended, those among them: to the same minimum, only the way is shorter.
/// Of very many, first with the derivative where that was `looked` at: errors of a nominal arm are large, so that what it changes
/// on the way counts, and the last steps are exact.
pub(crate) fn fit_on_fewer(
    problem: &ModelProblem<'_>,
    of_more: &[f64],
    looked: Option<&Looked>,
    config: &FitConfig,
) -> Result<Vec<f64>, CalibrateError> {
    let touched = touched(problem);
    let free = |p: &Parameter| is_free(p) && touched.contains(frame_of(p));
    let mut start = problem.model().nominal();
    let known = problem.parameters().iter().zip(of_more).zip(&mut start).filter(|((p, _), _)| free(p));
    known.for_each(|((_, value), start)| *start = *value);
    let looked = looked.filter(|_| !config.every_step);
    let roughly = match looked.and_then(|looked| Remembered::about(problem, looked)) {
        Some(about) => Some(solved(&about, (&start, None), config, &free)?),
        None => None,
    };
    let from = match &roughly {
        Some((near, sigma_scale)) => (near, Some(*sigma_scale)),
        None => (&start, None),
    };
    Ok(solved(problem, from, config, &free)?.0)
}

fn touched(problem: &ModelProblem<'_>) -> BTreeSet<String> {
    touched_frames(problem.model(), problem.observations()).into_iter().collect()
}

/// Fits only the estimated-frame parameters `which` accepts, the others at `start`.
pub(crate) fn fit_some(
    problem: &ModelProblem<'_>,
    start: Vec<f64>,
    config: &FitConfig,
    which: &dyn Fn(&Parameter) -> bool,
) -> Result<Vec<f64>, CalibrateError> {
    let free = |p: &Parameter| is_free(p) && which(p);
    let start = aligned(problem, config, start, &free);
    if let Some(most_m) = config.give_up_above_m {
        let (mut sum_m, observations) = (0.0, problem.observations());
        let mut add = |_: &Observation, residual: ModelResidual| sum_m += residual.position_m.norm();
        problem.model().residuals(&start, observations, false, &mut add);
        let mean_m = sum_m / observations.len().max(1) as f64;
        if mean_m > most_m {
            return Err(CalibrateError::GivenUp { mean_m });
        }
    }
    Ok(solved(problem, (&start, None), config, &free)?.0)
}

fn is_free(p: &Parameter) -> bool {
    p.free && p.role == Role::EstimatedFrame
}

/// The frames `free` where the solver ends with them, the others at the start; with the scale of the residuals in units of the
/// declared noise, which the start comes with where it is known roughly.
fn solved(
    problem: &dyn Problem,
    (start, sigma_scale): (&Vec<f64>, Option<f64>),
    config: &FitConfig,
    free: &dyn Fn(&Parameter) -> bool,
) -> Result<(Vec<f64>, f64), CalibrateError> {
    config.check()?;
    if problem.blocks() == 0 || !problem.parameters().iter().any(free) {
        return Ok((start.clone(), sigma_scale.unwrap_or(1.0)));
    }
    let white = Whitened::new(Box::new(problem), start, free, config)?;
    // Frames are never the subject of eq. 4; they are fitted robustly under it.
    let objective = if config.objective == Objective::Paper { Objective::Robust } else { config.objective };
    let solved = fit::solve(&white, sigma_scale, &FitConfig { objective, ..config.clone() })?;
    Ok((white.parameters_at(&solved.at.x), solved.sigma_scale))
}

/// The alternation on all observations; what a recording has copies of then on its own ones.
fn aligned(
    problem: &ModelProblem<'_>,
    config: &FitConfig,
    start: Vec<f64>,
    which: &dyn Fn(&Parameter) -> bool,
) -> Vec<f64> {
    let chosen = |p: &Parameter| f64::from(u8::from(is_free(p) && which(p)));
    let chosen: Vec<f64> = problem.parameters().iter().map(chosen).collect();
    let key = problem.elsewhere().map(|away| (away, away.key("aligned", &[&start, &chosen])));
    if let Some(found) = key.as_ref().and_then(|(away, key)| away.found(key)) {
        return found;
    }
    let p = aligned_anew(problem, config, start, which);
    if let Some((away, key)) = key {
        away.keep(key, &p);
    }
    p
}

fn aligned_anew(
    problem: &ModelProblem<'_>,
    config: &FitConfig,
    start: Vec<f64>,
    which: &dyn Fn(&Parameter) -> bool,
) -> Vec<f64> {
    let model = problem.model();
    let mut p = Alignment::new(model, problem.observations(), config).run(start, which);
    if model.copies().is_empty() {
        return p;
    }
    for run in problem.alike(problem.observations()) {
        let Some(recording) = run.first().map(|o| o.dwell.recording) else { continue };
        let Some(known) = model.known_in(recording) else { continue };
        let (alone, local) = model.in_recording(recording, &p);
        let own = alone.parameters().iter().zip(known);
        let own =
            own.filter(|(_, global)| model.copies().contains(global) && which(&model.parameters()[**global]));
        let own: BTreeSet<&str> = own.map(|(local, _)| local.name.as_str()).collect();
        let placed =
            Alignment::new(alone, run, config).run(local.into_owned(), &|p| own.contains(p.name.as_str()));
        known.iter().zip(placed).for_each(|(&index, value)| p[index] = value);
    }
    p
}

/// Names of the frames the observations say something about: the base, the tip, the markers that were measured, and the
/// boards with seated dwells, the places measured against and the lengths that distances count from; then what the observed
/// recordings have copies of.
pub(crate) fn touched_frames(model: &Model, observations: &[&Observation]) -> Vec<String> {
    let (names, tips) = (frame_names(model), tips_at(model));
    let of = |o: &&Observation| match o.against() {
        Some(Against::Feature(to)) => [o.feature, to],
        _ => [o.feature; 2],
    };
    let measured: BTreeSet<usize> = observations.iter().flat_map(of).map(|k| tips + k.0).collect();
    let known = |k: &usize| *k < 2 * tips || measured.contains(k);
    let features = tips + model.features().count();
    let arm = names.iter().enumerate().take(features).filter(|(k, _)| known(k));
    let mut touched: Vec<String> = arm.map(|(_, name)| name.clone()).collect();
    let seated: BTreeSet<usize> =
        observations.iter().filter(|o| o.cavity().is_some()).map(|o| o.dwell.recording).collect();
    let boards = names.iter().skip(features).take(model.boards()).enumerate();
    touched.extend(boards.filter(|(recording, _)| seated.contains(recording)).map(|(_, name)| name.clone()));
    let against: BTreeSet<Against> = observations.iter().filter_map(|o| o.against()).collect();
    let is_used = |place: &usize| against.contains(&Against::Fixed(*place));
    touched.extend(model.places().filter(|(k, ..)| is_used(k)).map(|(_, name, _)| name.to_owned()));
    let counted = |length: &usize| observations.iter().any(|o| o.length() == Some(*length));
    let lengths = model.lengths().enumerate().filter(|(k, _)| counted(k));
    touched.extend(lengths.map(|(_, (name, _))| name.to_owned()));
    let observed: BTreeSet<usize> = observations.iter().map(|o| o.dwell.recording).collect();
    for index in observed.into_iter().flat_map(|recording| model.own_parameters(recording)) {
        let part = frame_of(&model.parameters()[index]);
        if model.copies().contains(&index) && touched.last().is_none_or(|last| last != part) {
            touched.push(part.to_owned());
        }
    }
    touched
}

/// Where among [`frame_names`] those of the tips begin, one an arm as the bases before them; those of the markers are behind
/// them.
fn tips_at(model: &Model) -> usize {
    model.chain().arms().len().max(1)
}

/// The names of the recordings' boards.
pub(crate) fn board_names(model: &Model) -> Vec<String> {
    frame_names(model)
        .into_iter()
        .skip(tips_at(model) + model.features().count())
        .take(model.boards())
        .collect()
}

/// Frames of the model in its documented order: bases, tips, markers, then one board a recording, and a link.
pub(crate) fn frame_names(model: &Model) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let shared = |index: &usize| !model.copies().contains(index);
    let all = (0..model.parameters().len()).filter(shared).map(|index| &model.parameters()[index]);
    for p in all.filter(|p| matches!(p.role, Role::EstimatedFrame | Role::KnownFrame)) {
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
                is_free(p) && which(p)
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
        let features: Vec<FeatureId> = self.model.features().map(|(feature, _)| feature).collect();
        let tips = tips_at(self.model);
        if self.names.len() < tips + features.len() {
            return p;
        }
        let (of_bases, names) = self.names.split_at(tips);
        let (of_features, boards) = names.split_at(features.len());
        let boards = &boards[..self.model.boards().min(boards.len())];
        let base = |(arm, name): (usize, &String)| place(name, &self.model.arm_base_in_world(&nominal, arm));
        let bases: Vec<Place> = of_bases.iter().enumerate().map(base).collect();
        let on_arm = features.iter().zip(of_features);
        let on_arm: Vec<(FeatureId, Place)> = on_arm
            .map(|(feature, name)| (*feature, place(name, &self.model.feature_in_link(&nominal, *feature))))
            .filter(|(_, place)| place.position.is_some() || place.rotation.is_some())
            .collect();
        let boards: Vec<(usize, Place)> = boards
            .iter()
            .enumerate()
            .filter_map(|(r, name)| Some((r, place(name, &self.model.board_in_world(&nominal, r)?))))
            .filter(|(_, place)| place.position.is_some())
            .collect();
        let points: Vec<(usize, Place)> = self
            .model
            .places()
            .map(|(k, name, _)| (k, place(name, &self.model.place_in_world(&nominal, k))))
            .filter(|(_, place)| place.position.is_some())
            .collect();
        let nowhere = on_arm.iter().all(|(_, place)| place.position.is_none()) && points.is_empty();
        if bases.iter().all(|base| base.position.is_none()) && nowhere && boards.is_empty() {
            return p;
        }
        let links = self.links_in_base(&p);
        let mut seated: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (at, o) in self.observations.iter().enumerate().filter(|(_, o)| o.cavity().is_some()) {
            seated.entry(o.dwell.recording).or_default().push(at);
        }
        for _ in 0..ROUNDS {
            let before = p.clone();
            for (arm, base) in bases.iter().enumerate() {
                self.place_base(&mut p, arm, base, &boards, &links);
            }
            for (recording, board) in &boards {
                let own = seated.get(recording).map_or(&[][..], Vec::as_slice);
                self.place_board(&mut p, *recording, board, own, &links);
            }
            for (point, place) in &points {
                self.place_point(&mut p, *point, place, &links);
            }
            for (feature, place) in &on_arm {
                self.place_feature(&mut p, *feature, place, &links);
            }
            if p.iter().zip(&before).all(|(a, b)| (a - b).abs() < SETTLED) {
                break;
            }
        }
        p
    }

    /// base_from_link of what carries the feature of every observation: the part of the arm that stays at nominal.
    fn links_in_base(&self, p: &[f64]) -> Vec<Pose> {
        let to_link: Vec<Pose> = self.in_links(p).iter().map(Pose::inverse).collect();
        let in_base = |o: &Observation| self.model.feature_in_base(p, o.feature, &o.joint_rad);
        let link = |o: &&Observation| in_base(o) * to_link[o.feature.0];
        self.observations.iter().map(link).collect()
    }

    /// world_from_base of an arm from points known in the world: where a sensor or a given board has them, or the arm that its
    /// tip is joined to. The direction of a link between them is unknown, so that its length is ignored: the start is off by as
    /// much, which the fit makes up for.
    fn place_base(&self, p: &mut [f64], arm: usize, base: &Place, boards: &[(usize, Place)], links: &[Pose]) {
        if base.position.is_none() {
            return;
        }
        let in_link = self.in_links(p);
        let placed: BTreeSet<usize> = boards.iter().map(|(recording, _)| *recording).collect();
        // Points that one base carries say nothing of where it is.
        let is_own = |o: &Observation| match o.against() {
            Some(Against::Feature(to)) => self.model.arm_of(to) != self.model.arm_of(o.feature),
            _ => self.model.arm_of(o.feature) == arm,
        };
        let anchored = |o: &Observation| o.cavity().is_none() || !placed.contains(&o.dwell.recording);
        let in_world = |o: &Observation| self.model.feature_in_world(p, o.feature, o).translation.vector;
        let pair = |(o, link): (&&Observation, &Pose)| match o.against() {
            // The other arm's tip is that of this one.
            Some(Against::Feature(to)) if to == FeatureId(arm) => {
                let from = self.model.feature_in_base(p, to, &o.joint_rad).translation.vector;
                Pair { from, to: in_world(o) }
            }
            _ => Pair {
                from: (link * in_link[o.feature.0]).translation.vector,
                to: self.model.measured_tip_in_world(p, o),
            },
        };
        let own = self.observations.iter().zip(links).filter(|(o, _)| is_own(o) && anchored(o));
        let pairs: Vec<Pair> = own.map(pair).collect();
        let current = self.model.arm_base_in_world(p, arm);
        base.put(p, &rigid_fit(&pairs, &current, base.rotation.is_some()));
    }

    /// world_from_board of one recording from where the arm was while seated in it.
    fn place_board(&self, p: &mut [f64], recording: usize, board: &Place, seated: &[usize], links: &[Pose]) {
        let Some(current) = self.model.board_in_world(p, recording) else {
            return;
        };
        let in_link = self.in_links(p);
        let mut pairs = Vec::new();
        for &at in seated {
            let o = self.observations[at];
            if let Some(in_board_m) = o.in_board_m() {
                pairs.push(Pair { from: *in_board_m, to: self.reached_m(p, o, &links[at], &in_link) });
            }
        }
        board.put(p, &rigid_fit(&pairs, &current, board.rotation.is_some()));
    }

    /// Where the arm has the feature of an observation, in the world [m].
    fn reached_m(&self, p: &[f64], o: &Observation, link: &Pose, in_link: &[Pose]) -> Vector3<f64> {
        let base = self.model.arm_base_in_world(p, self.model.arm_of(o.feature));
        (base * link * in_link[o.feature.0]).translation.vector
    }

    /// A fixed point from where the arm was while it was in it. Distances and planes are left to the solver.
    fn place_point(&self, p: &mut [f64], point: usize, place: &Place, links: &[Pose]) {
        let in_link = self.in_links(p);
        let mut current = self.model.place_in_world(p, point);
        let at = current.translation.vector;
        let own = self.observations.iter().zip(links);
        let own = own.filter(|(o, _)| o.against() == Some(Against::Fixed(point)) && !o.is_scalar());
        let errors: Vec<Vector3<f64>> =
            own.map(|(o, link)| self.reached_m(p, o, link, &in_link) - at).collect();
        let weights = weights_of(&errors);
        let total: f64 = weights.iter().sum();
        if total > 0.0 {
            let sum: Vector3<f64> = errors.iter().zip(&weights).map(|(e, w)| e * *w).sum();
            current.translation.vector += sum / total;
            place.put(p, &current);
        }
    }

    /// Every feature in the link that carries it.
    fn in_links(&self, p: &[f64]) -> Vec<Pose> {
        self.model.features().map(|(feature, _)| self.model.feature_in_link(p, feature)).collect()
    }

    /// link_from_feature: the offset t of `y = A (L t)` by weighted linear least squares (A world_from_base, L
    /// base_from_link), the orientation by the mean of `(A L)^-1 R_measured`.
    fn place_feature(&self, p: &mut [f64], feature: FeatureId, place: &Place, links: &[Pose]) {
        let base = self.model.arm_base_in_world(p, self.model.arm_of(feature));
        let mut pose = self.model.feature_in_link(p, feature);
        // Joined tips say where both are against each other, not where one is.
        let of_feature = |o: &Observation| o.feature == feature && !o.is_joined();
        let own = self.observations.iter().zip(links).filter(|(o, _)| of_feature(o));
        let (own, frames): (Vec<&Observation>, Vec<Pose>) = own.map(|(o, link)| (*o, base * link)).unzip();
        let error = |(o, frame): (&&Observation, &Pose)| {
            self.model.measured_tip_in_world(p, o) - (frame * pose).translation.vector
        };
        let errors: Vec<Vector3<f64>> = own.iter().zip(&frames).map(error).collect();
        if place.position.is_some() {
            // Rotations leave the normal matrix a multiple of the identity: the solution is the weighted mean.
            let weights = weights_of(&errors);
            let sum: Vector3<f64> =
                (0..errors.len()).map(|j| frames[j].rotation.inverse() * errors[j] * weights[j]).sum();
            let total: f64 = weights.iter().sum();
            if total > 0.0 {
                pose.translation.vector += sum / total;
            }
        }
        if place.rotation.is_some() && self.use_orientation {
            pose.rotation = mean_orientation(&own, &frames, &pose.rotation);
        }
        place.put(p, &pose);
    }
}

/// Chordal mean of a feature's orientation in its link.
fn mean_orientation(
    observations: &[&Observation],
    frames: &[Pose],
    current: &UnitQuaternion<f64>,
) -> UnitQuaternion<f64> {
    let mut sum = Matrix3::zeros();
    for (o, frame) in observations.iter().zip(frames) {
        if let Some((measured, _)) = o.seen_orientation() {
            sum += (frame.rotation.inverse() * measured).to_rotation_matrix().into_inner();
        }
    }
    if sum == Matrix3::zeros() {
        return *current;
    }
    crate::rigid_fit::nearest_rotation(&sum, current)
}
