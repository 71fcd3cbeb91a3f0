//! The catalogue as the user reads it: sizes, intervals, what could not have been seen.

use crate::config::DiagnosisConfig;
use crate::diagnosis::combination::{Combination, combination};
use crate::diagnosis::{BeforeAfter, CandidateReport, NotTestable, ParameterReport};
use crate::judge::bootstrap::Significance;
use crate::judge::conditioned_problems::ConditionedProblem;
use crate::judge::judged::Judged;
use crate::problem::{Amplitude, Candidate, Columns, Problem};
use crate::verdict::ranking::Explanation;
use crate::weigh::Weighed;
use crate::weigh::confusion::{half_width, one_step, smallest_seen};
use crate::weigh::crossval::{by_place, compare_left_out, left_out};
use armcal_model::Toggle;
use nalgebra::{DMatrix, DVector};

/// Candidates whose left-out errors are shown.
const SHOWN: usize = 5;
/// A signature this much absorbed is called absorbed.
const ABSORBED: f64 = 0.9;

/// Sizes of a judged entry from the metric that explains it under white noise, and what is determined of them together.
pub(crate) fn parameter_reports(
    judged: &Judged,
    weighed: &Weighed,
) -> (Vec<ParameterReport>, Option<Combination>) {
    let entry = &weighed.entries[judged.entry];
    let projection = &weighed.base;
    let variance = projection.variance_without(judged.own().score);
    let fitted = one_step(&judged.gram, 1.0);
    let (amplitudes, covariance) = (&entry.candidate.amplitudes, fitted.covariance * variance);
    let sizes = amplitude_reports(amplitudes, &fitted.estimate, &covariance);
    (sizes, combination(amplitudes, &fitted.estimate, &covariance))
}

fn amplitude_reports(
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

/// Explanations as the judge ranks them, and behind them the rest of the catalogue.
pub(crate) fn candidate_reports(
    conditioned: &ConditionedProblem,
    ranking: &[Explanation],
    top: Option<&Judged>,
    config: &DiagnosisConfig,
) -> Vec<CandidateReport> {
    let ConditionedProblem { problem, weighed, .. } = conditioned;
    let groups = by_place(problem);
    let before = left_out(problem, None, &groups, weighed.scale);
    let entry = |spec: &str| weighed.entries.iter().position(|e| e.candidate.spec == spec);
    let mut reports: Vec<CandidateReport> = Vec::new();
    for (rank, explanation) in ranking.iter().enumerate() {
        let members: Vec<usize> = explanation.effects.iter().filter_map(|spec| entry(spec)).collect();
        let alone = entry(&explanation.spec());
        let Some(of) = alone.or_else(|| members.first().copied()) else { continue };
        let mut report = of_entry(conditioned, of, top);
        report.standing = Some(explanation.standing);
        report.p_adjusted = explanation.p_adjusted;
        let whole = if alone.is_some() { vec![of] } else { members };
        if rank < SHOWN {
            let columns = |k: &usize| weighed.entries[*k].candidate.columns.clone();
            let together = Columns::Together(whole.iter().map(columns).collect()).dense(&problem.dwells, 1.0);
            let after = left_out(problem, Some(&together), &groups, weighed.scale);
            let held = compare_left_out(problem, &before, &after, &groups, config);
            report.holdout_mm = Some(BeforeAfter { before: held.before, after: held.after });
            report.same_to_the_data.extend(same_signature_specs(conditioned, of, config));
        }
        if alone.is_none() {
            report.become_several(explanation, whole.iter().map(|k| of_entry(conditioned, *k, top)));
        }
        reports.push(report);
    }
    let taken: Vec<String> = reports.iter().map(|r| r.spec.clone()).collect();
    let rest = weighed.ranking().into_iter().map(|k| of_entry(conditioned, k, top));
    reports.extend(rest.filter(|r| !taken.contains(&r.spec)));
    reports
}

/// One entry by itself: its sizes in one step, and what these data could show of it.
fn of_entry(conditioned: &ConditionedProblem, k: usize, top: Option<&Judged>) -> CandidateReport {
    let ConditionedProblem { weighed, .. } = conditioned;
    let projection = &weighed.base;
    let entry = &weighed.entries[k];
    let c = &entry.candidate;
    let fitted = one_step(&entry.gram, 1.0);
    let none = Significance { score: 0.0, surprise: 0.0, p_raw: 1.0, p_adjusted: 1.0 };
    let significance = top.map_or(none, |t| t.significance[k]);
    let own_variance = projection.variance_without(significance.score);
    let covariance = &fitted.covariance * own_variance;
    CandidateReport {
        spec: c.spec.clone(),
        effect: c.family.clone(),
        target: c.target.clone(),
        parameters: amplitude_reports(&c.amplitudes, &fitted.estimate, &covariance),
        standing: None,
        p_adjusted: significance.p_adjusted,
        holdout_mm: None,
        absorbed: fitted.absorbed,
        smallest_seen: smallest_seen(&entry.gram, projection.rss / projection.dof(), weighed.entries.len()),
        same_to_the_data: c.aliases.clone(),
    }
}

/// Other entries whose signatures are that of an entry as it was fitted.
fn same_signature_specs(conditioned: &ConditionedProblem, k: usize, config: &DiagnosisConfig) -> Vec<String> {
    let ConditionedProblem { problem, weighed, .. } = conditioned;
    let entry = &weighed.entries[k];
    let projection = &weighed.base;
    // What these motions do not show at any size looks like everything and like nothing.
    if !smallest_seen(&entry.gram, projection.rss / projection.dof(), weighed.entries.len()).is_finite() {
        return Vec::new();
    }
    let (crossed, theta) = (weighed.crossed(problem), one_step(&entry.gram, 1.0).estimate);
    let same = |l: &usize| *l != k && crossed.cosine(k, &theta, *l) > config.merge_cosine;
    let others = weighed.ranking().into_iter().filter(same);
    others.map(|l| weighed.entries[l].candidate.spec.clone()).collect()
}

impl CandidateReport {
    /// Of several effects together: their sizes by their full names, and the least that these data show of any.
    fn become_several(&mut self, explanation: &Explanation, members: impl Iterator<Item = CandidateReport>) {
        let members: Vec<CandidateReport> = members.collect();
        self.spec = explanation.spec();
        self.effect = members.iter().map(|m| m.effect.as_str()).collect::<Vec<_>>().join(Candidate::AND);
        self.target = members.iter().map(|m| m.target.as_str()).collect::<Vec<_>>().join(", ");
        let named = |m: &CandidateReport| {
            let full =
                |p: &ParameterReport| ParameterReport { name: format!("{}.{}", m.spec, p.name), ..p.clone() };
            m.parameters.iter().map(full).collect::<Vec<_>>()
        };
        self.parameters = members.iter().flat_map(named).collect();
        self.absorbed = members.iter().map(|m| m.absorbed).fold(0.0, f64::max);
        self.smallest_seen = members.iter().map(|m| m.smallest_seen).fold(0.0, f64::max);
        self.same_to_the_data = members.iter().flat_map(|m| m.same_to_the_data.clone()).collect();
    }
}

/// Entries whose smallest visible size exceeds the typical one.
pub(crate) fn not_testable(problem: &Problem, weighed: &Weighed) -> Vec<NotTestable> {
    let projection = &weighed.base;
    // What the best explanation leaves is the noise against which sizes are seen.
    let best = weighed.ranking().first().map_or(0.0, |k| {
        let gram = &weighed.entries[*k].gram;
        one_step(gram, 1.0).estimate.dot(&gram.g).max(0.0)
    });
    let variance = projection.variance_without(best);
    let mut all = Vec::new();
    for entry in weighed.entries.iter().filter(|e| !e.candidate.is_group()) {
        let (c, gram) = (&entry.candidate, &entry.gram);
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
            why: why_not_testable(problem, c, gram.raw.sum(), absorbed),
        });
    }
    all
}

fn why_not_testable(problem: &Problem, c: &Candidate, raw: f64, absorbed: f64) -> String {
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
            !crate::weigh::drivers::is_varying(&signs)
        });
    match () {
        () if one_sided => "a joint always arrives from the same side".to_string(),
        () if absorbed > ABSORBED => {
            format!("the fitted geometry takes over {:.1} % of it", absorbed * 100.0)
        }
        () => "too few or too noisy dwells for its size".to_string(),
    }
}
