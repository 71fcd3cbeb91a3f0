//! Every explanation that was scored, in one order: the answer first, then what may stand in its place.

use crate::config::DiagnosisConfig;
use crate::diagnosis::Standing;
use crate::judge::conditioned_problems::{ConditionedProblem, ConditionedProblems};
use crate::judge::score::{Score, bootstrap_weights};
use crate::problem::Candidate;
use crate::search::Search;
use crate::search::accepted::{Accepted, Instead};

/// Effects that explain the data together.
#[derive(Debug, Clone)]
pub(crate) struct Explanation {
    /// Their names.
    pub effects: Vec<String>,
    pub standing: Standing,
    /// Family-wise p-value; of several the largest.
    pub p_adjusted: f64,
}

impl Explanation {
    /// Their names as one.
    pub fn spec(&self) -> String {
        self.effects.join(Candidate::AND)
    }
}

/// The explanations in their order, and the probabilities of nothing and of what is not listed.
#[derive(Debug)]
pub(crate) struct Ranking {
    pub explanations: Vec<Explanation>,
    pub p_nothing: f64,
    pub p_unlisted: f64,
}

impl Ranking {
    /// Of a search that began in `conditioned`, the one without effects.
    pub fn of(
        search: &Search,
        conditioned: &ConditionedProblem,
        conditioned_problems: &mut ConditionedProblems<'_>,
        config: &DiagnosisConfig,
    ) -> Ranking {
        match search.accepted.is_empty() {
            true => Ranking::of_nothing(conditioned, config),
            false => Ranking::of_answer(&search.accepted, conditioned, conditioned_problems, config),
        }
    }

    /// Where no name was found: what came nearest, by itself.
    fn of_nothing(conditioned: &ConditionedProblem, config: &DiagnosisConfig) -> Ranking {
        let listed = conditioned.leading_entries(config);
        let unlisted = conditioned.best_unlisted(config).map(|(_, score)| score);
        let costs = conditioned.costs(config);
        let mut scores = vec![(conditioned.nothing(), costs.of_nothing())];
        scores.extend(unlisted.iter().map(|score| (score, costs.of_unlisted())));
        scores.extend(listed.iter().map(|(k, score)| (score, costs.of_entry(*k))));
        let weights = bootstrap_weights(&scores, config);
        let others = 1 + usize::from(unlisted.is_some());
        let mut rows: Vec<(&(usize, Score), &f64)> = listed.iter().zip(&weights[others..]).collect();
        rows.sort_by(|a, b| b.1.total_cmp(a.1));
        let best = rows.first().map(|row| row.0.1.clone());
        let row = |((k, score), weight): (&(usize, Score), &f64)| Explanation {
            effects: vec![conditioned.weighed.entries[*k].candidate.spec.clone()],
            standing: Standing::of(best.as_ref().unwrap_or(score), score, *weight, false),
            p_adjusted: conditioned.judge(*k, config).own().p_adjusted,
        };
        Ranking {
            explanations: rows.into_iter().map(row).collect(),
            p_nothing: weights[0],
            p_unlisted: weights[1..others].iter().sum(),
        }
    }

    fn of_answer(
        accepted: &[Accepted],
        conditioned: &ConditionedProblem,
        conditioned_problems: &mut ConditionedProblems<'_>,
        config: &DiagnosisConfig,
    ) -> Ranking {
        let answer: Vec<Candidate> = accepted.iter().map(|a| a.candidate.clone()).collect();
        let scored = conditioned_problems.score(&answer, conditioned);
        let shares: Vec<f64> =
            accepted.iter().map(|a| a.probability(|w| w == Instead::Entry(a.judged.entry))).collect();
        let of_others = |i: usize| -> f64 {
            shares.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, share)| share).product()
        };
        let mut explanations = Vec::new();
        let row =
            |effects: &[Candidate], p_adjusted: f64, score: &Score, probability: f64, in_answer: bool| {
                Explanation {
                    effects: effects.iter().map(|c| c.spec.clone()).collect(),
                    standing: Standing::of(scored.as_ref().unwrap_or(score), score, probability, in_answer),
                    p_adjusted,
                }
            };
        let p_of = |a: &Accepted, k: usize| a.judged.significance[k].p_adjusted;
        let p_others = |i: usize| {
            let others = accepted.iter().enumerate().filter(|(k, _)| *k != i);
            others.map(|(_, a)| p_of(a, a.judged.entry)).fold(0.0, f64::max)
        };
        let p_all = p_others(accepted.len());
        explanations.extend(scored.iter().map(|own| row(&answer, p_all, own, shares.iter().product(), true)));
        for (i, a) in accepted.iter().enumerate() {
            for other in &a.ranked {
                let Instead::Entry(k) = other.what else { continue };
                if k == a.judged.entry {
                    continue;
                }
                let mut swapped = answer.clone();
                swapped[i] = a.conditioned.weighed.entries[k].candidate.clone();
                let score = conditioned_problems.score(&swapped, conditioned);
                let probability = other.weight * of_others(i);
                let p = p_others(i).max(p_of(a, k));
                explanations.extend(score.map(|s| row(&swapped, p, &s, probability, a.set.contains(&k))));
            }
        }
        for (k, score) in conditioned.leading_entries(config) {
            let alone = std::slice::from_ref(&conditioned.weighed.entries[k].candidate);
            let known = explanations.iter().any(|e| e.spec() == alone[0].spec);
            let p = conditioned.judge(k, config).own().p_adjusted;
            explanations.extend((!known).then(|| row(alone, p, &score, 0.0, false)));
        }
        let of_answer = |e: &Explanation| e.standing.in_answer;
        // The answer stays first; where it could not be scored there is none, and there may be nothing at all.
        explanations[usize::from(scored.is_some())..].sort_by(|a, b| {
            let (p, q) = (&a.standing, &b.standing);
            let behind = p.behind_nats.total_cmp(&q.behind_nats);
            of_answer(b).cmp(&of_answer(a)).then(q.probability.total_cmp(&p.probability)).then(behind)
        });
        let without: f64 = accepted.iter().map(|a| a.probability(|w| w == Instead::Nothing)).product();
        let unlisted = accepted.iter().map(|a| a.probability(|w| w == Instead::Unlisted)).fold(0.0, f64::max);
        Ranking { explanations, p_nothing: without, p_unlisted: unlisted }
    }
}

impl Standing {
    fn of(answer: &Score, own: &Score, probability: f64, in_answer: bool) -> Standing {
        let behind = answer.above(own);
        Standing { behind_nats: behind.nats, behind_se: behind.se, probability, in_answer }
    }
}

#[cfg(test)]
#[path = "../tests/ranking.rs"]
mod tests;
