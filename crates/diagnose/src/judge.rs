//! May the best candidate be named? Gate, left-out errors, rivals, pairs (notes 9).

use crate::bootstrap::{Direction, Significance, wild_cluster};
use crate::config::DiagnosisConfig;
use crate::confusion::{OneStep, Signature, half_width, one_step};
use crate::contrasts::{Contrast, contrast};
use crate::crossval::{Group, by_place, by_recording, by_stretch, gain};
use crate::evidence::{Metric, best_amplitude, coefficients};
use crate::held_out::HeldOut;
use crate::noise::Noise;
use crate::places::units;
use crate::problem::{Amplitude, Columns, Problem};
use crate::projection::Gram;
use crate::weigh::Weighed;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Dwells of a block when the noise has memory.
const BLOCK: usize = 8;
/// Fewest clusters for clustering by place alone.
const MIN_CLUSTERS: usize = 12;
/// Most clusters that are drawn: of more, neighbours keep their sign together, which says nothing else where they are
/// independent and no less where they are not.
const MOST_CLUSTERS: usize = 400;
/// Probability not worth a look.
const NEGLIGIBLE: f64 = 1e-3;

/// Everything that speaks for or against naming one entry.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    /// Index of the entry.
    pub entry: usize,
    /// Significance of every entry.
    pub significance: Vec<Significance>,
    /// Errors on places the fit did not see.
    pub places: HeldOut,
    /// Errors on recordings it did not see, where there are several.
    pub recordings: Option<HeldOut>,
    /// Indices of entries that are the same answer, the entry itself first.
    pub set: Vec<usize>,
    /// ln B(entry) - ln B(best unlisted with a channel) - what is asked for; at least 0 to be named.
    pub margin: f64,
    /// Probability of unlisted explanations whose fitted shape is another one.
    pub p_other: f64,
    /// Probability of those whose fitted shape is the entry's: the same answer without the name.
    pub p_same: f64,
    /// ln B(entry) - ln B(best unlisted explanation of another shape).
    pub above_other: f64,
    /// Paired contrast, where the design has one.
    pub contrast: Option<Contrast>,
    /// Amplitudes that are negative and cannot be.
    pub impossible: Vec<String>,
    /// Products of its columns under white noise.
    pub gram: Gram,
}

impl Judged {
    /// Its own significance.
    pub fn own(&self) -> Significance {
        self.significance[self.entry]
    }

    /// Real and not chance: evidence, gate and left-out errors agree. Says nothing about its name.
    pub fn real(&self, weighed: &Weighed, config: &DiagnosisConfig) -> bool {
        let evidence = weighed.entries[self.entry].ln_evidence >= config.margin_nats;
        evidence && self.own().p_adjusted <= config.max_p_adjusted && self.places.p < config.max_p_heldout
    }

    /// Worth trying in the model. The gate waits until the other effects are there too: what they leave behind looks
    /// like correlated noise, under which no single effect stands out.
    pub fn promising(&self, weighed: &Weighed, config: &DiagnosisConfig) -> bool {
        let evidence = weighed.entries[self.entry].ln_evidence >= config.margin_nats;
        evidence && self.own().p_raw <= config.max_p_heldout && self.places.p < config.max_p_heldout
    }

    /// How far the name can be trusted.
    pub fn grade(&self, weighed: &Weighed, config: &DiagnosisConfig) -> Grade {
        let something = 1.0 - weighed.p_nothing;
        let listed = self.p_other < 0.5 * something && self.set.len() <= config.max_set;
        if !self.real(weighed, config) || !listed {
            return Grade::Refused;
        }
        let beats = self.margin >= 0.0 && self.p_other <= (1.0 - config.credible_mass) * something;
        let disagrees = self.contrast.as_ref().is_some_and(|c| !c.agrees);
        if beats && !disagrees && self.impossible.is_empty() { Grade::Named } else { Grade::OrUnlisted }
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

/// The significance of every entry of a weighed problem, among all that was tried.
pub(crate) fn significance(
    problem: &Problem,
    weighed: &Weighed,
    config: &DiagnosisConfig,
) -> Vec<Significance> {
    let directions = gate_directions(problem, weighed);
    let clusters = clusters(problem, weighed);
    let projection = &weighed.metrics[0].projection;
    let mut all = wild_cluster(projection, &directions, (&problem.dwells, &clusters), config);
    all.truncate(weighed.entries.len());
    all
}

/// Judges an entry of a weighed problem, given the significance of all.
pub(crate) fn judge(
    problem: &Problem,
    weighed: &Weighed,
    significance: &[Significance],
    entry: usize,
    config: &DiagnosisConfig,
) -> Judged {
    let projection = &weighed.metrics[0].projection;
    let gram = weighed.entries[entry].white.clone();
    let fitted = one_step(&gram, 1.0);
    let residual_variance = projection.variance_without(significance[entry].score);
    let metric = weighed.metric_of(&weighed.entries[entry].candidate.columns, problem, config);
    let impossible = impossible(&weighed.entries[entry].candidate.amplitudes, &fitted, residual_variance);
    // What came out as no such mechanism can is no better answer than what looks the same.
    let of_shape = weighed.detail_nats(entry, config);
    let within_nats = if impossible.is_empty() { of_shape } else { f64::INFINITY };
    let own = Seen::of(&weighed.entries[entry].candidate.columns, problem, weighed, metric);
    let set = answer(problem, weighed, (metric, &own), (entry, within_nats), config);

    let columns = &weighed.entries[entry].candidate.columns;
    let effect = columns.dense(&problem.dwells, 1.0);
    let groups = independent_groups(problem, weighed);
    let places = weighed.gain(problem, (columns, &effect), &groups, config);
    let groups = by_recording(problem);
    let noise = (None, weighed.scale);
    let recordings = (groups.len() > 1).then(|| gain(problem, &effect, &groups, noise, config));

    let theta = &fitted.estimate;
    let theta_sigma = relative_sigma(&fitted, residual_variance);
    let base = &problem.residual - &problem.geometry * base_fit(problem);
    let contrast =
        contrast(problem, &base, &weighed.entries[entry].candidate, &effect, theta, theta_sigma, config);
    let Unlisted { margin, p_other, p_same, best_other } =
        against_unlisted(problem, weighed, (metric, &own), entry, config);
    let above_other = weighed.entries[entry].ln_evidence - best_other;
    Judged {
        entry,
        gram,
        significance: significance.to_vec(),
        places,
        recordings,
        set,
        margin,
        p_other,
        p_same,
        above_other,
        contrast,
        impossible,
    }
}

/// Standard deviation of an estimate along itself, in units of its size.
fn relative_sigma(fitted: &OneStep, variance: f64) -> f64 {
    let theta = &fitted.estimate;
    (variance * (theta.transpose() * &fitted.covariance * theta)[(0, 0)]).sqrt()
        / theta.norm_squared().max(1e-300)
}

/// Amplitudes of which the whole 95 % interval is negative though physics does not let them be.
fn impossible(amplitudes: &[Amplitude], fitted: &OneStep, variance: f64) -> Vec<String> {
    let below = |k: usize| {
        let high = fitted.estimate[k] + half_width((variance * fitted.covariance[(k, k)]).max(0.0).sqrt());
        amplitudes[k].never_negative && high < 0.0
    };
    (0..amplitudes.len()).filter(|k| below(*k)).map(|k| amplitudes[k].name.clone()).collect()
}

/// Projected directions of all entries, then of some points of the scans: the maximum runs over all of them.
fn gate_directions<'p>(problem: &'p Problem, weighed: &'p Weighed) -> Vec<Direction<'p>> {
    let entries = weighed.entries.iter().map(|e| (&e.candidate.columns, &e.white));
    let points =
        problem.scans.iter().zip(&weighed.points).flat_map(|(scan, points)| {
            points.iter().map(|(point, white)| (&scan.points[*point].columns, white))
        });
    entries
        .chain(points)
        .map(|(columns, white)| Direction::new(columns, 1.0 / weighed.scale, white))
        .collect()
}

/// Dwells that keep their sign together: as the noise seems to repeat.
pub(crate) fn clusters(problem: &Problem, weighed: &Weighed) -> Vec<Vec<usize>> {
    let mut groups: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    let by_place = weighed.probably(&[Noise::Place, Noise::TrackedAndPlace]);
    let by_visit = weighed.probably(&[Noise::Visit]);
    let unit = if by_place || by_visit { units(problem) } else { Vec::new() };
    for (i, d) in problem.dwells.iter().enumerate() {
        let key = if weighed.remembers() {
            (d.id.recording, d.id.dwell / BLOCK)
        } else if by_place {
            (0, unit[i])
        } else if by_visit {
            (d.id.recording, unit[i])
        } else {
            (d.id.recording, i)
        };
        groups.entry(key).or_default().push(i);
    }
    if groups.len() < MIN_CLUSTERS {
        return (0..problem.dwells.len()).map(|i| vec![i]).collect();
    }
    let groups: Vec<Vec<usize>> = groups.into_values().collect();
    groups.chunks(groups.len().div_ceil(MOST_CLUSTERS)).map(<[_]>::concat).collect()
}

/// Groups to leave out: places, or stretches of time when the noise has memory (neighbours in time would tell).
pub(crate) fn independent_groups(problem: &Problem, weighed: &Weighed) -> Vec<Group> {
    if weighed.remembers() { by_stretch(problem) } else { by_place(problem) }
}

/// Columns in the units of the weighing under one noise, and their products.
struct Seen {
    columns: DMatrix<f64>,
    gram: Gram,
}

impl Seen {
    fn of(columns: &Columns, problem: &Problem, weighed: &Weighed, metric: &Metric) -> Seen {
        let columns = metric.whitened(weighed.dense(columns, problem));
        Seen { gram: metric.projection.gram(&columns), columns }
    }
}

/// The set that is one answer: the credible set, and everything whose signature is the same.
fn answer(
    problem: &Problem,
    weighed: &Weighed,
    (metric, own): (&Metric, &Seen),
    (entry, within_nats): (usize, f64),
    config: &DiagnosisConfig,
) -> Vec<usize> {
    let fitted = one_step(&own.gram, 1.0);
    let signature = Signature::new(&own.columns, &own.gram, &fitted.estimate);
    let score = fitted.estimate.dot(&own.gram.g);
    let variance = metric.projection.variance_without(score).max(1e-12);

    let total = 1.0 - weighed.p_nothing;
    let mut order: Vec<(f64, Option<usize>)> =
        weighed.entries.iter().enumerate().map(|(k, e)| (e.probability, Some(k))).collect();
    order.push((weighed.p_unlisted, None));
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut sum, mut set) = (0.0, vec![entry]);
    for (p, who) in order {
        if sum >= config.credible_mass * total {
            break;
        }
        sum += p;
        set.extend(who.filter(|k| *k != entry));
    }
    for k in (0..weighed.entries.len()).filter(|k| *k != entry) {
        // Alike to the eye is one answer only while the evidence is: where the noise is small, the data tell apart what
        // differs by little, down to the detail of a shape that no formula of the catalogue has exactly.
        let gap = weighed.entries[entry].ln_evidence - weighed.entries[k].ln_evidence;
        if gap >= within_nats || set.contains(&k) {
            continue;
        }
        let Seen { columns, gram } =
            Seen::of(&weighed.entries[k].candidate.columns, problem, weighed, metric);
        let like = signature.likeness(&columns, &gram, variance);
        if like.cosine > config.merge_cosine || like.delta < config.min_delta {
            set.push(k);
        }
    }
    // A group holds its members: it is no other name for one of them.
    set.retain(|k| *k == entry || !weighed.entries[*k].candidate.is_group());
    set[1..].sort_by(|a, b| weighed.entries[*b].ln_evidence.total_cmp(&weighed.entries[*a].ln_evidence));
    // A second value of a shape is no second name: the value that fits best stands for it.
    let mut names: Vec<usize> = Vec::new();
    set.retain(|k| {
        let new = !names.iter().any(|n| weighed.one_name(*n, *k));
        names.extend(new.then_some(*k));
        new
    });
    set
}

/// What unlisted explanations leave of a name.
struct Unlisted {
    margin: f64,
    p_other: f64,
    p_same: f64,
    /// ln B of the best of another shape; of nothing, 0, where there is none.
    best_other: f64,
}

/// Margin of an entry over the cells, and the probabilities of unlisted explanations of another shape and of its own.
///
/// A cell holds many shapes, often the entry's own. Where its fitted shape is the entry's, it is no rival but the same
/// answer without the name, and needs no margin over it; the entry must still be more probable, unless all that the cell
/// says more is too small a part of the entry to be told from the detail of its shape.
fn against_unlisted(
    problem: &Problem,
    weighed: &Weighed,
    (metric, own): (&Metric, &Seen),
    entry: usize,
    config: &DiagnosisConfig,
) -> Unlisted {
    let projection = &metric.projection;
    let own_ln = weighed.entries[entry].ln_evidence;
    let mut told = Unlisted { margin: f64::INFINITY, p_other: 0.0, p_same: 0.0, best_other: 0.0 };
    for u in &weighed.unlisted {
        let close = u.ln_evidence > own_ln - config.margin_nats;
        if !close && u.probability < NEGLIGIBLE {
            told.margin = told.margin.min(own_ln - u.ln_evidence - config.margin_nats);
            told.best_other = told.best_other.max(u.ln_evidence);
            continue;
        }
        let Seen { columns, gram } = Seen::of(&u.what.columns, problem, weighed, metric);
        let a = best_amplitude(&gram, projection.rss, projection.dof(), config);
        let (theta, _) = coefficients(&gram, a);
        let cosine = Signature::new(&columns, &gram, &theta).likeness(&own.columns, &own.gram, 1.0).cosine;
        let same = cosine > config.merge_cosine;
        let asked = if same { 0.0 } else { config.margin_nats };
        let detail = 1.0 - cosine * cosine <= config.leftover_share;
        if u.what.channel.is_some() && !detail {
            told.margin = told.margin.min(own_ln - u.ln_evidence - asked);
        }
        if same {
            told.p_same += u.probability;
        } else {
            told.p_other += u.probability;
            told.best_other = told.best_other.max(u.ln_evidence);
        }
    }
    told
}

/// Penalised linear fit of the geometry alone.
pub(crate) fn base_fit(problem: &Problem) -> DVector<f64> {
    let mut normal = armcal_calibrate::gram(&problem.geometry);
    let mut right = problem.geometry.tr_mul(&problem.residual);
    for k in 0..right.len() {
        normal[(k, k)] += problem.geometry_precision[k];
        right[k] -= problem.geometry_precision[k] * problem.geometry_offset[k];
    }
    let factor = crate::projection::cholesky_upper(normal);
    let half = factor.tr_solve_upper_triangular(&right).unwrap_or_else(|| right.clone());
    factor.solve_upper_triangular(&half).unwrap_or(half)
}

#[cfg(test)]
#[path = "tests/judge.rs"]
mod tests;
