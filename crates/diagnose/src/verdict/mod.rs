//! The linear core as one call: from a problem (and a way to refit it) to the whole diagnosis.

pub(crate) mod conclude;
pub(crate) mod next;
pub(crate) mod outliers;
pub(crate) mod ranking;
pub(crate) mod reports;
pub(crate) mod unexplained;

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::config::RESAMPLINGS;
use crate::diagnosis::{
    BeforeAfter, CandidateReport, Diagnosis, FoundEffect, JudgedOn, NOT_LISTED, NotTestable, Rival,
    SignificanceTest, UnknownReport, Verdict,
};
use crate::events::{simultaneous_events, temporary_since};
use crate::judge::conditioned_problems::{ConditionedProblem, ConditionedProblems};
use crate::judge::judged::Grade;
use crate::judge::refit::Refit;
use crate::problem::{Candidate, Part, Problem};
use crate::search::accepted::{Accepted, Instead, accepted_candidates};
use crate::search::settle::resolve_names;
use crate::search::{Search, from_nothing, search};
use crate::unlisted::unknown_report;
use crate::verdict::outliers::{Cleaned, flipped_arrivals, set_aside};
use crate::verdict::ranking::Ranking;
use crate::verdict::reports::{candidate_reports, not_testable, parameter_reports};
use crate::weigh::Weighed;
use crate::weigh::crossval::{by_place, errors_m, left_out};
use crate::weigh::scatter::Scatter;
use armcal_core::{Code, DwellId, Severity, Stage, Warning, list_names};
use armcal_model::{Toggle, find};
use nalgebra::DVector;
use std::collections::BTreeSet;

/// Noise this far above the declaration is worth a word.
const SIGMA_RATIO: f64 = 1.4;
/// So is noise that much below it.
const OVERDECLARED: f64 = 2.0;
/// Families that displace what is measured, whatever the joints do.
const SHIFTS: [&str; 4] = ["tool_shift", "frame_shift", "marker_shift", "tip_marker_shift"];

/// Diagnoses a problem. `refit` gives it, and gives it again with effects in the base model.
pub fn diagnose_problem(refit: &mut dyn Refit, config: &DiagnosisConfig) -> Result<Diagnosis, DiagnoseError> {
    diagnose_beyond(refit, &[], config)
}

/// The names of a search through a problem of some of the dwells, to begin with in the problem of all.
pub(crate) fn propose_candidates(
    refit: &mut dyn Refit,
    config: &DiagnosisConfig,
) -> Result<Vec<Candidate>, DiagnoseError> {
    let config = &DiagnosisConfig { resamplings: config.resamplings.min(RESAMPLINGS), ..config.clone() };
    let whole = refit.problem(&[])?;
    whole.check()?;
    let Cleaned { keep, problem, weighed, .. } = set_aside(whole.evaluable(&mut BTreeSet::new()), config);
    let mut conditioned_problems = ConditionedProblems::new(refit, keep, (problem, weighed), config);
    Ok(accepted_candidates(&from_nothing(&mut conditioned_problems, config)?.accepted))
}

/// [`diagnose_problem`] with names that were `proposed`.
pub(crate) fn diagnose_beyond(
    refit: &mut dyn Refit,
    proposed: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<Diagnosis, DiagnoseError> {
    config.check()?;
    let whole = refit.problem(&[])?;
    whole.check()?;
    let mut dropped = BTreeSet::new();
    let Cleaned { keep, aside, problem, weighed } = set_aside(whole.evaluable(&mut dropped), config);
    let dwells = keep.len();
    let mut conditioned_problems = ConditionedProblems::new(refit, keep, (problem, weighed), config);
    conditioned_problems.dropped = dropped;
    let mut search = search(&mut conditioned_problems, proposed, config)?;
    resolve_names(&mut search, &mut conditioned_problems, config)?;
    let conditioned = conditioned_problems.with(&[])?;
    let ranking = Ranking::of(&search, &conditioned, &mut conditioned_problems, config);
    let before = Before::of(&conditioned, ranking, config);
    let mut diagnosis = assemble(before, (dwells, aside), &search, config);
    diagnosis.warnings.extend(not_evaluated(&conditioned_problems.dropped));
    Ok(diagnosis)
}

/// That some candidates had no part in the choice.
fn not_evaluated(dropped: &BTreeSet<String>) -> Option<Warning> {
    let names: Vec<String> = dropped.iter().cloned().collect();
    let message = format!(
        "{} had no part in the choice: a derivative is no number here, or the model with it cannot be fitted",
        list_names(&names)
    );
    let notice =
        || Warning::new(Severity::Notice, Stage::Diagnose, Code::NotEvaluated, list_names(&names), message);
    (!names.is_empty()).then(notice)
}

/// What is told of the model without effects.
struct Before {
    p_nothing: f64,
    p_unlisted: f64,
    /// Of the best entry.
    p_adjusted: f64,
    tried_unlisted: usize,
    candidates: Vec<CandidateReport>,
    cannot_tell_apart: Vec<[String; 2]>,
    not_testable: Vec<NotTestable>,
    floor_mm: f64,
    error_mm: f64,
}

impl Before {
    fn of(conditioned: &ConditionedProblem, ranking: Ranking, config: &DiagnosisConfig) -> Before {
        let ConditionedProblem { problem, weighed, .. } = conditioned;
        let top = weighed.ranking().first().map(|top| conditioned.judge(*top, config));
        let top = top.as_ref();
        Before {
            p_nothing: ranking.p_nothing,
            p_unlisted: ranking.p_unlisted,
            p_adjusted: top.map_or(1.0, |t| t.own().p_adjusted),
            tried_unlisted: weighed.unlisted.len(),
            candidates: candidate_reports(conditioned, &ranking.explanations, top, config),
            cannot_tell_apart: confusable_pairs(problem, weighed, config),
            not_testable: not_testable(problem, weighed),
            floor_mm: floor_mm(problem),
            error_mm: error_mm(problem, weighed),
        }
    }
}

fn assemble(
    before: Before,
    (dwells, aside): (usize, Vec<DwellId>),
    search: &Search,
    config: &DiagnosisConfig,
) -> Diagnosis {
    let effects: Vec<FoundEffect> = search.accepted.iter().map(|a| found_effect(a, config)).collect();
    let verdict = if search.left_over { Verdict::Unknown } else { Verdict::NothingMissing };
    let (rest, with_curves) = (&search.rest, &search.with_curves);
    let mut unlisted: Vec<UnknownReport> = search.curves.iter().map(|c| c.report.clone()).collect();
    if search.left_over && unlisted.is_empty() {
        unlisted.extend(unknown_report(rest, config));
    }
    let probability = if search.left_over { before.p_unlisted } else { before.p_nothing };
    let left = with_curves.weighed.base.projected_residual();
    let noise = with_curves.weighed.scatter_of(&with_curves.problem, &left);
    let mut diagnosis = Diagnosis {
        verdict,
        names: Vec::new(),
        probability: Some(probability),
        p_adjusted: before.p_adjusted,
        candidates: before.candidates,
        cannot_tell_apart: before.cannot_tell_apart,
        not_testable: before.not_testable,
        record_next: Vec::new(),
        p_nothing: before.p_nothing,
        tried_unlisted: before.tried_unlisted,
        rest_may_be_shape: search.may_be_shape,
        floor_mm: before.floor_mm,
        repeatability_mm: None,
        judged: JudgedOn::Linearised,
        unexplained: None,
        refitted: None,
        holdout_mm: BeforeAfter {
            before: before.error_mm,
            after: error_mm(&with_curves.problem, &with_curves.weighed),
        },
        warnings: warnings(&noise, &aside, dwells, search, config),
        noise,
        set_aside: aside,
        tentative: search.tentative.iter().map(|a| found_effect(a, config)).collect(),
        effects,
        unknown: unlisted.first().cloned(),
        unlisted,
        gate: SignificanceTest { resamplings: config.resamplings, max_p_adjusted: config.max_p_adjusted },
        nested: None,
        not_chosen_again: None,
    };
    diagnosis.name_again();
    // The dwells are the same in all conditioned problems.
    diagnosis.record_next = next::record_next(&rest.problem, &diagnosis);
    diagnosis
}

/// Mean error of places that the fit did not see [mm].
fn error_mm(problem: &Problem, weighed: &Weighed) -> f64 {
    let errors = errors_m(problem, &left_out(problem, None, &by_place(problem), weighed.scale));
    errors.iter().map(|e| e.sum_m).sum::<f64>() / errors.iter().map(|e| e.count).sum::<f64>().max(1.0) * 1e3
}

/// Mean error that the declared noise alone gives [mm].
fn floor_mm(problem: &Problem) -> f64 {
    let expected_m = |part: &Part| {
        let covariance_m2 = &part.metres * part.metres.transpose();
        armcal_calibrate::expected_norm_m(&covariance_m2.fixed_view::<3, 3>(0, 0).into_owned())
    };
    let expected_m: Vec<f64> = problem.dwells.iter().flat_map(|d| &d.parts).map(expected_m).collect();
    expected_m.iter().sum::<f64>() / expected_m.len().max(1) as f64 * 1e3
}

fn found_effect(a: &Accepted, config: &DiagnosisConfig) -> FoundEffect {
    let (judged, weighed) = (&a.judged, &a.conditioned.weighed);
    let name = |k: &usize| weighed.entries[*k].candidate.spec.clone();
    let mut set: Vec<String> = a.set.iter().map(name).collect();
    if a.grade == Grade::OrUnlisted || seen_by_the_sensor_alone(a) {
        set.push(NOT_LISTED.to_string());
    }
    let probability = a.probability(|what| matches!(what, Instead::Entry(k) if a.set.contains(&k)));
    let (parameters, combination) = parameter_reports(judged, weighed);
    FoundEffect {
        name: name(&judged.entry),
        set,
        probability: probability.min(1.0),
        p_adjusted: judged.own().p_adjusted,
        gain_nats: judged.gain.nats,
        gain_se: judged.gain.se,
        above_unlisted_nats: judged.unlisted.as_ref().map(|u| -u.above.nats),
        parameters,
        combination,
        places: judged.places,
        recordings: judged.recordings,
        contrast: judged.contrast.clone(),
        rival: rival(a, config),
    }
}

/// The best listed explanation that is no name of a found effect: how far behind, and what it does to places the linearised fit
/// did not see.
fn rival(a: &Accepted, config: &DiagnosisConfig) -> Option<Rival> {
    let ConditionedProblem { problem, weighed, .. } = a.conditioned.as_ref();
    let own = a.ranked.iter().find(|s| s.what == Instead::Entry(a.judged.entry))?;
    let others = a.ranked.iter().filter_map(|s| match s.what {
        Instead::Entry(k) if !a.set.contains(&k) => Some((k, own.score.above(&s.score))),
        _ => None,
    });
    let (k, behind) = others.min_by(|a, b| a.1.nats.total_cmp(&b.1.nats))?;
    let columns = &weighed.entries[k].candidate.columns;
    let effect = columns.dense(&problem.dwells, 1.0);
    Some(Rival {
        name: weighed.entries[k].candidate.spec.clone(),
        behind_nats: behind.nats,
        behind_se: behind.se,
        places: weighed.gain(problem, &effect, &a.conditioned.exam().folds, config),
    })
}

/// Pairs of testable entries whose signatures, at typical size, are the same.
fn confusable_pairs(problem: &Problem, weighed: &Weighed, config: &DiagnosisConfig) -> Vec<[String; 2]> {
    let crossed = weighed.crossed(problem);
    let width = |k: usize| weighed.entries[k].candidate.columns.len();
    let mut pairs = Vec::new();
    for k in 0..weighed.entries.len() {
        if weighed.entries[k].candidate.is_group() || weighed.entries[k].gram.a.trace() < config.min_delta {
            continue;
        }
        let theta = DVector::from_element(width(k), 1.0);
        for l in k + 1..weighed.entries.len() {
            if width(k) == width(l) && crossed.cosine(k, &theta, l) > config.merge_cosine {
                let name = |i: usize| weighed.entries[i].candidate.spec.clone();
                pairs.push([name(k), name(l)]);
            }
        }
    }
    pairs
}

fn warnings(
    noise: &Scatter,
    set_aside: &[DwellId],
    dwells: usize,
    search: &Search,
    config: &DiagnosisConfig,
) -> Vec<Warning> {
    let mut all = Vec::new();
    let mut add = |code, subject: String, message: String| {
        all.push(Warning::new(Severity::Notice, Stage::Calibrate, code, subject, message));
    };
    if !set_aside.is_empty() {
        let names: Vec<String> = set_aside.iter().map(ToString::to_string).collect();
        let message = format!(
            "{} of {dwells} dwells set aside: an error as rare as {} sigma under every explanation at hand; look for swapped \
             markers, a bump or a wrong cavity",
            names.len(),
            config.outlier_sigma
        );
        add(Code::SuspectDwell, list_names(&names), message);
    }
    if noise.sigma_ratio > SIGMA_RATIO {
        add(
            Code::ScatterLarger,
            "noise".to_string(),
            format!(
                "what remains scatters {:.1} times as much as declared{}; check the declared noise, the seats and the sensor",
                noise.sigma_ratio,
                noise.tracked_ratio.zip(noise.seated_ratio).map_or(String::new(), |(tracked, seated)| format!(
                    " ({tracked:.1} times where the tip was tracked, {seated:.1} times where it was seated)"
                ))
            ),
        );
    }
    if noise.sigma_ratio < 1.0 / OVERDECLARED {
        let message = format!(
            "what remains scatters only {:.2} times as much as declared: the noise is declared too large, and small effects hide \
             below it; declare what the sensor and the seats scatter",
            noise.sigma_ratio
        );
        add(Code::NoiseOverdeclared, "noise".to_string(), message);
    }
    if let Some(alike) = noise.alike() {
        let message = format!("{alike}; more repeats of the same kind average less");
        add(Code::ScatterCorrelated, "noise".to_string(), message);
    }
    let names: Vec<&str> = search.accepted.iter().map(|a| a.candidate.spec.as_str()).collect();
    for of_one in simultaneous_events(&names) {
        let message = format!(
            "{} tell of one moment: one event, such as a collision, a restart or a remounted part, may have done all of it",
            of_one.join(" and ")
        );
        add(Code::OneEvent, of_one[0].to_owned(), message);
    }
    for a in &search.accepted {
        if let Some(reason) = a.candidate.known.as_ref().filter(|_| !a.instead_of.is_empty()) {
            let message = format!(
                "{} and not {}: these data do not tell them apart, the pipeline does (\"{reason}\")",
                a.candidate.spec,
                list_names(&a.instead_of)
            );
            add(Code::NamedAsKnown, a.candidate.spec.clone(), message);
        }
        if !a.judged.impossible.is_empty() {
            let message = format!(
                "{}: {} came out negative, which no such mechanism is; something else acts that looks like it",
                a.candidate.spec,
                list_names(&a.judged.impossible)
            );
            add(Code::NegativeSize, a.candidate.spec.clone(), message);
        }
        if seen_by_the_sensor_alone(a) {
            let message = format!(
                "{}: the position sensor alone saw it, and all was as before when it ended: markers that were swapped, hidden or \
                 knocked meanwhile displace as much; look at the sensor's own recording of these dwells",
                a.candidate.spec
            );
            add(Code::EventOrSensor, a.candidate.spec.clone(), message);
        }
        if a.candidate.toggle == Toggle::Recording && one_load(&a.conditioned.problem) {
            let message = format!(
                "{}: something changed between dwells; a load that is not declared, another tool or another arm in a recording \
                 changes them too: check `load_kg`, and that all recordings are of this arm with this tool",
                a.candidate.spec
            );
            add(Code::EventOrLoad, a.candidate.spec.clone(), message);
        }
        if a.candidate.toggle == Toggle::Direction {
            let wrong = direction_suspects(a);
            if !wrong.is_empty() {
                let list = wrong.iter().take(5).map(|d| d.to_string()).collect::<Vec<_>>().join(", ");
                let message = format!(
                    "{} dwells fit {} far better with the arrival direction turned over ({list}); check how the \
                     directions were found",
                    wrong.len(),
                    a.candidate.spec
                );
                add(Code::SuspectDirection, a.candidate.spec.clone(), message);
            }
        }
    }
    all
}

/// Whether something was displaced in some dwells and not after them, and no cavity that held the tip in any of these knows of
/// it: a fault of the sensor displaces the same.
fn seen_by_the_sensor_alone(a: &Accepted) -> bool {
    let dwells = &a.conditioned.problem.dwells;
    let shifted = SHIFTS.contains(&a.candidate.family.as_str());
    let during = temporary_since(&a.candidate.spec).filter(|_| shifted);
    let of_markers = find(&a.candidate.family).is_some_and(|kind| kind.where_tracked);
    during.is_some_and(|during| {
        of_markers
            || dwells.iter().filter(|d| during.holds(d.id)).flat_map(|d| &d.parts).all(|part| part.tracked)
    })
}

/// Whether all dwells are declared to bear the same load.
fn one_load(problem: &Problem) -> bool {
    problem.dwells.iter().all(|d| d.load_kg == problem.dwells[0].load_kg)
}

/// Dwells whose arrival direction an accepted direction effect contradicts.
fn direction_suspects(a: &Accepted) -> Vec<DwellId> {
    let (problem, weighed) = (&a.conditioned.problem, &a.conditioned.weighed);
    let projection = &weighed.base;
    let columns = a.candidate.columns.dense(&problem.dwells, 1.0 / weighed.scale);
    let fitted = crate::weigh::confusion::one_step(&projection.gram(&columns), 1.0);
    let signature = &columns * &fitted.estimate;
    let with = projection.project(&columns) * &fitted.estimate;
    // Residual without the effect, the geometry as fitted with it.
    let residual = projection.projected_residual() - with + &signature;
    flipped_arrivals(problem, residual.as_slice(), signature.as_slice())
        .into_iter()
        .map(|i| problem.dwells[i].id)
        .collect()
}

#[cfg(test)]
#[path = "../tests/inner.rs"]
mod tests;
