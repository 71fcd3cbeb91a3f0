//! The effects of a model: placing them and evaluating them together.

use super::classification::{Family, Target};
use super::declared::Declared;
use super::drivers::Drivers;
use super::kind::{EffectContext, EffectKind, Placement};
use super::nominal_arm::NominalArm;
use super::nominal_pose::NominalPose;
use super::physics::{AnyPhysics, Deformation, Slot};
use super::session::Session;
use super::spec::EffectSpec;
use super::state;
use crate::ModelError;
use crate::error::similar_name_hint;
use crate::rigid::Rigid;
use crate::segment::{Freedom, Geometry, Segment};
use crate::tree::{Feature, Route, Tree, TreeAt};
use crate::twist::Twist;
use armcal_core::{DwellId, FeatureId, Parameter, Role};
use nalgebra::{Matrix3, Vector3};
use num_dual::Dual64;
use std::ops::Range;
use std::sync::Arc;

/// An effect in its place in a model.
#[derive(Debug, Clone)]
pub struct PlacedEffect {
    /// Which effect, where.
    pub spec: EffectSpec,
    /// Its entry in the catalogue.
    pub kind: &'static EffectKind,
    /// Its entries in the parameter vector: amplitudes, then shapes.
    pub parameters: Range<usize>,
    /// How many of them are amplitudes.
    pub amplitudes: usize,
    physics: Arc<dyn AnyPhysics>,
    slots: Vec<Slot>,
    distorts: bool,
}

impl PartialEq for PlacedEffect {
    /// The same spec in the same place of the vector has the same physics.
    fn eq(&self, other: &PlacedEffect) -> bool {
        self.spec == other.spec && self.parameters == other.parameters
    }
}

impl PlacedEffect {
    fn acts_on(&self, x: &Drivers<'_>) -> bool {
        self.acts_in(x.observation.dwell)
    }

    fn acts_in(&self, dwell: DwellId) -> bool {
        self.spec.since.is_none_or(|since| since.holds(dwell))
    }

    /// Whether physics does not let one of its amplitudes be negative, by its name without the spec.
    ///
    /// A link that leads its motor belongs to an arm that is led by hand. Where a spec says that a lost motion acts in
    /// another way in cavities, a servo holds the arm elsewhere, and there a link only lags.
    pub fn never_negative(&self, amplitude: &str) -> bool {
        let quantity = amplitude.trim_end_matches(|c: char| c.is_ascii_digit());
        let lags = self.kind.family == Family::LostMotion && state::servo_elsewhere(&self.spec);
        self.kind.never_negative.contains(&quantity) || (lags && matches!(quantity, "width" | "windup"))
    }
}

/// All effects of a model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Effects {
    pub placed: Vec<PlacedEffect>,
    pub session: Arc<Session>,
    /// The model's tree with a twist, the identity at rest, at every slot in use.
    tree: Tree,
    /// The ways to the model's features in it.
    routes: Vec<Route>,
    /// The slots in use, ascending.
    slots: Vec<Slot>,
}

/// A deformed arm at one observation.
pub(crate) struct Evaluated {
    /// The tip where the sensor sees it.
    pub tip: Rigid<f64>,
    /// The seated point in its board's frame [m]; zero for a tracked tip.
    pub in_board_m: Vector3<f64>,
}

/// A deformed arm at one observation, with its derivatives.
pub(crate) struct Linearised {
    pub at: Evaluated,
    /// Motion of the tip per unit of a parameter.
    pub parameters: Vec<(usize, Twist)>,
    /// Motion of the seated point in its board per unit of a parameter.
    pub seats: Vec<(usize, Vector3<f64>)>,
}

/// Places one effect whose parameters start at `first`; gives it and its parameters.
pub(crate) fn place_effect(
    nominal: NominalArm<'_>,
    declared: &[Declared],
    session: &Session,
    spec: &EffectSpec,
    zero: &NominalPose,
    first: usize,
) -> Result<(PlacedEffect, Vec<Parameter>), ModelError> {
    let kind = spec.kind()?;
    let bad = |problem: String| ModelError::BadEffect { effect: spec.to_string(), problem };
    let context = EffectContext { nominal, session, spec, kind, zero };
    check_words(&context).map_err(bad)?;
    let Placement { amplitudes, physics, slots, distorts } = (kind.place)(&context).map_err(bad)?;
    let count = amplitudes.len();
    let mut parameters = amplitudes;
    let shapes =
        kind.shapes.iter().filter(|shape| shape.parameter && state::is_shape_relevant(shape, &context));
    parameters.extend(shapes.map(|shape| {
        let (name, meaning) = (shape.name.to_owned(), shape.meaning.to_owned());
        let nominal = context.shape(shape.name).unwrap_or_default();
        let (lower, upper) = (shape.lower, shape.upper);
        Parameter { lower, upper, ..Parameter::fixed(name, shape.unit, nominal, Role::Effect, meaning) }
    }));
    let physics = state::in_state(physics, count, &parameters);
    for parameter in &mut parameters {
        declared.iter().try_for_each(|declared| declared.apply(spec, parameter)).map_err(bad)?;
    }
    for (quantity, change) in &spec.overrides {
        let Some(own) = parameters.iter_mut().find(|p| p.name == *quantity) else {
            let known: Vec<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
            let hint = similar_name_hint(quantity, known.iter().copied());
            return Err(bad(format!(
                "it has no parameter \"{quantity}\"{hint} It has: {}",
                known.join(", ")
            )));
        };
        change.apply(own).map_err(bad)?;
    }
    for parameter in &mut parameters {
        parameter.name = format!("{spec}.{}", parameter.name);
    }
    let range = first..first + parameters.len();
    let effect = PlacedEffect {
        spec: spec.clone(),
        kind,
        parameters: range,
        amplitudes: count,
        physics,
        slots,
        distorts,
    };
    Ok((effect, parameters))
}

/// Whether everything the spec says has a meaning for its kind.
fn check_words(context: &EffectContext<'_>) -> Result<(), String> {
    let (spec, kind) = (context.spec, context.kind);
    if kind.target != Target::Joint && spec.target.is_some() {
        return Err("it does not act at a joint; leave the joint out".to_owned());
    }
    for (name, value) in &spec.shape {
        let Some(shape) = kind.shapes.iter().find(|shape| shape.name == name) else {
            let known: Vec<&str> = kind.shapes.iter().map(|shape| shape.name).collect();
            let hint = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(format!("it has no shape \"{name}\"; its shapes are: {hint}"));
        };
        if !(shape.lower <= *value && *value <= shape.upper) {
            return Err(format!("{name} = {value} is not within {} and {}", shape.lower, shape.upper));
        }
    }
    match kind.shapes.iter().find(|shape| context.shape(shape.name).is_none()) {
        Some(shape) => {
            Err(format!("say its {} ({}), such as {spec},{}=...", shape.name, shape.meaning, shape.name))
        }
        None => Ok(()),
    }
}

impl Effects {
    /// Puts placed effects on the tree of a model whose parameter vector then has `count` entries.
    pub fn new(
        placed: Vec<PlacedEffect>,
        session: Arc<Session>,
        nominal: NominalArm<'_>,
        count: usize,
    ) -> Effects {
        let mut slots: Vec<Slot> = placed.iter().flat_map(|effect| effect.slots.iter().copied()).collect();
        slots.sort_unstable();
        slots.dedup();
        let (tree, places) = tree_with_twists(nominal.tree, &slots, count);
        let route = |rigid: &Feature| tree.route(rigid.route.last().map_or(0, |end| places[*end]));
        let routes = nominal.features.iter().map(route).collect();
        Effects { placed, session, tree, routes, slots }
    }

    /// The same effects with their parameters at other places of the vector, which has `count` in all.
    pub fn moved(&self, place: &dyn Fn(usize) -> usize, nominal: NominalArm<'_>, count: usize) -> Effects {
        let mut placed = self.placed.clone();
        for effect in &mut placed {
            let first = place(effect.parameters.start);
            effect.parameters = first..first + effect.parameters.len();
        }
        Effects::new(placed, self.session.clone(), nominal, count)
    }

    /// The tree before a pose deforms it, for [`Effects::evaluate`].
    pub fn predicting(&self, p: &[f64]) -> TreeAt<'_> {
        TreeAt::predicting(&self.tree, self.extended(p))
    }

    /// A feature of the deformed arm, predicted; `tree` is that of [`Effects::predicting`].
    pub fn evaluate(&self, tree: &TreeAt<'_>, p: &[f64], feature: FeatureId, x: &Drivers<'_>) -> Evaluated {
        let (p, q, in_board_m) = self.deformed(p, x);
        let mut tip = tree.follow(&self.routes[feature.0], &p, &q);
        tip.translation_m += self.seen_m(&p, x, &tip.translation_m);
        Evaluated { tip, in_board_m }
    }

    /// The same, for [`Effects::linearise`].
    pub fn tree_at(&self, p: &[f64]) -> TreeAt<'_> {
        TreeAt::of(&self.tree, self.extended(p), None)
    }

    /// A feature of the deformed arm and its derivatives by every parameter; `tree` is that of [`Effects::tree_at`].
    pub fn linearise(&self, tree: &TreeAt<'_>, p: &[f64], feature: FeatureId, x: &Drivers<'_>) -> Linearised {
        let count = p.len();
        let (p, q, in_board_m) = self.deformed(p, x);
        let tip = tree.with(&self.routes[feature.0], &p, &q);
        let mut parameters = tip.parameters;
        let mut motions = vec![Twist::none(); p.len()];
        for (index, twist) in &parameters {
            motions[*index] = *twist;
        }
        parameters.retain(|(index, _)| *index < count);
        let mut joint_motions = vec![Twist::none(); q.len()];
        for (index, twist) in &tip.joints {
            joint_motions[*index].add(twist, 1.0);
        }
        let mut seats = Vec::new();
        let mut change = Deformation::none();
        let mut lanes = Vec::new();
        for effect in self.placed.iter().filter(|effect| effect.acts_on(x)) {
            let first = effect.parameters.start;
            if let Some((joint, shares)) = effect.physics.in_proportion(x, effect.parameters.len()) {
                let of = |(k, share): (usize, &f64)| (first + k, joint_motions[joint].times(*share));
                parameters.extend(shares.iter().enumerate().map(of));
                continue;
            }
            lanes.clear();
            lanes.extend(p[effect.parameters.clone()].iter().map(|&value| Dual64::from(value)));
            for k in effect.physics.touched_entries(x, lanes.len()) {
                lanes[k].eps = 1.0;
                change.clear();
                effect.physics.differentiate(&lanes, x, &mut change);
                lanes[k].eps = 0.0;
                let mut motion = Twist::none();
                for (joint, value) in &change.joints {
                    motion.add(&joint_motions[*joint], value.eps);
                }
                for (index, value) in &change.parameters {
                    motion.add(&motions[*index], value.eps);
                }
                for (slot, values) in &change.twists {
                    for (motion_k, value) in motions[self.twist(*slot, count)].iter().zip(values) {
                        motion.add(motion_k, value.eps);
                    }
                }
                parameters.push((first + k, motion));
                if change.seat_m.iter().any(|s| s.eps != 0.0) {
                    seats.push((first + k, change.seat_m.map(|s| s.eps)));
                }
            }
        }
        let mut at = Evaluated { tip: tip.at, in_board_m };
        self.distort(&p, x, &mut at.tip, &mut parameters, &mut []);
        Linearised { at, parameters, seats }
    }

    /// Motion of a feature per unit of each joint reading.
    pub fn joint_twists(&self, p: &[f64], feature: FeatureId, x: &Drivers<'_>) -> Vec<(usize, Twist)> {
        let (p, q, _) = self.deformed(p, x);
        let (mut tip, mut joints) = self.tree.joint_twists(&self.routes[feature.0], &p, &q);
        self.distort(&p, x, &mut tip, &mut [], &mut joints);
        joints
    }

    /// Joints that may rest anywhere in a gap in the dwell `at`, and the variance of where they do [rad^2].
    pub fn slack(&self, p: &[f64], at: DwellId, seated: bool) -> Vec<(usize, f64)> {
        let acting = self.placed.iter().filter(|effect| effect.acts_in(at));
        acting.filter_map(|effect| effect.physics.slack(&p[effect.parameters.clone()], seated)).collect()
    }

    /// Effects with a gap in the drive of a joint: which, the joint, and how wide it is [rad] (prismatic: [m]).
    pub fn gaps(&self, p: &[f64]) -> impl Iterator<Item = (&EffectSpec, usize, f64)> {
        self.placed.iter().filter_map(|effect| {
            let (joint, width) = effect.physics.gap_of(&p[effect.parameters.clone()])?;
            Some((&effect.spec, joint, width))
        })
    }

    /// Whether a gap of some width would leave a joint free somewhere; `nominal` are the parameters.
    pub fn has_gaps(&self, nominal: &[f64]) -> bool {
        self.placed.iter().any(|effect| {
            let mut theta = nominal[effect.parameters.clone()].to_vec();
            theta[..effect.amplitudes].fill(1.0);
            [true, false].into_iter().any(|seated| effect.physics.slack(&theta, seated).is_some())
        })
    }

    /// Parameters with the twists behind them, joint readings, and the seated point.
    fn deformed(&self, p: &[f64], x: &Drivers<'_>) -> (Vec<f64>, Vec<f64>, Vector3<f64>) {
        let mut change = Deformation::none();
        for effect in self.placed.iter().filter(|effect| effect.acts_on(x)) {
            effect.physics.predict(&p[effect.parameters.clone()], x, &mut change);
        }
        let mut extended = self.extended(p);
        for (index, value) in &change.parameters {
            extended[*index] += value;
        }
        for (slot, values) in &change.twists {
            for (entry, value) in extended[self.twist(*slot, p.len())].iter_mut().zip(values) {
                *entry += value;
            }
        }
        let mut q = x.observation.joint_rad.clone();
        for (joint, value) in &change.joints {
            if let Some(reading) = q.get_mut(*joint) {
                *reading += value;
            }
        }
        let seated = x.observation.in_board_m();
        let in_board_m = seated.map_or_else(Vector3::zeros, |in_board_m| in_board_m + change.seat_m);
        (extended, q, in_board_m)
    }

    /// Parameters, and behind them a twist of zero for every slot.
    fn extended(&self, p: &[f64]) -> Vec<f64> {
        let mut extended = Vec::with_capacity(p.len() + 6 * self.slots.len());
        extended.extend_from_slice(p);
        extended.resize(p.len() + 6 * self.slots.len(), 0.0);
        extended
    }

    /// Where the twist of a slot stands behind the `count` parameters.
    fn twist(&self, slot: Slot, count: usize) -> Range<usize> {
        // Every slot an effect twists was declared when it was placed.
        let index = self.slots.binary_search(&slot).unwrap_or_default();
        count + 6 * index..count + 6 * index + 6
    }

    fn distorting(&self, x: &Drivers<'_>) -> impl Iterator<Item = &PlacedEffect> {
        self.placed.iter().filter(move |effect| effect.distorts && effect.acts_on(x))
    }

    /// How much further than the base the sensor moves what the tip is compared with: the tip itself, or the board it
    /// is seated in. The base was measured by the same sensor, so that its own shift is in the model already.
    fn seen_m(&self, p: &[f64], x: &Drivers<'_>, tip_m: &Vector3<f64>) -> Vector3<f64> {
        // Where nothing distorts, the nominal arm need not be followed.
        let seen = self.distorting(x).next().and_then(|_| sensed_m(x, tip_m));
        let Some((at_m, base_m)) = seen.map(|at_m| (at_m, x.base_m())) else { return Vector3::zeros() };
        let moved = |effect: &PlacedEffect| {
            let theta = &p[effect.parameters.clone()];
            effect.physics.predict_seen(theta, &at_m) - effect.physics.predict_seen(theta, &base_m)
        };
        self.distorting(x).map(moved).sum()
    }

    /// Carries tip and columns through the sensor's distortion and adds the columns of that.
    fn distort(
        &self,
        p: &[f64],
        x: &Drivers<'_>,
        tip: &mut Rigid<f64>,
        parameters: &mut [(usize, Twist)],
        joints: &mut [(usize, Twist)],
    ) {
        let seen = self.distorting(x).next().and_then(|_| sensed_m(x, &tip.translation_m));
        let Some(at_m) = seen else { return };
        let tracked = x.observation.is_tracked();
        let (point, base) = (at_m.map(Dual64::from), x.base_m().map(Dual64::from));
        let mut stretch = Matrix3::identity();
        let mut own = Vec::new();
        for effect in self.distorting(x) {
            let mut lanes: Vec<Dual64> =
                p[effect.parameters.clone()].iter().map(|&value| Dual64::from(value)).collect();
            // The board stays where it was measured when the arm moves.
            for axis in (0..3).filter(|_| tracked) {
                let mut seeded = point;
                seeded[axis].eps = 1.0;
                let change = effect.physics.differentiate_seen(&lanes, &seeded).map(|s| s.eps);
                let mut column = stretch.column_mut(axis);
                column += change;
            }
            for k in 0..lanes.len() {
                lanes[k].eps = 1.0;
                let [at, of_base] =
                    [&point, &base].map(|m| effect.physics.differentiate_seen(&lanes, m).map(|s| s.eps));
                let change = at - of_base;
                lanes[k].eps = 0.0;
                own.push((effect.parameters.start + k, change));
            }
        }
        for (_, twist) in parameters.iter_mut().chain(joints) {
            twist.translation_m = stretch * twist.translation_m;
        }
        for (index, change) in own {
            if let Some((_, twist)) = parameters.iter_mut().find(|(column, _)| *column == index) {
                twist.translation_m += change;
            }
        }
        tip.translation_m += self.seen_m(p, x, &tip.translation_m);
    }
}

/// A tree with six parameters of a twist, behind `count` others, at every slot; and where each of its segments is now.
fn tree_with_twists(rigid: &Tree, slots: &[Slot], count: usize) -> (Tree, Vec<usize>) {
    let mut tree = Tree(Vec::with_capacity(rigid.0.len() + slots.len()));
    // Where each segment is in it, and what its children hang on: itself, or the twist behind it.
    let (mut places, mut ends): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
    let twist = |tree: &mut Tree, slot: Slot, parent: Option<usize>| {
        let Ok(index) = slots.binary_search(&slot) else { return parent };
        let first = count + 6 * index;
        tree.0.push(Segment {
            parent,
            frame: None,
            geometry: Geometry::Origin { nominal: Rigid::identity(), freedom: Freedom::Full },
            joint: None,
            parameters: first..first + 6,
            body: None,
        });
        Some(tree.0.len() - 1)
    };
    for (id, segment) in rigid.0.iter().enumerate() {
        let parent = twist(&mut tree, Slot::Before(id), segment.parent.map(|parent| ends[parent]));
        tree.0.push(Segment { parent, ..segment.clone() });
        let place = tree.0.len() - 1;
        places.push(place);
        ends.push(twist(&mut tree, Slot::Behind(id), Some(place)).unwrap_or(place));
    }
    (tree, places)
}

/// The point the sensor measured in the world [m]: the tip, or the board it is seated in; none of what no sensor saw.
fn sensed_m(x: &Drivers<'_>, tip_m: &Vector3<f64>) -> Option<Vector3<f64>> {
    let seated = || x.observation.cavity().and(x.board_m());
    if x.observation.is_tracked() { Some(*tip_m) } else { seated() }
}
