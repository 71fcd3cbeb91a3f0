//! Effects that the search accepted, and what else may stand in their place.

use crate::config::DiagnosisConfig;
use crate::judge::conditioned_problems::ConditionedProblem;
use crate::judge::judged::{Grade, Judged};
use crate::judge::score::Score;
use crate::problem::Candidate;
use std::rc::Rc;

/// One accepted effect as judged with the others in the model.
#[derive(Debug, Clone)]
pub(crate) struct Accepted {
    /// The candidate.
    pub candidate: Candidate,
    /// Its judgement in the context of the others.
    pub judged: Judged,
    /// That context.
    pub conditioned: Rc<ConditionedProblem>,
    /// How far its name can be trusted.
    pub grade: Grade,
    /// Names that the data do not tell from it, and that the user's knowledge of the arm does.
    pub instead_of: Vec<String>,
    /// All names that are the same answer, by their entries, its own first.
    pub set: Vec<usize>,
    /// Everything that was refitted in its place.
    pub ranked: Vec<Scored>,
}

impl Accepted {
    /// Probability that its place is taken by one of these.
    pub fn probability(&self, those: impl Fn(Instead) -> bool) -> f64 {
        self.ranked.iter().filter(|scored| those(scored.what)).map(|scored| scored.weight).sum()
    }

    /// Fall of the squared residual by it beside the others, declared noise = 1.
    pub fn fall(&self) -> f64 {
        self.judged.own().score * self.conditioned.weighed.scale.powi(2)
    }

    /// Whether nothing else is clearly better beside the others.
    pub fn leads(&self, config: &DiagnosisConfig) -> bool {
        let detail = self.judged.detail(config);
        let own = &self.judged.score;
        self.conditioned
            .leading_entries(config)
            .first()
            .is_none_or(|(_, best)| !best.above(own).is_clear(detail))
    }
}

/// Their candidates.
pub(crate) fn accepted_candidates(accepted: &[Accepted]) -> Vec<Candidate> {
    accepted.iter().map(|a| a.candidate.clone()).collect()
}

/// What stands in the place of a name, beside the other names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Instead {
    /// An entry of the conditioned problem.
    Entry(usize),
    /// Nothing.
    Nothing,
    /// The best that is not listed.
    Unlisted,
}

/// One explanation and its score.
#[derive(Debug, Clone)]
pub(crate) struct Scored {
    pub what: Instead,
    pub score: Score,
    /// Share of the probability.
    pub weight: f64,
}
