//! What an explanation costs before it may be the answer: its freedom, and that it was picked among many.

use crate::config::DiagnosisConfig;
use crate::judge::conditioned_problems::ConditionedProblem;
use crate::weigh::Outside;

/// Amplitudes that a size of the wrong sign counts as: what came out as no such mechanism can is told after what could be.
const IMPOSSIBLE: usize = 2;
/// What is not listed counts as so many amplitudes.
const UNLISTED: usize = 4;

/// Costs in a conditioned problem [nats]: [`DiagnosisConfig::margin_nats`] for each amplitude, and -ln of the prior, which the entries of the
/// catalogue, and what is not listed, share evenly, and the values of a shape that was searched share that of their entry.
#[derive(Clone, Copy)]
pub(crate) struct Costs<'r> {
    pub conditioned: &'r ConditionedProblem,
    pub config: &'r DiagnosisConfig,
}

impl Costs<'_> {
    pub fn of_nothing(self) -> f64 {
        -self.config.prior_nothing.ln()
    }

    pub fn of_unlisted(self) -> f64 {
        self.of(UNLISTED, self.config.prior_unknown, self.conditioned.weighed.unlisted.len())
    }

    /// Of an entry of the catalogue.
    pub fn of_entry(self, k: usize) -> f64 {
        let entries = &self.conditioned.weighed.entries;
        self.of(self.amplitudes(k), self.config.prior_catalogue, entries.len() * entries[k].tried)
    }

    /// What an entry of the catalogue counts as.
    pub fn amplitudes(self, k: usize) -> usize {
        let impossible = !self.conditioned.judge(k, self.config).impossible.is_empty();
        self.conditioned.weighed.amplitudes(k) + if impossible { IMPOSSIBLE } else { 0 }
    }

    fn of(self, amplitudes: usize, prior: f64, count: usize) -> f64 {
        self.config.margin_nats * amplitudes as f64 - (prior / count.max(1) as f64).ln()
    }
}

impl ConditionedProblem {
    /// What explanations cost beside each other [nats].
    pub fn costs<'r>(&'r self, config: &'r DiagnosisConfig) -> Costs<'r> {
        Costs { conditioned: self, config }
    }

    /// Whether something that is not listed says clearly more than nothing, and than what it costs, of dwells that the fit did not
    /// see; and not by a few folds alone, as accidents let it.
    pub fn predicts(&self, unlisted: &Outside, config: &DiagnosisConfig) -> bool {
        let (costs, ConditionedProblem { problem, weighed, .. }) = (self.costs(config), self);
        let effect = weighed.regularised(&unlisted.what.columns, problem, config);
        let score = self.score_with(&effect).above(self.nothing());
        score.is_clear(costs.of_unlisted() - costs.of_nothing())
            && weighed.gain(problem, &effect, &self.exam().folds, config).p <= config.max_p_adjusted
    }

    /// Whether something without a name is missing: improbable as nothing, and a shape that is not listed says more of dwells that
    /// the fit did not see.
    pub fn is_something_missing(&self, config: &DiagnosisConfig) -> bool {
        self.weighed.p_nothing < config.max_probability_nothing
            && self.best_unlisted(config).is_some_and(|(best, _)| self.predicts(best, config))
    }
}
