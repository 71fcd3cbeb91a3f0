//! The catalogue as the user reads it: sizes, intervals, what could not have been seen.

use crate::bootstrap::Significance;
use crate::combination::{Combination, combination};
use crate::config::DiagnosisConfig;
use crate::confusion::{half_width, one_step, smallest_seen};
use crate::crossval::{Group, compare, left_out};
use crate::diagnosis::{BeforeAfter, CandidateReport, NotTestable, ParameterReport, Rival};
use crate::forward::Accepted;
use crate::judge::Judged;
use crate::judge::independent_groups;
use crate::problem::{Amplitude, Candidate, Problem};
use crate::weigh::Weighed;
use armcal_model::Toggle;
use nalgebra::{DMatrix, DVector};

/// Candidates whose left-out errors are shown.
const SHOWN: usize = 5;
/// A signature this much absorbed is called absorbed.
const ABSORBED: f64 = 0.9;

/// Sizes of a judged entry from the metric that explains it under white noise, and what is determined of them together.
pub(crate) fn parameters(judged: &Judged, weighed: &Weighed) -> (Vec<ParameterReport>, Option<Combination>) {
    let entry = &weighed.entries[judged.entry];
    let projection = &weighed.metrics[0].projection;
    let variance = projection.variance_without(judged.own().score);
    let fitted = one_step(&judged.gram, 1.0);
    let (amplitudes, covariance) = (&entry.candidate.amplitudes, fitted.covariance * variance);
    let sizes = sizes(amplitudes, &fitted.estimate, &covariance);
    (sizes, combination(amplitudes, &fitted.estimate, &covariance))
}

fn sizes(
    amplitudes: &[Amplitude],
    estimate: &DVector<f64>,
    covariance: &DMatrix<f64>,
) -> Vec<ParameterReport> {
    amplitudes
        .iter()
        .enumerate()
        .map(|(k, a)| {
            let value = estimate[k] * a.typical;
            let half = half_width(covariance[(k, k)].max(0.0).sqrt()) * a.typical.abs();
            ParameterReport {
                name: a.name.clone(),
                unit: a.unit,
                value,
                ci95: [value - half, value + half],
                upper_limit95: value.abs() + half,
                typical: a.typical,
            }
        })
        .collect()
}

/// An effect that must be this many times its typical size to be seen is not seen at any.
const AT_NO_SIZE: f64 = 1e3;

/// The whole catalogue against the base model, best first.
pub(crate) fn candidate_reports(
    problem: &Problem,
    weighed: &Weighed,
    top: Option<&Judged>,
    groups: &[Group],
    config: &DiagnosisConfig,
) -> Vec<CandidateReport> {
    let (crossed, projection) = (weighed.crossed(problem), &weighed.metrics[0].projection);
    let variance = projection.rss / projection.dof();
    let order = weighed.ranking();
    let before = left_out(problem, None, groups, weighed.scale);
    let none = Significance { score: 0.0, surprise: 0.0, p_raw: 1.0, p_adjusted: 1.0 };
    let mut reports = Vec::new();
    for (rank, k) in order.iter().copied().enumerate() {
        let entry = &weighed.entries[k];
        let c = &entry.candidate;
        let fitted = one_step(&entry.white, 1.0);
        let significance = top.map_or(none, |t| t.significance[k]);
        let own_variance = projection.variance_without(significance.score);
        let held = (rank < SHOWN).then(|| {
            let effect = c.columns.dense(&problem.dwells, 1.0);
            let after = left_out(problem, Some(&effect), groups, weighed.scale);
            compare(problem, &before, &after, groups, config)
        });
        let mut same: Vec<String> = c.aliases.clone();
        let smallest_seen = smallest_seen(&entry.white, variance, order.len());
        // What these motions do not show at any size looks like everything and like nothing.
        if rank < SHOWN && smallest_seen.is_finite() {
            let others = order.iter().filter(|l| **l != k).filter(|l| {
                crossed.likeness(k, &fitted.estimate, **l, own_variance).cosine > config.merge_cosine
            });
            same.extend(others.map(|l| weighed.entries[*l].candidate.spec.clone()));
        }
        reports.push(CandidateReport {
            spec: c.spec.clone(),
            effect: c.family.clone(),
            target: c.target.clone(),
            parameters: sizes(&c.amplitudes, &fitted.estimate, &(&fitted.covariance * own_variance)),
            log_evidence: entry.ln_evidence,
            probability: top.filter(|t| t.entry == k).map_or(0.0, |t| t.p_same) + entry.probability,
            p_adjusted: significance.p_adjusted,
            p_raw: significance.p_raw,
            holdout_mm: held.map(|h| BeforeAfter { before: h.before, after: h.after }),
            recording_mm: top
                .filter(|t| t.entry == k)
                .and_then(|t| t.recordings)
                .map(|h| BeforeAfter { before: h.before, after: h.after }),
            absorbed: fitted.absorbed,
            smallest_seen,
            same_to_the_data: same,
        });
    }
    reports
}

/// Puts what refits made of the only effect found, and of its rivals, in the place of what the linearised weighing has.
pub(crate) fn after_refits(reports: &mut [CandidateReport], found: &Accepted) {
    for (k, _) in &found.refits {
        let entry = &found.room.weighed.entries[*k];
        // Beside others, or in a base with curves, it was weighed anew.
        let same =
            |r: &&mut CandidateReport| r.spec == entry.candidate.spec && r.log_evidence == entry.ln_evidence;
        if let Some(report) = reports.iter_mut().find(same) {
            report.log_evidence = found.ln_evidence(*k);
            report.probability += found.probability(*k) - entry.probability;
        }
    }
    reports.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
}

/// The best listed explanation that is no other name for a found effect: how far behind, and what it does to places the
/// fit did not see.
pub(crate) fn rival(found: &Accepted, config: &DiagnosisConfig) -> Option<Rival> {
    let (judged, problem, weighed) = (&found.judged, &found.room.problem, &found.room.weighed);
    let own = &weighed.entries[judged.entry];
    let another = |k: &usize| {
        !weighed.entries[*k].candidate.holds(&own.candidate)
            && judged.set.iter().all(|s| !weighed.one_name(*s, *k))
            && found.ln_evidence(*k) > 0.0
    };
    let ahead = |a: usize, b: usize| if found.ln_evidence(b) > found.ln_evidence(a) { b } else { a };
    let k = weighed.ranking().into_iter().filter(another).reduce(ahead)?;
    let columns = &weighed.entries[k].candidate.columns;
    let groups = independent_groups(problem, weighed);
    Some(Rival {
        name: weighed.entries[k].candidate.spec.clone(),
        behind_nats: found.ln_evidence(judged.entry) - found.ln_evidence(k),
        refitted: found.refits.iter().any(|(l, _)| *l == k),
        places: weighed.gain(problem, (columns, &columns.dense(&problem.dwells, 1.0)), &groups, config),
    })
}

/// Entries whose smallest visible size exceeds the typical one.
pub(crate) fn not_testable(problem: &Problem, weighed: &Weighed) -> Vec<NotTestable> {
    let projection = &weighed.metrics[0].projection;
    // What the best explanation leaves is the noise against which sizes are seen.
    let best = weighed.ranking().first().map_or(0.0, |k| {
        let gram = &weighed.entries[*k].white;
        one_step(gram, 1.0).estimate.dot(&gram.g).max(0.0)
    });
    let variance = projection.variance_without(best);
    let mut all = Vec::new();
    for entry in weighed.entries.iter().filter(|e| !e.candidate.is_group()) {
        let (c, gram) = (&entry.candidate, &entry.white);
        let smallest = smallest_seen(gram, variance, weighed.entries.len());
        if smallest <= 1.0 {
            continue;
        }
        let size = |factor: f64| match c.amplitudes.first() {
            Some(_) if factor.is_nan() || factor > AT_NO_SIZE => "none".to_string(),
            Some(a) => format!("{:.3} {}", a.unit.to_display(a.typical * factor), a.unit.display_symbol()),
            None => String::new(),
        };
        let absorbed = one_step(gram, 1.0).absorbed;
        all.push(NotTestable {
            effect: c.spec.clone(),
            smallest_seen: size(smallest),
            typical: size(1.0),
            why: why(problem, c, gram.raw.sum(), absorbed),
        });
    }
    all
}

fn why(problem: &Problem, c: &Candidate, raw: f64, absorbed: f64) -> String {
    if raw <= 0.0 {
        return match c.toggle {
            Toggle::Direction => "the arrival directions are unknown or the joint never moves".to_string(),
            Toggle::Approach => "where the joints rested before is not known, or they never move".to_string(),
            Toggle::Load => "the load never changes".to_string(),
            Toggle::Recording => "there is one recording only".to_string(),
            Toggle::Temperature => "no temperature was recorded, or it never changed".to_string(),
            _ => "these motions do not move the tip through it".to_string(),
        };
    }
    let one_sided = c.toggle == Toggle::Direction
        && (0..problem.joints()).any(|j| {
            let signs: Vec<f64> = problem.dwells.iter().map(|d| d.arrival[j]).collect();
            !crate::drivers::varies(&signs)
        });
    match () {
        () if one_sided => "a joint always arrives from the same side".to_string(),
        () if absorbed > ABSORBED => {
            format!("the fitted geometry takes over {:.1} % of it", absorbed * 100.0)
        }
        () => "too few or too noisy dwells for its size".to_string(),
    }
}
