//! The greedy choice, and what it promises in words.

use super::advice::sensor;
use super::pool::{Possible, pool};
use super::reach::Limits;
use super::rivals::{Rival, Standing};
use super::{Allowed, Known, Pair, Proposal, Proposed};
use crate::error::Error;
use armcal_calibrate::linearise;
use armcal_core::Observation;
use armcal_diagnose::{DiagnosisConfig, Plan, PoolDwell, Survivor, plan};
use armcal_model::{EffectSpec, Model, Session};
use nalgebra::{DMatrix, DVector};

/// Load tried when the user named none and motion alone does not help [kg].
const TRIAL_LOAD_KG: f64 = 0.5;
/// Name of the absence of every effect.
const NOTHING: &str = "nothing";

/// Chooses the dwells that best tell the standing explanations apart.
///
/// `known.model` has the effects that are beyond doubt, and `known.values` are its fitted parameters.
pub fn propose(
    known: &Known<'_>,
    standing: &Standing,
    allowed: &Allowed,
    config: &DiagnosisConfig,
) -> Result<Proposal, Error> {
    let limits = Limits::of(known, allowed);
    let first = Weighed::new(known, standing, &limits, allowed)?;
    let all = first.plan(&vec![true; first.survivors.len()], allowed.dwells, config);
    // What no motion separates is one explanation for the choice, so that no dwell is spent on it.
    let mut kept = vec![true; first.survivors.len()];
    for pair in all.pairs.iter().filter(|p| !p.separable) {
        let index = |name: &String| first.survivors.iter().position(|s| s.name == *name);
        if let [Some(a), Some(b)] = [index(&pair.names[0]), index(&pair.names[1])]
            && kept[a]
            && kept[b]
        {
            // "Nothing" stays, and of two effects the more probable one, which comes first.
            let (first_of, last_of) = (a.min(b), a.max(b));
            kept[if first.survivors[last_of].name == NOTHING { first_of } else { last_of }] = false;
        }
    }
    let best = first.plan(&kept, allowed.dwells, config);
    let mut assumptions = assumptions(known, allowed);
    let stuck = all.pairs.iter().any(|p| !p.separable);
    if stuck
        && allowed.loads_kg.iter().all(|l| *l == 0.0)
        && known.observations.iter().all(|o| o.load_kg == 0.0)
    {
        let loaded = Allowed { loads_kg: vec![0.0, TRIAL_LOAD_KG], ..allowed.clone() };
        let trial = Weighed::new(known, standing, &limits, &loaded)?;
        let with = trial.plan(&vec![true; trial.survivors.len()], allowed.dwells, config);
        let won = all
            .pairs
            .iter()
            .filter(|p| !p.separable)
            .filter(|p| with.pairs.iter().any(|w| w.names == p.names && w.separable));
        let won: Vec<String> = won.map(|p| p.names.join(" and ")).collect();
        if !won.is_empty() {
            assumptions.push(format!(
                "a load of {TRIAL_LOAD_KG} kg would also tell apart {}: give --load {TRIAL_LOAD_KG}",
                won.join("; ")
            ));
        }
    }
    Ok(Proposal {
        explanations: first.survivors.iter().map(|s| s.name.clone()).collect(),
        why: standing.why.clone(),
        dwells: best
            .chosen
            .iter()
            .zip(&best.smallest_delta)
            .map(|(i, d)| proposed(&first.pool[*i], *d))
            .collect(),
        sentence: sentence(&all, &best, config),
        pairs: pairs(&all, &best),
        assumptions,
        range_deg: limits.0.iter().map(|range| range.map(f64::to_degrees)).collect(),
        pool: first.pool.len(),
    })
}

/// Everything the choice needs, whitened.
struct Weighed {
    pool: Vec<Possible>,
    dwells: Vec<PoolDwell>,
    survivors: Vec<Survivor>,
    geometry: DMatrix<f64>,
    precision: DVector<f64>,
}

impl Weighed {
    fn new(
        known: &Known<'_>,
        standing: &Standing,
        limits: &Limits,
        allowed: &Allowed,
    ) -> Result<Weighed, Error> {
        let specs: Vec<EffectSpec> = standing.rivals.iter().map(|r| r.spec.clone()).collect();
        let pool = pool(known, limits, allowed, &specs);
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
                let size = |c: &usize| size(&full, data.axes[*c].index, &standing.rivals[k]);
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
        let geometry = -data.jacobian.select_columns(&own);
        let precision = DVector::from_iterator(own.len(), own.iter().map(|c| data.axes[*c].precision));
        Ok(Weighed { pool, dwells, survivors, geometry, precision })
    }

    /// The choice among those that are kept.
    fn plan(&self, kept: &[bool], count: usize, config: &DiagnosisConfig) -> Plan {
        let some = |k: &usize| kept.get(*k).copied().unwrap_or(false);
        let indices: Vec<usize> = (0..self.survivors.len()).filter(some).collect();
        let survivors: Vec<Survivor> = indices.iter().map(|k| self.survivors[*k].clone()).collect();
        let dwell = |d: &PoolDwell| PoolDwell {
            geometry: d.geometry.clone(),
            effects: indices.iter().map(|k| d.effects[*k].clone()).collect(),
        };
        let dwells: Vec<PoolDwell> = self.dwells.iter().map(dwell).collect();
        plan(&self.geometry, &self.precision, &survivors, &dwells, count, config)
    }
}

/// Size of an amplitude in typical sizes: what the data ask for, else typical.
fn size(model: &Model, parameter: usize, rival: &Rival) -> f64 {
    let name = &model.parameters()[parameter].name;
    let quantity = name.strip_prefix(&format!("{}.", rival.spec)).unwrap_or(name);
    rival.sizes.iter().find(|(known, _)| known == quantity).map_or(1.0, |(_, size)| *size)
}

fn proposed(possible: &Possible, delta: f64) -> Proposed {
    let o = &possible.observation;
    Proposed {
        place: possible.place.clone(),
        joint_deg: o.joint_rad.iter().map(|q| q.to_degrees()).collect(),
        arrival: o.arrival.clone(),
        load_kg: o.load_kg,
        delta,
    }
}

/// Pairs after the chosen dwells; those that no dwell separates with what does.
fn pairs(all: &Plan, best: &Plan) -> Vec<Pair> {
    let pair = |p: &armcal_diagnose::PlannedPair| {
        let chosen = best.pairs.iter().find(|b| b.names == p.names);
        let other = p.names.iter().find(|n| *n != NOTHING);
        let with_nothing = p.names.iter().any(|n| n == NOTHING);
        let help = || match other {
            Some(name) if with_nothing => {
                format!("{name} stays invisible to these motions: {}", sensor(name, name))
            }
            _ => sensor(&p.names[0], &p.names[1]).to_owned(),
        };
        Pair {
            names: p.names.clone(),
            delta_before: p.delta_before,
            delta_after: chosen.map_or(p.delta_after, |c| c.delta_after),
            sensor: (!p.separable).then(help),
        }
    };
    all.pairs.iter().map(pair).collect()
}

fn sentence(all: &Plan, best: &Plan, config: &DiagnosisConfig) -> String {
    let stuck: Vec<String> = all
        .pairs
        .iter()
        .filter(|p| !p.separable)
        .map(|p| format!("{} ({})", p.names.join(" and "), sensor(&p.names[0], &p.names[1])))
        .collect();
    let rest = format!("no motion within these ranges will tell apart {}", stuck.join("; "));
    let told = best.pairs.iter().filter(|p| p.delta_after >= config.min_delta).count();
    match () {
        () if all.pairs.is_empty() => {
            "there is only one explanation: nothing is left to tell apart".to_owned()
        }
        () if told == 0 => rest,
        () if best.chosen.is_empty() && stuck.is_empty() => {
            "the data at hand tell these explanations apart already: run `armcal diagnose`".to_owned()
        }
        () => {
            let least = best.smallest_delta.last().copied().unwrap_or(f64::NAN);
            let odds = match () {
                () if least >= 14.0 => "which will settle it",
                () if least >= config.min_delta => "which will probably settle it; more dwells make it sure",
                () => "which leaves the closest pair open; ask for more with --dwells",
            };
            let first = format!(
                "{} more dwells bring every pair to Delta {least:.0} or more, {odds}",
                best.chosen.len()
            );
            if stuck.is_empty() { first } else { format!("{first}; {rest}") }
        }
    }
}

fn assumptions(known: &Known<'_>, allowed: &Allowed) -> Vec<String> {
    let mut all = vec![format!(
        "joints stay within the recorded range widened by {} deg (--margin), or what --range says; the way to a pose is not \
         checked for collisions",
        allowed.margin_deg
    )];
    match known.tracked {
        Some(t) => all.push(format!(
            "a sensor sees the tip away from the board with {:.3} mm per axis",
            (t.covariance_m2.trace() / 3.0).sqrt() * 1e3
        )),
        None => all.push("no tip stream: only cavities of the board can be visited".to_owned()),
    }
    all.push("the noise is as declared, and sizes are those the data ask for, else typical ones".to_owned());
    all
}
