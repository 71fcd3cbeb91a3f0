//! Names against all that may predict as much, each refitted: which share the answer, which leads it.
//!
//! The weighing proposes, one step in the linearised model leaves the few that come near, refits decide: by their [`Score`] and
//! nothing else. An answer holds every explanation that no other one is clearly better than; first comes the simplest of those
//! within a standard error of what says most.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::judge::conditioned_problems::{ConditionedProblem, ConditionedProblems};
use crate::judge::costs::Costs;
use crate::judge::judged::Grade;
use crate::judge::score::{Score, bootstrap_weights};
use crate::problem::Candidate;
use crate::search::Search;
use crate::search::accepted::{Accepted, Instead, Scored, accepted_candidates};
use crate::search::forward::{all_but, confirm, confirmed_steps};

/// Entries that are scored in the linearised model beside a name, those that the weighing likes best.
const ALTERNATIVES: usize = 12;
/// Of these so many are refitted, where they come within this of what is clearly worse [nats].
const REFITTED: usize = 6;
const SLACK_NATS: f64 = 10.0;
/// Or within this share of what there is to gain: where a slip is large, one step is short.
const REACH_SHARE: f64 = 0.25;
/// Moments, and shapes, of one cause that are scored.
const MOMENTS: usize = 2;
/// What is not listed is told beside a name from this probability on.
const DOUBT: f64 = 0.1;
/// Rounds in which names that change their places are confirmed again.
const ROUNDS: usize = 3;

/// Settles the names of what was found.
pub(crate) fn resolve_names(
    search: &mut Search,
    conditioned_problems: &mut ConditionedProblems<'_>,
    config: &DiagnosisConfig,
) -> Result<(), DiagnoseError> {
    let begun = specs(&search.accepted);
    names_settled(search, conditioned_problems, config)?;
    if specs(&search.accepted) != begun {
        let names = accepted_candidates(&search.accepted);
        let curves = search.curves.iter().map(|c| c.candidate.clone());
        search.with_curves =
            conditioned_problems.with(&names.iter().cloned().chain(curves).collect::<Vec<_>>())?;
        search.rest = conditioned_problems.with(&names)?;
        search.left_over = search.rest.is_something_missing(config);
    }
    Ok(())
}

fn names_settled(
    search: &mut Search,
    conditioned_problems: &mut ConditionedProblems<'_>,
    config: &DiagnosisConfig,
) -> Result<(), DiagnoseError> {
    let curves: Vec<Candidate> = search.curves.iter().map(|c| c.candidate.clone()).collect();
    let beside =
        |all: &[Accepted], i: usize| [all_but(&accepted_candidates(all), i), curves.clone()].concat();
    let all = search.tentative.iter().enumerate();
    let tentative =
        all.filter_map(|(i, a)| resolve_name(a, &beside(&search.tentative, i), conditioned_problems, config));
    search.tentative = tentative.collect();
    for round in 1..=ROUNDS {
        let found = std::mem::take(&mut search.accepted);
        let before = specs(&found);
        let mut in_place =
            |i: usize| resolve_name(&found[i], &beside(&found, i), conditioned_problems, config);
        let settled_all: Vec<Option<Accepted>> = (0..found.len()).map(&mut in_place).collect();
        let standing = found.into_iter().zip(settled_all).filter_map(|(found, own)| Some((found, own?)));
        let (found, settled_all): (Vec<Accepted>, Vec<Accepted>) = standing.unzip();
        search.accepted = settled_all;
        let alone = found.len() == before.len() && found.len() < 2;
        if specs(&search.accepted) == before || alone || round == ROUNDS {
            break;
        }
        // Beside another name one of them may be needed no longer.
        let steps = confirmed_steps(&accepted_candidates(&search.accepted), &search.rest);
        let confirmed = confirm(conditioned_problems, steps, &curves, config)?;
        // Each may stand in the place of its name, and all of them not beside each other.
        let found: Vec<Accepted> =
            search.accepted.drain(..).zip(&found).map(|(own, found)| own.told_as(found)).collect();
        let mut says = |names: &[Accepted]| {
            conditioned_problems.score(&[accepted_candidates(names), curves.clone()].concat(), &search.rest)
        };
        if let (Some(as_found), Some(as_confirmed)) = (says(&found), says(&confirmed))
            && as_found.above(&as_confirmed).is_clear(config.margin_nats)
        {
            search.accepted = found;
            break;
        }
        search.accepted = confirmed;
    }
    Ok(())
}

impl Accepted {
    /// The same with the name that was found first, where the answer holds it.
    fn told_as(mut self, found: &Accepted) -> Accepted {
        let Some(at) = self.set.iter().position(|k| *k == found.judged.entry) else { return self };
        self.set[..=at].rotate_right(1);
        let (candidate, judged) = (found.candidate.clone(), found.judged.clone());
        Accepted { candidate, judged, grade: found.grade, ..self }.doubted()
    }

    /// What is not listed beside it, where that is not improbable.
    fn doubted(mut self) -> Accepted {
        if self.probability(|what| what == Instead::Unlisted) > DOUBT {
            self.grade = self.grade.min(Grade::OrUnlisted);
        }
        self
    }
}

fn specs(accepted: &[Accepted]) -> Vec<String> {
    accepted.iter().map(|a| a.candidate.spec.clone()).collect()
}

/// One of them beside the others; none where no refit says more than nothing, or nothing is the most probable.
fn resolve_name(
    found: &Accepted,
    others: &[Candidate],
    conditioned_problems: &mut ConditionedProblems<'_>,
    config: &DiagnosisConfig,
) -> Option<Accepted> {
    let conditioned = found.conditioned.clone();
    let with = |k: usize| [others, std::slice::from_ref(&conditioned.weighed.entries[k].candidate)].concat();
    let mut refits: Vec<(usize, Score)> = Vec::new();
    for k in near_entries(found, &conditioned, config) {
        refits.extend(conditioned_problems.score(&with(k), &conditioned).map(|score| (k, score)));
    }
    let nothing =
        conditioned_problems.score(others, &conditioned).unwrap_or_else(|| conditioned.nothing().clone());
    let refits = one_of_each_cause(refits, &conditioned, config);
    let (set, instead_of) = answer_set(found, &refits, &nothing, &conditioned, config);
    let (mut judged, mut grade) = (found.judged.clone(), found.grade);
    let first = *set.first()?;
    if first != judged.entry {
        judged = conditioned.judge(first, config);
        grade = judged.grade(config).max(Grade::OrUnlisted);
    }
    // One step, far from where the fit ends, may promise what no refit keeps.
    let (_, score) = refits.iter().find(|(k, _)| *k == first)?;
    let mut refitted = judged.clone();
    refitted.refitted(score.clone(), &nothing);
    if refitted.is_refuted(config) {
        return None;
    }
    // Of the shape of the name it is no other answer.
    let unlisted = judged.unlisted.as_ref().filter(|u| u.cosine <= config.merge_cosine);
    let ranked =
        score_probabilities(refits, nothing, unlisted.map(|u| u.score.clone()), &conditioned, config);
    let candidate = conditioned.weighed.entries[judged.entry].candidate.clone();
    let settled = Accepted { candidate, judged, conditioned, grade, set, instead_of, ranked }.doubted();
    (settled.probability(|what| what == Instead::Nothing) <= 0.5).then_some(settled)
}

/// The entry, and those that one step puts near the best, each name once; a group that holds another one is no other name for it.
fn near_entries(found: &Accepted, conditioned: &ConditionedProblem, config: &DiagnosisConfig) -> Vec<usize> {
    let weighed = &conditioned.weighed;
    let own = found.judged.entry;
    let mut names = vec![own];
    for k in weighed.ranking() {
        let other_moments = names.iter().filter(|n| weighed.one_cause(**n, k)).count();
        let new = !weighed.entries[k].candidate.is_group()
            && other_moments < MOMENTS
            && names.iter().all(|n| !weighed.one_name(*n, k));
        names.extend((new && names.len() < ALTERNATIVES).then_some(k));
    }
    // Its own may be that of a refit.
    let one_step =
        |k: &usize| (*k, if *k == own { found.judged.score.clone() } else { conditioned.score_of(*k) });
    let mut scored: Vec<(usize, Score)> = names.iter().map(one_step).collect();
    scored.sort_by(|a, b| 0f64.total_cmp(&a.1.above(&b.1).nats));
    let gain = found.judged.gain.nats;
    let detail = (found.judged.detail(config) + SLACK_NATS).max(REACH_SHARE * gain);
    let best = scored[0].1.clone();
    let reach = |(k, score): &(usize, Score)| *k == own || !best.above(score).is_clear(detail);
    let mut near: Vec<usize> = scored.iter().filter(|s| reach(s)).map(|(k, _)| *k).collect();
    let at = near.iter().position(|k| *k == own).unwrap_or(0);
    near[..=at].rotate_right(1);
    near.truncate(REFITTED);
    near
}

/// Those that are worth most first; of the moments, and shapes, of one cause the best stands for all.
fn one_of_each_cause(
    mut refits: Vec<(usize, Score)>,
    conditioned: &ConditionedProblem,
    config: &DiagnosisConfig,
) -> Vec<(usize, Score)> {
    let worth = |(k, score): &(usize, Score)| score.worth(conditioned.costs(config).of_entry(*k));
    refits.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
    let mut causes: Vec<usize> = Vec::new();
    refits.retain(|(k, _)| {
        let new = causes.iter().all(|known| !conditioned.weighed.one_cause(*known, *k));
        causes.extend(new.then_some(*k));
        new
    });
    refits
}

/// The entries that are one answer, the first to be told first, and the names that the user's knowledge of the arm left out.
fn answer_set(
    found: &Accepted,
    refits: &[(usize, Score)],
    nothing: &Score,
    conditioned: &ConditionedProblem,
    config: &DiagnosisConfig,
) -> (Vec<usize>, Vec<String>) {
    let of = |k: usize| &conditioned.weighed.entries[k].candidate;
    let best = refits.iter().map(|(_, score)| score.above(nothing).nats).fold(0.0, f64::max);
    let detail = config.leftover_share * best;
    let costs = conditioned.costs(config);
    let worth = |k: usize, score: &Score| score.worth(costs.of_entry(k));
    let own = refits.iter().find(|(k, _)| *k == found.judged.entry).map(|(k, score)| worth(*k, score));
    let real = |k: usize, score: &Score| {
        let mut judged = conditioned.judge(k, config);
        // What is worth more than a name that is no chance is none either, though one step may say so.
        if own.is_none_or(|own| worth(k, score) < own) {
            return judged.grade(config) > Grade::Refused;
        }
        judged.refitted(score.clone(), nothing);
        k == found.judged.entry || !judged.is_refuted(config)
    };
    let stands = |(k, score): &&(usize, Score)| {
        // What has more freedom must say more by what that costs, too.
        let freedom = |other: usize| (costs.of_entry(other) - costs.of_entry(*k)).max(0.0);
        let beats = |(l, other): &(usize, Score)| other.above(score).less(freedom(*l)).is_clear(detail);
        let beaten = refits.iter().any(beats);
        !beaten && real(*k, score) && score.above(nothing).nats >= config.margin_nats
    };
    let set = simplest_first(refits.iter().filter(stands).collect(), costs);
    let (acts, others): (Vec<usize>, Vec<usize>) = set.iter().partition(|k| of(**k).known.is_some());
    match acts.is_empty() {
        true => (set, Vec::new()),
        false => (acts, others.into_iter().map(|k| of(k).spec.clone()).collect()),
    }
}

/// Entries that are one answer, those that are worth most first: of those within a standard error of the first one, those with the
/// fewest amplitudes come first (the one-standard-error rule: Breiman, Friedman, Olshen, Stone, Classification and Regression
/// Trees, 1984).
fn simplest_first(mut members: Vec<&(usize, Score)>, costs: Costs<'_>) -> Vec<usize> {
    let Some((first, most)) = members.first().copied() else { return Vec::new() };
    members.sort_by_key(|(k, score)| {
        let behind = most.above(score).less(costs.of_entry(*first) - costs.of_entry(*k));
        if behind.nats <= behind.se { costs.amplitudes(*k) } else { usize::MAX }
    });
    members.into_iter().map(|(k, _)| *k).collect()
}

/// Everything that was scored, with its share of the probability.
fn score_probabilities(
    refits: Vec<(usize, Score)>,
    nothing: Score,
    unlisted: Option<Score>,
    conditioned: &ConditionedProblem,
    config: &DiagnosisConfig,
) -> Vec<Scored> {
    let costs = conditioned.costs(config);
    let entries = refits.into_iter().map(|(k, score)| (Instead::Entry(k), score));
    let others = std::iter::once((Instead::Nothing, nothing));
    let all: Vec<(Instead, Score)> =
        entries.chain(others).chain(unlisted.map(|score| (Instead::Unlisted, score))).collect();
    let cost = |what: Instead| match what {
        Instead::Entry(k) => costs.of_entry(k),
        Instead::Nothing => costs.of_nothing(),
        Instead::Unlisted => costs.of_unlisted(),
    };
    let scores: Vec<(&Score, f64)> = all.iter().map(|(what, score)| (score, cost(*what))).collect();
    let weights = bootstrap_weights(&scores, config);
    all.into_iter().zip(weights).map(|((what, score), weight)| Scored { what, score, weight }).collect()
}

#[cfg(test)]
#[path = "../tests/settle.rs"]
pub(crate) mod tests;
