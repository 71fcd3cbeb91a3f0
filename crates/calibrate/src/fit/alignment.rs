//! The closed-form start of frames that nobody could know.
//!
//! Alternates, with the arm at nominal: bases and boards by the weighted Kabsch rotation, the orientation of tip and markers by
//! the mean of what the sensor saw, their offsets by the linear least squares they enter with. Each step is robust
//! (Huber weights on the distances, scale by their median) and closed-form, so the start values may be metres and half
//! turns off. What remains is left to the solver, over these parameters alone (`frames`).

use crate::FitConfig;
use crate::fit::rigid_fit::{Pair, nearest_rotation, rigid_fit, weights_of};
use crate::objective::frame_names::{frame_names, is_free, tips_at};
use crate::objective::model_problem::ModelProblem;
use armcal_core::robust::median;
use armcal_core::{Against, FeatureId, Observation, Parameter, Pose};
use armcal_model::Model;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Rounds of the alternation, and the change [m, rad] below which it ends: the solver, which goes on from there, closes in on the
/// minimum much faster.
const ROUNDS: usize = 200;
const SETTLED: f64 = 1e-3;

/// A nominal arm that is further off [m] may stand in the wrong place, and is in a better one where this share is left.
const FAR_M: f64 = 5e-3;
const BETTER: f64 = 0.95;

/// The alternation on all observations; what a recording has copies of then on its own ones.
pub(crate) fn closed_form_start(
    problem: &ModelProblem<'_>,
    config: &FitConfig,
    start: Vec<f64>,
    which: &dyn Fn(&Parameter) -> bool,
) -> Vec<f64> {
    let model = problem.model();
    let all = Alignment::new(model, problem.observations(), config);
    let mut p = all.run(start.clone(), which);
    let error_m = all.median_error_m(&p);
    if error_m > FAR_M {
        // An offset that somebody guessed wrongly leads the alternation astray: then from none.
        let without = all.run(all.without_offsets(start, which), which);
        if all.median_error_m(&without) < BETTER * error_m {
            p = without;
        }
    }
    if model.copies().is_empty() {
        return p;
    }
    for run in model.alike(problem.observations()) {
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

    /// The same values with every offset on a link that may be placed at none.
    fn without_offsets(&self, mut p: Vec<f64>, which: &dyn Fn(&Parameter) -> bool) -> Vec<f64> {
        let tips = tips_at(self.model);
        let nominal = self.model.nominal();
        for (k, (feature, _)) in self.model.features().enumerate() {
            let Some(name) = self.names.get(tips + k) else { continue };
            let place = Place::new(self.model, name, &self.model.feature_in_link(&nominal, feature), which);
            place.position.into_iter().flatten().for_each(|index| p[index] = 0.0);
        }
        p
    }

    fn median_error_m(&self, p: &[f64]) -> f64 {
        let error = |o: &&Observation| self.model.residual(p, o).position_m.norm();
        median(&self.observations.iter().map(error).collect::<Vec<_>>())
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
    nearest_rotation(&sum, current)
}
