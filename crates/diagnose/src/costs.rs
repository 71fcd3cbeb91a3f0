//! What an explanation costs before it may be the answer: its freedom, and that it was picked among many.

use crate::conditioned_problems::ConditionedProblem;
use crate::config::DiagnosisConfig;

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
