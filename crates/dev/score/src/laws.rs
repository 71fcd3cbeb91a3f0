//! Laws that hold of every answer, whatever is true: asked of many scenarios, each seen in several ways.
//!
//! `Scenario -> as it is, noise declared otherwise, readings in another order, half of the dwells -> asked -> Laws -> page`. None of
//! them reads the truth.

use super::case::diagnose_observations;
use super::interval::Share;
use super::{Answer, NOT_LISTED};
use crate::error::ScoreError;
use armcal_core::{DwellId, Observation};
use armcal_diagnose::{Diagnosis, DiagnosisConfig, Verdict, is_clear};
use armcal_lab::scenario::Scenario;
use armcal_model::place_and_moment;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// How much smaller and larger the noise is declared.
const NOISE: [f64; 2] = [0.1, 10.0];

/// The laws, in words.
const LAWS: [(&str, &str); 7] = [
    ("one order", "headline, first row and marks agree, and shares are shares"),
    ("no better loser", "no row outside the answer is clearly better than it"),
    (
        "noise is no judge",
        "noise declared ten times smaller or larger changes no name while errors are beyond both",
    ),
    ("relabelling", "readings in the opposite order give the same verdict and names"),
    ("more is not less", "half of the dwells name nothing that all of them clearly refute"),
    ("less holds more", "the set of half of the dwells holds that of all of them, or more names"),
    ("probabilities", "the first row of a name told alone is the most probable one"),
];

/// Of one law how often it was asked and held, and where not.
#[derive(Debug, Clone, Default)]
struct Asked {
    held: usize,
    asked: usize,
    broken: Vec<String>,
}

/// Every law with what came of it.
#[derive(Debug, Clone, Default)]
pub struct Laws(BTreeMap<&'static str, Asked>);

impl Laws {
    fn ask(&mut self, law: &'static str, holds: bool, what: impl FnOnce() -> String) {
        let asked = self.0.entry(law).or_default();
        asked.asked += 1;
        asked.held += usize::from(holds);
        if !holds {
            asked.broken.push(what());
        }
    }

    fn and(mut self, other: Laws) -> Laws {
        for (law, more) in other.0 {
            let asked = self.0.entry(law).or_default();
            asked.held += more.held;
            asked.asked += more.asked;
            asked.broken.extend(more.broken);
        }
        self
    }

    /// As a page, every breach with its scenario.
    pub fn page(&self, command: &str) -> String {
        let mut text = format!(
            "<!-- armcal.laws/1 -->\n\n# Laws of the verdict\n\nWritten in one go: `{command}`\n\nWhat must hold of every answer, whatever is true, asked of \
             simulated sessions; nobody reads what is hidden in them. The same laws run in the tests on fewer sessions.\n\n\
             | law | says | held | share (95 %) |\n|---|---|--:|---|\n"
        );
        let of = |law| self.0.get(law).cloned().unwrap_or_default();
        for (law, says) in LAWS {
            let Asked { held, asked, .. } = of(law);
            let share = Share { k: held, n: asked };
            let _ = writeln!(text, "| {law} | {says} | {held} of {asked} | {} |", share.percent());
        }
        for (law, _) in LAWS {
            let broken = of(law).broken;
            if !broken.is_empty() {
                let _ = writeln!(text, "\n## Where \u{201c}{law}\u{201d} did not hold\n");
                broken.iter().for_each(|line| {
                    let _ = writeln!(text, "- {line}");
                });
            }
        }
        text
    }
}

/// Asks every law of scenarios, in parallel; `done` is told of each one.
pub fn check_laws(scenarios: &[Scenario], done: &(dyn Fn() + Sync)) -> Result<Laws, ScoreError> {
    let of = |scenario: &Scenario| {
        let laws = of_one(scenario)?;
        done();
        Ok(laws)
    };
    let all = scenarios.par_iter().map(of).collect::<Result<Vec<Laws>, ScoreError>>()?;
    Ok(all.into_iter().fold(Laws::default(), Laws::and))
}

fn of_one(scenario: &Scenario) -> Result<Laws, ScoreError> {
    let seen = scenario.observe()?;
    let name = format!("`{}`, seed {}", scenario.family, scenario.seed);
    let mut laws = Laws::default();
    let (answer, diagnosis) = diagnose_observations(&seen.nominal, &seen.observations)?;
    of_rows(&mut laws, &diagnosis, &name);
    for factor in NOISE {
        let declared = seen.clone().declaring(factor);
        let (other, _) = diagnose_observations(&declared.nominal, &declared.observations)?;
        if answer.before_mm > answer.floor_mm.max(other.floor_mm) {
            let same = || {
                format!(
                    "{name}, noise x {factor}: {} instead of {}",
                    sets_or_verdict(&other),
                    sets_or_verdict(&answer)
                )
            };
            laws.ask(
                "noise is no judge",
                is_covered_by(&other, &answer) && is_covered_by(&answer, &other),
                same,
            );
        }
    }
    let mut turned = seen.observations.clone();
    turned.reverse();
    let (other, _) = diagnose_observations(&seen.nominal, &turned)?;
    let same = other.verdict == answer.verdict && other.names == answer.names;
    laws.ask("relabelling", same, || {
        format!("{name}: {} instead of {}", sets_or_verdict(&other), sets_or_verdict(&answer))
    });
    let (half, _) = diagnose_observations(&seen.nominal, &half_of_dwells(&seen.observations, scenario.seed))?;
    if !half.sets.is_empty() {
        let refuted: Vec<&str> = half.sets.iter().map(|set| set[0].as_str()).collect();
        let refuted: Vec<&str> =
            refuted.into_iter().filter(|name| is_refuted(name, &answer, &diagnosis)).collect();
        let what =
            || format!("{name}: half named {}, all of them {}", refuted.join(", "), sets_or_verdict(&answer));
        laws.ask("more is not less", refuted.is_empty(), what);
    }
    for set in &answer.sets {
        let own: BTreeSet<&str> = causes(set);
        let holds = half.sets.iter().map(|other| causes(other)).filter(|other| !other.is_disjoint(&own));
        for other in holds {
            let what = || format!("{name}: {} of half, {} of all", join_names(&other), join_names(&own));
            laws.ask("less holds more", own.is_subset(&other), what);
        }
    }
    Ok(laws)
}

/// The laws of what one diagnosis shows.
fn of_rows(laws: &mut Laws, d: &Diagnosis, name: &str) {
    let rows: Vec<_> = d.candidates.iter().filter_map(|c| Some((c.spec.as_str(), c.standing?))).collect();
    let answer = d.effects.iter().map(|e| e.name.as_str()).collect::<Vec<_>>().join("+");
    let ordered = rows.is_sorted_by(|a, b| a.1.in_answer >= b.1.in_answer);
    let shares = rows.iter().all(|(_, s)| (0.0..=1.0).contains(&s.probability))
        && rows.iter().map(|(_, s)| s.probability).sum::<f64>() <= 1.0 + 1e-9;
    let first = d.effects.is_empty() || rows.first().is_some_and(|(spec, _)| *spec == answer);
    laws.ask("one order", ordered && shares && first, || format!("{name}: {answer} and {rows:?}"));
    if d.effects.is_empty() {
        return;
    }
    let gain = d.effects.iter().map(|e| e.gain_nats).fold(0.0, f64::max);
    let detail = DiagnosisConfig::default().leftover_share * gain;
    let better = rows.iter().find(|(_, s)| is_clear(-s.behind_nats, s.behind_se, detail));
    laws.ask("no better loser", better.is_none(), || format!("{name}: {better:?} is better than {answer}"));
    if d.verdict == Verdict::Identified {
        let most = rows.iter().map(|(_, s)| s.probability).fold(0.0, f64::max);
        let is_most = rows.first().is_some_and(|(_, s)| s.probability >= most);
        laws.ask("probabilities", is_most, || format!("{name}: {rows:?}"));
    }
}

/// Whether every effect that an answer names first is of a set of the other one.
fn is_covered_by(answer: &Answer, other: &Answer) -> bool {
    let all: BTreeSet<&str> = other.sets.iter().flat_map(|set| causes(set)).collect();
    answer.sets.iter().all(|set| causes(&set[..1]).is_subset(&all))
}

/// Whether a name is of no set of an answer, and clearly behind it.
fn is_refuted(name: &str, answer: &Answer, d: &Diagnosis) -> bool {
    let name = [name.to_owned()];
    let own = causes(&name);
    let held = answer.sets.iter().any(|set| own.is_subset(&causes(set)));
    let near = d.candidates.iter().filter(|c| own == causes(std::slice::from_ref(&c.spec)));
    let stands = near.filter_map(|c| c.standing).any(|s| !is_clear(s.behind_nats, s.behind_se, 0.0));
    !held && !stands
}

/// The names of a set without the moment of an event and the value of a searched shape, which are no other cause.
fn causes(set: &[String]) -> BTreeSet<&str> {
    let place = |name| place_and_moment(name).map_or(name, |(place, _)| place);
    set.iter().filter(|name| *name != NOT_LISTED).map(|name| place(name.as_str())).collect()
}

/// Half of the dwells, drawn.
fn half_of_dwells(observations: &[Observation], seed: u64) -> Vec<Observation> {
    let mut dwells: Vec<DwellId> = observations.iter().map(|o| o.dwell).collect();
    dwells.dedup();
    dwells.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    let kept: BTreeSet<DwellId> = dwells.iter().take(dwells.len() / 2).copied().collect();
    observations.iter().filter(|o| kept.contains(&o.dwell)).cloned().collect()
}

fn sets_or_verdict(answer: &Answer) -> String {
    let sets: Vec<String> = answer.sets.iter().map(|set| set.join("|")).collect();
    if sets.is_empty() { answer.verdict.word().to_owned() } else { sets.join(" + ") }
}

fn join_names(names: &BTreeSet<&str>) -> String {
    names.iter().copied().collect::<Vec<_>>().join("|")
}
