//! May an entry be named? The gate, the score of what it predicts, what is not listed, pairs of visits.

pub(crate) mod bootstrap;
pub(crate) mod conditioned_problems;
pub(crate) mod contrasts;
pub(crate) mod costs;
pub(crate) mod density;
pub(crate) mod judged;
pub(crate) mod refit;
pub(crate) mod score;

use crate::config::DiagnosisConfig;
use crate::judge::bootstrap::{Direction, Significance, wild_cluster};
use crate::judge::conditioned_problems::ConditionedProblem;
use crate::judge::contrasts::contrast;
use crate::judge::judged::{Judged, Unlisted};
use crate::judge::score::Score;
use crate::problem::places::independent_units;
use crate::problem::{Amplitude, Problem};
use crate::weigh::Weighed;
use crate::weigh::confusion::{OneStep, Signature, half_width, one_step};
use crate::weigh::crossval::by_recording;
use crate::weigh::evidence::{best_amplitude, posterior_coefficients};
use crate::weigh::scatter::Scatter;
use std::collections::BTreeMap;

/// Dwells of a block when errors are like those before them.
const BLOCK: usize = 8;
/// Fewest clusters for clustering by place alone.
const MIN_CLUSTERS: usize = 12;
/// Most clusters that are drawn: of more, neighbours keep their sign together, which says nothing else where they are
/// independent and no less where they are not.
const MOST_CLUSTERS: usize = 400;

/// The significance of every entry of a conditioned problem, among all that was tried.
pub(crate) fn significance(conditioned: &ConditionedProblem, config: &DiagnosisConfig) -> Vec<Significance> {
    let ConditionedProblem { problem, weighed, .. } = conditioned;
    let directions = gate_directions(problem, weighed);
    let clusters = clusters(problem, &conditioned.scatter);
    let mut all = wild_cluster(&weighed.base, &directions, (&problem.dwells, &clusters), config);
    all.truncate(weighed.entries.len());
    all
}

impl ConditionedProblem {
    /// Judges an entry, once.
    pub fn judge(&self, entry: usize, config: &DiagnosisConfig) -> Judged {
        if let Some(done) = self.judged.borrow().get(&entry) {
            return done.clone();
        }
        let significance = self.significance.get_or_init(|| significance(self, config));
        let judged = judge(self, significance, entry, config);
        self.judged.borrow_mut().insert(entry, judged.clone());
        judged
    }
}

/// Judges an entry of a conditioned problem, given the significance of all.
fn judge(
    conditioned: &ConditionedProblem,
    significance: &[Significance],
    entry: usize,
    config: &DiagnosisConfig,
) -> Judged {
    let ConditionedProblem { problem, weighed, .. } = conditioned;
    let projection = &weighed.base;
    let gram = weighed.entries[entry].gram.clone();
    let fitted = one_step(&gram, 1.0);
    let residual_variance = projection.variance_without(significance[entry].score);
    let candidate = &weighed.entries[entry].candidate;
    let impossible = negative_amplitudes(&candidate.amplitudes, &fitted, residual_variance);

    let columns = &candidate.columns;
    let effect = columns.dense(&problem.dwells, 1.0);
    let score = conditioned.score_of(entry);
    let places = weighed.gain(problem, &effect, &conditioned.exam().folds, config);
    let groups = by_recording(problem);
    let recordings = (groups.len() > 1).then(|| weighed.gain(problem, &effect, &groups, config));

    let theta = &fitted.estimate;
    let theta_sigma = relative_sigma(&fitted, residual_variance);
    let normal = armcal_calibrate::gram(&problem.geometry);
    let base = &problem.residual - &problem.geometry * problem.base_fit(&normal, weighed.scale);
    let contrast = contrast(problem, &base, candidate, &effect, theta, theta_sigma, config);
    let unlisted = Unlisted::beside(conditioned, entry, &score, config);
    let gain = score.above(conditioned.nothing());
    let significance = significance.to_vec();
    let cost_nats = config.margin_nats * weighed.amplitudes(entry) as f64;
    Judged {
        entry,
        significance,
        score,
        gain,
        cost_nats,
        places,
        recordings,
        unlisted,
        contrast,
        impossible,
        gram,
    }
}

impl Unlisted {
    /// The best of a conditioned problem beside an entry of this score.
    fn beside(
        conditioned: &ConditionedProblem,
        entry: usize,
        own: &Score,
        config: &DiagnosisConfig,
    ) -> Option<Unlisted> {
        let ConditionedProblem { problem, weighed, .. } = conditioned;
        let (best, score) = conditioned.best_unlisted(config)?;
        let above = score.above(own);
        let columns = weighed.dense(&best.what.columns, problem);
        let gram = weighed.base.gram(&columns);
        let (theta, _) = posterior_coefficients(&gram, best_amplitude(&gram, &weighed.base, config));
        let name = &weighed.entries[entry];
        let of_name = weighed.dense(&name.candidate.columns, problem);
        let cosine = Signature::new(&columns, &gram, &theta).cosine(&of_name, &name.gram);
        Some(Unlisted { score, above, cosine })
    }
}

/// Standard deviation of an estimate along itself, in units of its size.
fn relative_sigma(fitted: &OneStep, variance: f64) -> f64 {
    let theta = &fitted.estimate;
    (variance * (theta.transpose() * &fitted.covariance * theta)[(0, 0)]).sqrt()
        / theta.norm_squared().max(1e-300)
}

/// Amplitudes of which the whole 95 % interval is negative though physics does not let them be.
fn negative_amplitudes(amplitudes: &[Amplitude], fitted: &OneStep, variance: f64) -> Vec<String> {
    let below = |k: usize| {
        let high = fitted.estimate[k] + half_width((variance * fitted.covariance[(k, k)]).max(0.0).sqrt());
        amplitudes[k].never_negative && high < 0.0
    };
    (0..amplitudes.len()).filter(|k| below(*k)).map(|k| amplitudes[k].name.clone()).collect()
}

/// Projected directions of all entries, then of some points of the scans: the maximum runs over all of them.
fn gate_directions<'p>(problem: &'p Problem, weighed: &'p Weighed) -> Vec<Direction<'p>> {
    let entries = weighed.entries.iter().map(|e| (&e.candidate.columns, &e.gram));
    let points =
        problem.scans.iter().zip(&weighed.points).flat_map(|(scan, points)| {
            points.iter().map(|(point, white)| (&scan.points[*point].columns, white))
        });
    entries
        .chain(points)
        .map(|(columns, white)| Direction::new(columns, 1.0 / weighed.scale, white))
        .collect()
}

/// Dwells that keep their sign together: as errors seem to repeat.
pub(crate) fn clusters(problem: &Problem, scatter: &Scatter) -> Vec<Vec<usize>> {
    let mut groups: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    let unit = if scatter.repeats() { independent_units(problem) } else { Vec::new() };
    for (i, d) in problem.dwells.iter().enumerate() {
        let key = match unit.get(i) {
            _ if scatter.remembers() => (d.id.recording, d.id.dwell / BLOCK),
            Some(unit) => (0, *unit),
            None => (d.id.recording, i),
        };
        groups.entry(key).or_default().push(i);
    }
    if groups.len() < MIN_CLUSTERS {
        return (0..problem.dwells.len()).map(|i| vec![i]).collect();
    }
    let groups: Vec<Vec<usize>> = groups.into_values().collect();
    groups.chunks(groups.len().div_ceil(MOST_CLUSTERS)).map(<[_]>::concat).collect()
}

#[cfg(test)]
#[path = "../tests/judge.rs"]
mod tests;
