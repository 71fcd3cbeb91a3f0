//! Effects in a model: adding them, what could be added, and what drives them.

use super::{Model, check_names};
use crate::ModelError;
use crate::effects::prelude::{ARM, EffectContext};
use crate::effects::{
    Drivers, EffectKind, EffectSpec, Effects, NominalPose, Offered, PlacedEffect, SEATED, Session, Since,
    Target, catalogue, place_effect,
};
use armcal_core::{DwellId, Observation, Parameter};
use std::collections::BTreeSet;

/// Dwells before the first and after the last step that is tried: one alone is an outlier.
const STEP_MARGIN: usize = 2;

impl Model {
    /// The same model with more effects behind its parameters; at their nominal zero they change nothing.
    ///
    /// Their parameters are named `<spec>.<quantity>`. Behind them stands what recordings were asked to have for themselves
    /// ([`Model::ask_own`]). Errors name what a spec asks for and this arm, or these
    /// observations, cannot give.
    pub fn with_effects(&self, specs: &[EffectSpec], session: &Session) -> Result<Model, ModelError> {
        if specs.is_empty() {
            return self.clone().with_own_asked();
        }
        let zero = self.nominal_arm().zero_pose();
        let mut parameters = self.parameters().to_vec();
        let mut placed = self.effects().to_vec();
        for spec in specs {
            let (effect, own) = self.place(session, spec, &zero, parameters.len())?;
            placed.push(effect);
            parameters.extend(own);
        }
        check_names(&parameters)?;
        let effects = Effects::new(placed, session.clone().into(), self.nominal_arm(), parameters.len());
        let mut model = Model { parameters, effects: Some(effects), ..self.clone() };
        model.refresh();
        model.with_own_asked()
    }

    /// The effects, in the order of their parameters.
    pub fn effects(&self) -> &[PlacedEffect] {
        self.effects.as_ref().map_or(&[], |effects| &effects.placed)
    }

    /// Reads a spec such as `backlash:1` for this arm.
    pub fn effect(&self, text: &str) -> Result<EffectSpec, ModelError> {
        EffectSpec::parse(text, self.chain().joint_names())
    }

    /// Everything of the catalogue that this arm and these observations could show: every kind at every joint
    /// and in every recording it can act in, with default shapes.
    pub fn candidates(&self, session: &Session) -> Vec<EffectSpec> {
        let zero = self.nominal_arm().zero_pose();
        let mut specs = Vec::new();
        for kind in catalogue() {
            let at_targets = self.targets(kind, EffectSpec::new(kind.name));
            match kind.offered {
                Offered::Once => {
                    specs.extend(at_targets.flat_map(|spec| self.parts(kind, spec, session, &zero)))
                }
                Offered::Events | Offered::Recordings => {
                    for recording in session.telling_recordings() {
                        let since = Since::Recording(recording);
                        specs.extend(self.targets(kind, EffectSpec::new(kind.name).since(since)));
                    }
                }
                Offered::Scanned | Offered::Never => {}
            }
        }
        specs.retain(|spec| self.offers(spec, session, &zero));
        specs
    }

    /// The families with a number to be scanned: each without it, and with every value worth trying. Steps at
    /// a dwell are families too.
    pub fn scans(
        &self,
        session: &Session,
        observations: &[Observation],
    ) -> Vec<(EffectSpec, Vec<EffectSpec>)> {
        let zero = self.nominal_arm().zero_pose();
        let steps = step_dwells(observations);
        let mut families = Vec::new();
        for kind in catalogue() {
            for spec in self.targets(kind, EffectSpec::new(kind.name)) {
                let mut members = Vec::new();
                if kind.offered == Offered::Events {
                    let at = |dwell: DwellId| spec.clone().since(Since::Dwell(dwell));
                    let first = steps.first().map(|(dwell, _)| at(*dwell));
                    let placed = first.and_then(|spec| self.place(session, &spec, &zero, 0).ok());
                    let least = placed.map_or(0, |(effect, _)| least_dwells(effect.amplitudes));
                    // Before the first dwell that it acts in, a step is a constant.
                    let felt =
                        |dwell: DwellId| !kind.where_tracked || tracked_beside(observations, dwell) >= least;
                    let telling = steps.iter().filter(|(dwell, side)| *side >= least && felt(*dwell));
                    members.extend(telling.map(|(dwell, _)| at(*dwell)));
                }
                let context =
                    EffectContext { nominal: self.nominal_arm(), session, spec: &spec, kind, zero: &zero };
                members.extend(shape_variants(&context, observations));
                members.retain(|spec| self.offers(spec, session, &zero));
                if !members.is_empty() {
                    families.push((spec, members));
                }
            }
        }
        families
    }

    /// What drives the effects in an observation.
    pub fn drivers<'o>(&'o self, session: &'o Session, o: &'o Observation) -> Drivers<'o> {
        Drivers::of(self.known_by(o).unwrap_or(self).nominal_arm(), session, o)
    }

    /// Places an effect whose parameters start at `first`; gives it and its parameters.
    pub(super) fn place(
        &self,
        session: &Session,
        spec: &EffectSpec,
        zero: &NominalPose,
        first: usize,
    ) -> Result<(PlacedEffect, Vec<Parameter>), ModelError> {
        place_effect(self.nominal_arm(), &self.declared, session, spec, zero, first)
    }

    /// Whether an effect could be added here, with something for a fit to find.
    fn offers(&self, spec: &EffectSpec, session: &Session, zero: &NominalPose) -> bool {
        let placed = self.place(session, spec, zero, 0);
        placed.is_ok_and(|(effect, own)| own[..effect.amplitudes].iter().any(|p| p.free))
    }

    pub(super) fn targets(
        &self,
        kind: &EffectKind,
        spec: EffectSpec,
    ) -> impl Iterator<Item = EffectSpec> + use<> {
        let of_arms = kind.shapes.iter().any(|shape| shape.name == ARM.name);
        let arms = if of_arms { self.chain().arms().len() } else { 0 };
        let at: Vec<EffectSpec> = match kind.target {
            Target::Joint => (0..self.joint_count()).map(|joint| spec.clone().at(joint)).collect(),
            Target::Marker => self.markers().map(|(_, name, _)| spec.clone().at_marker(name)).collect(),
            Target::Whole if arms > 0 => {
                (1..=arms).map(|arm| spec.clone().with(ARM.name, arm as f64)).collect()
            }
            Target::Whole => vec![spec],
        };
        at.into_iter()
    }

    /// The spec with every part of the arm that a shape of its kind can name.
    fn parts(
        &self,
        kind: &'static EffectKind,
        spec: EffectSpec,
        session: &Session,
        zero: &NominalPose,
    ) -> Vec<EffectSpec> {
        let part = kind.shapes.iter().find(|shape| !shape.parameter && shape.name != ARM.name);
        let Some((shape, values)) = part.and_then(|shape| Some((shape, shape.values?))) else {
            return vec![spec];
        };
        let context = EffectContext { nominal: self.nominal_arm(), session, spec: &spec, kind, zero };
        values(&context, &[]).iter().map(|value| spec.clone().with(shape.name, *value)).collect()
    }
}

/// Four significant digits: the value stands in a name, and no data tell it better.
fn round_significant(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

impl Session {
    /// The recordings whose difference from the others says something: of two, one is enough.
    fn telling_recordings(&self) -> std::ops::Range<usize> {
        match self.recordings {
            0 | 1 => 0..0,
            2 => 1..2,
            n => 0..n,
        }
    }
}

/// Dwells that tell an event of so many amplitudes from their noise: with three rows each, twice as many rows as amplitudes.
pub fn least_dwells(amplitudes: usize) -> usize {
    (2 * amplitudes).div_ceil(3).max(STEP_MARGIN)
}

/// Tracked dwells on the side of a step that has fewer of them.
fn tracked_beside(observations: &[Observation], at: DwellId) -> usize {
    let tracked: BTreeSet<DwellId> =
        observations.iter().filter(|o| o.seen_m().is_some()).map(|o| o.dwell).collect();
    let before = tracked.range(..at).count();
    before.min(tracked.len() - before)
}

/// The dwells at which a step can be told from noise, in the order of time, each with how many dwells of its recording
/// are on the shorter side of it: beyond it a pose of the board may be free. A step that only sets the first or the last
/// recording apart is that recording's own event.
fn step_dwells(observations: &[Observation]) -> Vec<(DwellId, usize)> {
    let all: Vec<DwellId> =
        observations.iter().map(|o| o.dwell).collect::<BTreeSet<_>>().into_iter().collect();
    let recordings: BTreeSet<usize> = all.iter().map(|dwell| dwell.recording).collect();
    let own_event: Vec<usize> = recordings
        .iter()
        .enumerate()
        .filter(|(i, _)| *i == 1 || i + 1 == recordings.len())
        .map(|(_, r)| *r)
        .collect();
    let begins = |k: usize| k > 0 && all[k - 1].recording != all[k].recording;
    let telling = |k: &usize| !(begins(*k) && own_event.contains(&all[*k].recording));
    let dwells: Vec<DwellId> = (0..all.len()).filter(telling).map(|k| all[k]).collect();
    let inner = dwells.get(STEP_MARGIN..dwells.len().saturating_sub(STEP_MARGIN - 1)).unwrap_or(&[]);
    let side = |dwell: &DwellId| {
        let from = all.partition_point(|d| d.recording < dwell.recording);
        let to = all.partition_point(|d| d.recording <= dwell.recording);
        let at = all.partition_point(|d| d < dwell);
        let (before, after) = (at - from, to - at);
        // Between two recordings there is no shorter side.
        (*dwell, if before == 0 { usize::MAX } else { before.min(after) })
    };
    inner.iter().map(side).collect()
}

/// A kind with every value of a shape that is worth trying, and with every two of different shapes: where a torque changes
/// sign and how sharply, say, is seen only together. Who holds the arm is asked of each kind by itself: with another shape
/// beside it a base that rocks at the height of a joint is that joint's spring.
fn shape_variants(context: &EffectContext<'_>, observations: &[Observation]) -> Vec<EffectSpec> {
    let searched = context.kind.shapes.iter().filter(|shape| shape.parameter);
    let searched = searched.filter_map(|shape| Some((shape.name, shape.values?(context, observations))));
    let searched: Vec<(&str, Vec<f64>)> = searched.collect();
    let with = |spec: &EffectSpec, (name, values): &(&str, Vec<f64>)| -> Vec<EffectSpec> {
        values.iter().map(|v| spec.clone().with(name, round_significant(*v))).collect()
    };
    let mut members: Vec<EffectSpec> = searched.iter().flat_map(|shape| with(context.spec, shape)).collect();
    let own: Vec<_> = searched.iter().filter(|(name, _)| *name != SEATED.name).collect();
    for (k, shape) in own.iter().enumerate() {
        for first in with(context.spec, shape) {
            members.extend(own[k + 1..].iter().flat_map(|later| with(&first, later)));
        }
    }
    members
}
