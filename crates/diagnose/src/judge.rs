//! May an entry be named? The gate, the score of what it predicts, what is not listed, pairs of visits.

use crate::bootstrap::{Direction, Significance, wild_cluster};
use crate::conditioned_problems::ConditionedProblem;
use crate::config::DiagnosisConfig;
use crate::confusion::{OneStep, Signature, half_width, one_step};
use crate::contrasts::{Contrast, contrast};
use crate::crossval::{by_recording, solve_cholesky};
use crate::evidence::{best_amplitude, posterior_coefficients};
use crate::places::independent_units;
use crate::problem::{Amplitude, Problem};
use crate::projection::Gram;
use crate::scatter::Scatter;
use crate::score::{Difference, Score};
use crate::weigh::Weighed;
use armcal_calibrate::HeldOut;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Dwells of a block when errors are like those before them.
const BLOCK: usize = 8;
/// Fewest clusters for clustering by place alone.
const MIN_CLUSTERS: usize = 12;
/// Most clusters that are drawn: of more, neighbours keep their sign together, which says nothing else where they are
/// independent and no less where they are not.
const MOST_CLUSTERS: usize = 400;

/// Everything that speaks for or against naming one entry.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    /// Index of the entry.
    pub entry: usize,
    /// Significance of every entry.
    pub significance: Vec<Significance>,
    /// Score with it in the linearised model, and by how much it is more than that of nothing.
    pub score: Score,
    pub gain: Difference,
    /// What it must gain [nats]: the margin for each of its amplitudes.
    pub cost_nats: f64,
    /// Errors on places the fit did not see.
    pub places: HeldOut,
    /// Errors on recordings it did not see, where there are several.
    pub recordings: Option<HeldOut>,
    /// The best that is not listed.
    pub unlisted: Option<Unlisted>,
    /// Paired contrast, where the design has one.
    pub contrast: Option<Contrast>,
    /// Amplitudes that are negative and cannot be.
    pub impossible: Vec<String>,
    /// Products of its columns.
    pub gram: Gram,
}

/// What is not listed, beside a name.
#[derive(Debug, Clone)]
pub(crate) struct Unlisted {
    /// Its score in the linearised model, and by how much it is more than that of the name.
    pub score: Score,
    pub above: Difference,
    /// Cosine between its fitted shape and the nearest one of the name.
    pub cosine: f64,
}

impl Judged {
    /// Its own significance.
    pub fn own(&self) -> Significance {
        self.significance[self.entry]
    }

    /// Real and not chance: gate and score agree. Says nothing about its name.
    pub fn real(&self, config: &DiagnosisConfig) -> bool {
        self.own().p_adjusted <= config.max_p_adjusted && self.predicts(config)
    }

    /// Worth trying in the model. The gate waits until the other effects are there too: what they leave behind looks
    /// like correlated noise, under which no single effect stands out.
    pub fn promising(&self, config: &DiagnosisConfig) -> bool {
        self.own().p_raw <= config.max_p_heldout && self.predicts(config)
    }

    /// Whether it says more than nothing of dwells that the fit did not see: clearly over the groups, or, as an event of a few
    /// dwells does, in places that are few but agree.
    fn predicts(&self, config: &DiagnosisConfig) -> bool {
        let in_few = self.gain.nats >= self.cost_nats.max(self.gain.se);
        match self.gain.is_clear(self.cost_nats) {
            true => self.places.p < config.max_p_heldout,
            false => in_few && self.places.p <= config.max_p_adjusted,
        }
    }

    /// The best that is not listed and has another shape.
    fn other_shape(&self, config: &DiagnosisConfig) -> Option<&Unlisted> {
        self.unlisted.as_ref().filter(|u| u.cosine <= config.merge_cosine)
    }

    /// Whether what is not listed is clearly better.
    pub fn is_refuted(&self, config: &DiagnosisConfig) -> bool {
        self.other_shape(config).is_some_and(|u| u.above.is_clear(self.detail(config)))
    }

    /// Takes the score of its refit in place of that of one step, beside nothing and the unlisted.
    pub fn refitted(&mut self, score: Score, nothing: &Score) {
        self.gain = score.above(nothing);
        if let Some(unlisted) = &mut self.unlisted {
            unlisted.above = unlisted.score.above(&score);
        }
        self.score = score;
    }

    /// How far the name can be trusted.
    pub fn grade(&self, config: &DiagnosisConfig) -> Grade {
        if !self.real(config) || self.is_refuted(config) {
            return Grade::Refused;
        }
        // An unlisted shape has more freedom: only what says more is another answer.
        let as_good = self.other_shape(config).is_some_and(|u| u.above.nats > 0.0);
        let disagrees = self.contrast.as_ref().is_some_and(|c| !c.agrees);
        if as_good || disagrees || !self.impossible.is_empty() { Grade::OrUnlisted } else { Grade::Named }
    }

    /// Score that is no more than the detail of a shape: masses, radii and stiffnesses are never quite those of a formula, so that
    /// a small share of what there is to explain goes to whatever happens to have the detail [nats].
    pub fn detail(&self, config: &DiagnosisConfig) -> f64 {
        config.leftover_share * self.gain.nats
    }
}

/// How far a name can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Grade {
    /// Not real, or something unlisted is more probable.
    Refused,
    /// Real and listed, but something unlisted cannot be excluded, pairs of visits disagree, or it is negative where it cannot
    /// be.
    OrUnlisted,
    /// The set holds the name.
    Named,
}

/// The significance of every entry of a conditioned problem, among all that was tried.
pub(crate) fn significance(conditioned: &ConditionedProblem, config: &DiagnosisConfig) -> Vec<Significance> {
    let ConditionedProblem { problem, weighed, .. } = conditioned;
    let directions = gate_directions(problem, weighed);
    let clusters = clusters(problem, &conditioned.scatter);
    let mut all = wild_cluster(&weighed.base, &directions, (&problem.dwells, &clusters), config);
    all.truncate(weighed.entries.len());
    all
}

/// Judges an entry of a conditioned problem, given the significance of all.
pub(crate) fn judge(
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
    let base = &problem.residual - &problem.geometry * base_fit(problem, &normal, weighed.scale);
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

/// Penalised linear fit of the geometry alone, whose products are known, with noise of `scale` times the declared one.
pub(crate) fn base_fit(problem: &Problem, products: &DMatrix<f64>, scale: f64) -> DVector<f64> {
    let mut normal = products.clone();
    let mut right = problem.geometry.tr_mul(&problem.residual);
    for k in 0..right.len() {
        let precision = problem.geometry_precision[k] * scale.powi(2);
        normal[(k, k)] += precision;
        right[k] -= precision * problem.geometry_offset[k];
    }
    solve_cholesky(&crate::projection::cholesky_upper(normal), &right)
}

#[cfg(test)]
#[path = "tests/judge.rs"]
mod tests;
