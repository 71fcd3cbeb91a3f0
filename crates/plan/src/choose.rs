//! The greedy choice, and what it promises in words.

use super::advice::separating_sensor;
use super::discrimination::{Geometry, PoolDwell, Survivor, choose_dwells, pair_delta};
use super::pool::{Possible, candidate_dwells};
use super::reach::Limits;
use super::rivals::{Rival, Standing};
use super::{Allowed, Known, Pair, Proposal, Proposed};
use armcal_calibrate::linearise;
use armcal_core::Observation;
use armcal_diagnose::DiagnosisConfig;
use armcal_model::{EffectSpec, Model, Session};
use armcal_stages::RunError;
use nalgebra::{DMatrix, DVector};

/// At this Delta the evidence names the true one (Bayes factor above 20 in 85 % of cases).
const SETTLED: f64 = 14.0;
/// Effects that are told from nothing together, at most.
const TOGETHER: usize = 6;
/// Name of the absence of every effect.
const NOTHING: &str = "nothing";

/// Chooses the dwells that best tell the standing explanations apart.
///
/// `known.model` has the effects that are beyond doubt, and `known.values` are its fitted parameters. First every pair is
/// asked whether any `allowed.dwells` of the pool would separate it; those that none would are one explanation for the
/// choice. Then batches are chosen greedily, each of other places than the ones before, so that the answer never hangs on
/// one dwell.
pub fn propose(
    known: &Known<'_>,
    standing: &Standing,
    allowed: &Allowed,
    config: &DiagnosisConfig,
) -> Result<Proposal, RunError> {
    let limits = Limits::of(known, allowed);
    let weighed = Weighed::new(known, standing, &limits, allowed)?;
    let choice = weighed.choose(standing, allowed.dwells, config);
    let deltas: Vec<f64> =
        (1..=choice.dwells.len()).map(|n| weighed.smallest(&choice.kept, &choice.dwells[..n])).collect();
    let dwells = choice.dwells.iter().zip(&deltas);
    let name = |k: &usize| weighed.survivors[*k].name.clone();
    let mut pairs = Vec::new();
    for (i, a) in choice.kept.iter().enumerate() {
        for b in &choice.kept[i + 1..] {
            let [before, after] = [&[][..], &choice.dwells].map(|dwells| weighed.apart(*a, *b, dwells));
            pairs.push(Pair {
                names: [name(a), name(b)],
                delta_before: before,
                delta_after: after,
                sensor: None,
            });
        }
    }
    for (a, b) in &choice.stuck {
        let names = [name(a), name(b)];
        let [before, after] = [&[][..], &choice.dwells].map(|dwells| weighed.apart(*a, *b, dwells));
        let sensor = Some(separating_sensor(&names[0], &names[1]).to_owned());
        pairs.push(Pair { names, delta_before: before, delta_after: after, sensor });
    }
    Ok(Proposal {
        explanations: choice.kept.iter().map(name).collect(),
        why: standing.why.clone(),
        dwells: dwells.map(|(i, d)| proposed_dwell(&weighed.pool[*i], *d)).collect(),
        sentence: summary_sentence(&pairs, &deltas, config),
        pairs,
        assumptions: assumptions(known, allowed),
        range_deg: limits.0.iter().map(|range| range.map(f64::to_degrees)).collect(),
        pool: weighed.pool.len(),
    })
}

/// What was chosen: indices of survivors and of dwells.
struct Choice {
    kept: Vec<usize>,
    stuck: Vec<(usize, usize)>,
    dwells: Vec<usize>,
}

/// Everything the choice needs, whitened.
struct Weighed {
    pool: Vec<Possible>,
    dwells: Vec<PoolDwell>,
    survivors: Vec<Survivor>,
    geometry: Geometry,
}

impl Weighed {
    fn new(
        known: &Known<'_>,
        standing: &Standing,
        limits: &Limits,
        allowed: &Allowed,
    ) -> Result<Weighed, RunError> {
        let specs: Vec<EffectSpec> = standing.rivals.iter().map(|r| r.spec.clone()).collect();
        let pool = candidate_dwells(known, limits, allowed, &specs);
        let possible: Vec<Observation> = pool.iter().map(|p| p.observation.clone()).collect();
        let load = known.session.load || possible.iter().any(|o| o.load_kg != 0.0);
        let full = known.model.with_effects(&specs, &Session { load, ..known.session.clone() })?;
        let mut values = known.values.clone();
        values.extend(&full.nominal()[values.len()..]);
        let data = linearise(&full, known.observations, &values, known.fit)?;
        let own: Vec<usize> =
            (0..data.axes.len()).filter(|c| data.axes[*c].index < known.model.parameters().len()).collect();
        let effects = &full.effects()[known.model.effects().len()..];
        let columns: Vec<Vec<usize>> = effects
            .iter()
            .map(|e| (0..data.axes.len()).filter(|c| e.parameters.contains(&data.axes[*c].index)).collect())
            .collect();
        let mut survivors: Vec<Survivor> = (0..effects.len())
            .map(|k| {
                let size = |c: &usize| relative_amplitude(&full, data.axes[*c].index, &standing.rivals[k]);
                Survivor {
                    name: specs[k].to_string(),
                    columns: -data.jacobian.select_columns(&columns[k]),
                    theta: DVector::from_iterator(columns[k].len(), columns[k].iter().map(size)),
                }
            })
            .collect();
        if standing.nothing {
            let columns = DMatrix::zeros(data.residual.len(), 0);
            survivors.push(Survivor { name: NOTHING.to_owned(), columns, theta: DVector::zeros(0) });
        }
        let mut dwells = Vec::with_capacity(pool.len());
        if !possible.is_empty() {
            let more = linearise(&full, &possible, &values, known.fit)?;
            for rows in &more.rows {
                let block = -more.jacobian.rows(rows.start, rows.len());
                let mut effects: Vec<DMatrix<f64>> =
                    columns.iter().map(|c| block.select_columns(c)).collect();
                effects.resize(survivors.len(), DMatrix::zeros(rows.len(), 0));
                dwells.push(PoolDwell { geometry: block.select_columns(&own), effects });
            }
        }
        let geometry = Geometry {
            columns: -data.jacobian.select_columns(&own),
            precision: DVector::from_iterator(own.len(), own.iter().map(|c| data.axes[*c].precision)),
        };
        Ok(Weighed { pool, dwells, survivors, geometry })
    }

    fn choose(&self, standing: &Standing, count: usize, config: &DiagnosisConfig) -> Choice {
        let nothing = standing.nothing.then_some(self.survivors.len() - 1);
        let (mut kept, mut stuck, mut kinds) = (Vec::new(), Vec::new(), Vec::new());
        for (k, rival) in standing.rivals.iter().enumerate() {
            let known_kind = nothing.is_some() && kinds.contains(&rival.spec.kind.as_str());
            if kept.len() == TOGETHER || known_kind {
                continue;
            }
            let parted = |other: &usize| self.separable(k, *other, count, config);
            match nothing.iter().chain(&kept).find(|other| !parted(other)) {
                Some(other) => stuck.push((k.min(*other), k.max(*other))),
                None => {
                    kept.push(k);
                    kinds.push(rival.spec.kind.as_str());
                }
            }
        }
        kept.extend(nothing);
        let (mut dwells, mut barred) = (Vec::new(), vec![false; self.pool.len()]);
        let mut repeating = false;
        while dwells.len() < count && kept.len() > 1 {
            let batch = self.plan(&kept, &barred, count - dwells.len());
            if batch.is_empty() && repeating {
                break;
            }
            if batch.is_empty() {
                // No other place helps: the same places again, from another side or with another load.
                repeating = true;
                barred.fill(false);
                dwells.iter().for_each(|i: &usize| barred[*i] = true);
            }
            for chosen in &batch {
                let same = |o: &Possible| {
                    !repeating
                        && o.place == self.pool[*chosen].place
                        && o.observation.joint_rad == self.pool[*chosen].observation.joint_rad
                        && o.observation.load_kg == self.pool[*chosen].observation.load_kg
                };
                barred[*chosen] = true;
                self.pool
                    .iter()
                    .zip(&mut barred)
                    .filter(|(o, _)| same(o))
                    .for_each(|(_, barred)| *barred = true);
            }
            dwells.extend(batch);
        }
        Choice { kept, stuck, dwells }
    }

    /// Whether `count` dwells of the pool would separate a pair.
    fn separable(&self, a: usize, b: usize, count: usize, config: &DiagnosisConfig) -> bool {
        let pair = [a.min(b), a.max(b)];
        let dwells = self.plan(&pair, &vec![false; self.pool.len()], count);
        self.apart(pair[0], pair[1], &dwells) >= config.min_delta
    }

    /// The greedy choice among survivors that part them, of the dwells that are not barred.
    fn plan(&self, kept: &[usize], barred: &[bool], count: usize) -> Vec<usize> {
        let survivors: Vec<Survivor> = kept.iter().map(|k| self.survivors[*k].clone()).collect();
        let open: Vec<usize> = (0..self.dwells.len()).filter(|i| !barred[*i]).collect();
        let dwell = |i: &usize| PoolDwell {
            geometry: self.dwells[*i].geometry.clone(),
            effects: kept.iter().map(|k| self.dwells[*i].effects[*k].clone()).collect(),
        };
        let dwells: Vec<PoolDwell> = open.iter().map(dwell).collect();
        let plan = choose_dwells(&self.geometry, &survivors, &dwells, count);
        let mut chosen: Vec<usize> = Vec::new();
        for i in plan.chosen.iter().map(|i| open[*i]) {
            if !chosen.contains(&i) {
                chosen.push(i);
            }
        }
        chosen
    }

    /// Smallest Delta over all pairs of `kept` with these dwells.
    fn smallest(&self, kept: &[usize], dwells: &[usize]) -> f64 {
        let pairs = kept.iter().enumerate().flat_map(|(i, a)| kept[i + 1..].iter().map(move |b| (*a, *b)));
        pairs.map(|(a, b)| self.apart(a, b, dwells)).fold(f64::INFINITY, f64::min)
    }

    /// Delta of a pair with these dwells.
    fn apart(&self, a: usize, b: usize, dwells: &[usize]) -> f64 {
        let dwells: Vec<&PoolDwell> = dwells.iter().map(|i| &self.dwells[*i]).collect();
        pair_delta(&self.geometry, &self.survivors, &dwells, (a, b))
    }
}

/// Size of an amplitude in typical sizes: what the data ask for, else typical.
fn relative_amplitude(model: &Model, parameter: usize, rival: &Rival) -> f64 {
    let name = &model.parameters()[parameter].name;
    let quantity = name.strip_prefix(&format!("{}.", rival.spec)).unwrap_or(name);
    rival.sizes.iter().find(|(known, _)| known == quantity).map_or(1.0, |(_, size)| *size)
}

fn proposed_dwell(possible: &Possible, delta: f64) -> Proposed {
    let o = &possible.observation;
    Proposed {
        place: possible.place.clone(),
        joint_deg: o.joint_rad.iter().map(|q| q.to_degrees()).collect(),
        arrival: o.arrival.clone(),
        load_kg: o.load_kg,
        delta,
    }
}

fn summary_sentence(pairs: &[Pair], deltas: &[f64], config: &DiagnosisConfig) -> String {
    let mut advice: Vec<(&str, Vec<String>)> = Vec::new();
    for pair in pairs {
        let Some(sensor) = pair.sensor.as_deref() else { continue };
        let words = match pair.names.iter().position(|name| name == NOTHING) {
            Some(nothing) => pair.names[1 - nothing].clone(),
            None => pair.names.join(" and "),
        };
        match advice.iter_mut().find(|(known, _)| *known == sensor) {
            Some((_, all)) => all.push(words),
            None => advice.push((sensor, vec![words])),
        }
    }
    let stuck: Vec<String> =
        advice.into_iter().map(|(sensor, words)| format!("{} ({sensor})", words.join(", "))).collect();
    let rest = format!("no motion within these ranges will settle {}", stuck.join("; "));
    let Some(least) = deltas.last() else {
        return match (pairs.iter().any(|p| p.sensor.is_none()), stuck.is_empty()) {
            (true, true) => "the data at hand tell these explanations apart already".to_owned(),
            (false, true) => "there is only one explanation: nothing is left to tell apart".to_owned(),
            _ => rest,
        };
    };
    let odds = match () {
        () if *least >= SETTLED => "which as a rule settles it",
        () if *least >= config.min_delta => "which may settle it; more dwells make it sure",
        () => "which leaves the closest pair open; ask for more with --dwells",
    };
    let dwells = if deltas.len() == 1 { "dwell brings" } else { "dwells bring" };
    let first = format!("{} more {dwells} every pair to Delta {least:.0} or more, {odds}", deltas.len());
    if stuck.is_empty() { first } else { format!("{first}; {rest}") }
}

fn assumptions(known: &Known<'_>, allowed: &Allowed) -> Vec<String> {
    let mut all = vec![format!(
        "joints stay within the recorded range widened by {} deg (--margin) as far as the model's joint limits allow, or what --range \
         says; the way to a pose is not checked for collisions",
        allowed.margin_deg
    )];
    match known.tracked {
        Some(t) => all.push(format!(
            "a sensor sees the tip away from the board with {:.3} mm per axis",
            (t.covariance_m2.trace() / 3.0).sqrt() * 1e3
        )),
        None if known.observations.iter().any(armcal_core::Observation::is_joined) => {
            all.push("the tips are joined in every dwell, as they were".to_owned());
        }
        None if known.observations.iter().any(|o| o.against().is_some()) => {
            all.push("the tip is brought to where the places of [[measure]] and their instruments reach it, as they did".to_owned());
        }
        None => all.push("no tip stream: only cavities of the board can be visited".to_owned()),
    }
    all.push("the noise is as declared, and sizes are those the data ask for, else typical ones".to_owned());
    all
}
