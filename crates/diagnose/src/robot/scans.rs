//! Families with a shape to be searched, seen by a fitted model's observations: each value of the shape as columns.

use crate::DiagnoseError;
use crate::enters::EntersAt;
use crate::problem::{Candidate, Channel, Columns, Scan, per_turn};
use crate::robot::stretches::{running_sums, score_between, stretches};
use crate::robot::view::View;
use armcal_calibrate::Linearisation;
use armcal_core::DwellId;
use armcal_model::{EffectSpec, Since};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// Steps of an effect that are weighed in full.
const MOST_STEPS: usize = 400;
/// Numbers in the columns that are linearised together.
const LINEARISED: usize = 4_000_000;

impl View<'_> {
    /// The catalogue, and every family with a shape: products where the shape switches or modulates, columns of their own
    /// otherwise. One linearisation serves all that acts in proportion to its size.
    pub(crate) fn candidates_and_scans(
        &self,
        specs: &[EffectSpec],
        channels: &[Channel],
        base: &Linearisation,
    ) -> Result<(Vec<Candidate>, Vec<Scan>), DiagnoseError> {
        let times = Times::of(self.poses(base).map(|o| o.dwell));
        let mut families = Vec::new();
        for (family, mut members) in self.model.scans(self.session, self.observations) {
            members.retain(|spec| self.tried(spec));
            if !members.is_empty() {
                families.push((Scanned::of(&family, &members, channels, &times), family, members));
            }
        }
        let like = families.iter().flat_map(|(scanned, _, members)| scanned.like(members));
        let like: Vec<EffectSpec> = like.collect();
        let mut all = self.candidates(&like, base)?.into_iter();
        let candidates = self.listed(specs, channels, base)?;
        let mut scans = Vec::new();
        let mut alone = Vec::new();
        for (scanned, family, members) in families {
            let like: Vec<Candidate> = all.by_ref().take(scanned.like(&members).count()).collect();
            let points = match (scanned, like.first()) {
                (Scanned::Steps(_), Some(whole)) => {
                    let tried = members.len();
                    let best = times.most_promising(members, whole, base);
                    let points = self.switched(whole, &best, &times);
                    scans.push(Scan { name: family.to_string(), points, tried });
                    scans.extend(self.passing(&family, whole, &times, base));
                    continue;
                }
                (Scanned::Waves(channel), Some(like)) => self.modulated(channel, like, &members, base),
                _ => None,
            };
            // No product, or one of two amplitudes is held: what is left is none.
            if points.is_none() {
                alone.push((scans.len(), members));
            }
            scans.push(Scan::of(family.to_string(), points.unwrap_or_default()));
        }
        let members: Vec<EffectSpec> =
            alone.iter().flat_map(|(_, members)| members.iter().cloned()).collect();
        let mut points = self.listed(&members, channels, base)?.into_iter();
        for (scan, members) in alone {
            let points = points.by_ref().take(members.len()).collect();
            scans[scan] = Scan::of(std::mem::take(&mut scans[scan].name), points);
        }
        Ok((candidates, scans))
    }

    /// Candidates, those that turn one joint as products with its channel: by how much is a matter of the nominal arm alone, and
    /// known from one fit to the next. The others are linearised, so many at a time as some memory holds.
    fn listed(
        &self,
        specs: &[EffectSpec],
        channels: &[Channel],
        base: &Linearisation,
    ) -> Result<Vec<Candidate>, DiagnoseError> {
        let channel = |spec: &EffectSpec| {
            let joint = EntersAt::Joint(spec.target?);
            channels.iter().find(|c| c.enters == joint).map(|c| &c.columns)
        };
        let mut products = self.products.borrow_mut();
        let refined = |spec: &EffectSpec| self.sizes.get(&spec.to_string()).is_some_and(Option::is_some);
        let is_known = |spec: &&EffectSpec| products.contains_key(&spec.to_string()) && !refined(spec);
        let new: Vec<EffectSpec> = specs.iter().filter(|spec| !is_known(spec)).cloned().collect();
        let at_once = (LINEARISED / base.residual.len().max(1)).max(1);
        let (rows, mut others) = (dwell_rows(base), BTreeMap::new());
        for some in new.chunks(at_once) {
            for (spec, mut candidate) in some.iter().zip(self.candidates(some, base)?) {
                let product = channel(spec).and_then(|base| candidate.columns.factored(base, &rows));
                let known = if product.is_some() { &mut *products } else { &mut others };
                candidate.columns = product.unwrap_or(candidate.columns);
                known.insert(spec.to_string(), candidate);
            }
        }
        let of = |spec: &EffectSpec| {
            let name = spec.to_string();
            let mut candidate = others.get(&name).or_else(|| products.get(&name))?.clone();
            if let (Columns::Product { base, .. }, Some(channel)) = (&mut candidate.columns, channel(spec)) {
                *base = channel.clone();
            }
            Some(candidate)
        };
        Ok(specs.iter().filter_map(of).collect())
    }

    /// An event that ends again, in the stretches of dwells where it promises most.
    fn passing(
        &self,
        family: &EffectSpec,
        whole: &Candidate,
        times: &Times,
        base: &Linearisation,
    ) -> Option<Scan> {
        let Columns::Dense(columns) = &whole.columns else { return None };
        let found = stretches(&times.dwells, &dwell_rows(base), columns, &base.residual);
        let stretch = |(first, last): (DwellId, usize)| family.clone().since(Since::Dwells { first, last });
        let members: Vec<EffectSpec> =
            found.best.into_iter().map(stretch).filter(|spec| self.tried(spec)).collect();
        let points = self.switched(whole, &members, times);
        (!points.is_empty()).then(|| Scan {
            name: format!("{family} for some dwells"),
            tried: found.tried,
            points,
        })
    }

    /// The effect in all dwells, `whole`, switched on where each event acts.
    fn switched(&self, whole: &Candidate, members: &[EffectSpec], times: &Times) -> Vec<Candidate> {
        let Columns::Dense(base) = &whole.columns else { return Vec::new() };
        let at = |member: &EffectSpec| Candidate {
            spec: member.to_string(),
            known: self.knowledge.acts(member).map(str::to_owned),
            target: self.target(member),
            columns: Columns::Within {
                base: base.clone(),
                places: times.places.clone(),
                on: times.on(member.since.as_ref()),
            },
            ..whole.clone()
        };
        members.iter().map(at).collect()
    }

    /// A periodic error turns its joint by a sine and a cosine of the reading; none where one of the two is held.
    fn modulated(
        &self,
        channel: &Channel,
        like: &Candidate,
        members: &[EffectSpec],
        base: &Linearisation,
    ) -> Option<Vec<Candidate>> {
        let [sine, cosine] = like.amplitudes.as_slice() else { return None };
        let joint = members.first()?.target?;
        let angle_rad = Arc::new(self.poses(base).map(|o| o.joint_rad[joint]).collect::<Vec<_>>());
        let at = |member: &EffectSpec| Candidate {
            spec: member.to_string(),
            known: self.knowledge.acts(member).map(str::to_owned),
            per_turn: per_turn(member),
            columns: Columns::Wave {
                base: channel.columns.clone(),
                angle_rad: angle_rad.clone(),
                per_turn: per_turn(member).unwrap_or(0.0),
                sizes: [sine.typical, cosine.typical],
            },
            ..like.clone()
        };
        Some(members.iter().map(at).collect())
    }
}

/// Rows of each dwell.
fn dwell_rows(base: &Linearisation) -> Vec<Range<usize>> {
    base.poses.iter().map(|pose| pose.rows.clone()).collect()
}

/// How the members of a family with a shape become columns.
enum Scanned<'c> {
    /// Of the effect that acts from the first dwell on.
    Steps(Box<EffectSpec>),
    /// Of a joint that is turned over its own angle.
    Waves(&'c Channel),
    /// Each by itself.
    Alone,
}

impl<'c> Scanned<'c> {
    fn of(
        family: &EffectSpec,
        members: &[EffectSpec],
        channels: &'c [Channel],
        times: &Times,
    ) -> Scanned<'c> {
        let steps = members.iter().all(|m| matches!(m.since, Some(Since::Dwell(_))));
        if let Some(first) = times.order.first().filter(|_| steps) {
            return Scanned::Steps(family.clone().since(Since::Dwell(*first)).into());
        }
        let joint = family.target.map(EntersAt::Joint);
        let channel = channels.iter().find(|c| Some(&c.enters) == joint.as_ref());
        channel.filter(|_| family.kind == "periodic").map_or(Scanned::Alone, Scanned::Waves)
    }

    /// The effects whose columns say what those of all members are.
    fn like<'m>(&'m self, members: &'m [EffectSpec]) -> impl Iterator<Item = EffectSpec> + use<'m> {
        let own = match self {
            Scanned::Steps(always) => std::slice::from_ref(always.as_ref()),
            Scanned::Waves(_) => &members[..members.len().min(1)],
            Scanned::Alone => &[],
        };
        own.iter().cloned()
    }
}

/// The dwells in the order of the problem, and as they follow each other.
struct Times {
    dwells: Vec<DwellId>,
    order: Vec<DwellId>,
    /// The place of each dwell in the order.
    places: Arc<Vec<usize>>,
}

impl Times {
    fn of(dwells: impl Iterator<Item = DwellId>) -> Times {
        let dwells: Vec<DwellId> = dwells.collect();
        let mut order = dwells.clone();
        order.sort_unstable();
        let places = dwells.iter().map(|dwell| order.partition_point(|other| other < dwell)).collect();
        Times { dwells, order, places: Arc::new(places) }
    }

    /// Of very many steps of an effect those that promise most, in the order of time.
    fn most_promising(
        &self,
        steps: Vec<EffectSpec>,
        whole: &Candidate,
        base: &Linearisation,
    ) -> Vec<EffectSpec> {
        let Columns::Dense(columns) = &whole.columns else { return steps };
        if steps.len() <= MOST_STEPS {
            return steps;
        }
        let mut in_time: Vec<usize> = (0..self.dwells.len()).collect();
        in_time.sort_unstable_by_key(|i| self.places[*i]);
        let sums = running_sums(&in_time, &dwell_rows(base), columns, &base.residual);
        let promise = |step: &EffectSpec| {
            let on = self.on(step.since.as_ref());
            score_between(&sums[on.start], &sums[on.end])
        };
        let mut order: Vec<(f64, usize)> = steps.iter().map(promise).zip(0..).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut best: Vec<usize> = order.into_iter().take(MOST_STEPS).map(|(_, k)| k).collect();
        best.sort_unstable();
        best.into_iter().map(|k| steps[k].clone()).collect()
    }

    /// The places of the dwells in which an event acts.
    fn on(&self, since: Option<&Since>) -> Range<usize> {
        let from = |first: DwellId| self.order.partition_point(|dwell| *dwell < first);
        match since {
            None => 0..0,
            Some(Since::Dwell(first)) => from(*first)..self.order.len(),
            Some(Since::Recording(recording)) => {
                let start = |recording| from(DwellId { recording, dwell: 0 });
                start(*recording)..start(recording + 1)
            }
            Some(Since::Dwells { first, last }) => {
                from(*first)..from(DwellId { recording: first.recording, dwell: last + 1 })
            }
        }
    }
}
