//! The `diagnosis` of `summary.json`.

use crate::diagnosis_text::pasted;
use armcal_core::Unit;
use armcal_diagnose::{
    BeforeAfter, CandidateReport, Diagnosis, Explanation, FoundEffect, JudgedOn, Nested, NotTestable,
    ParameterReport, Ripple, ShapePoint, Unexplained, UnknownReport, Verdict,
};
use serde::Serialize;
use std::collections::BTreeMap;

/// Names as in the contract; whatever else the diagnosis knows follows them.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct DiagnosisSummary<'a> {
    verdict: Verdict,
    names: &'a [String],
    /// `null` where the answer is no explanation.
    probability: Option<f64>,
    p_adjusted: f64,
    candidates: Vec<Candidate<'a>>,
    unknown: Option<Unknown<'a>>,
    /// All unlisted shapes, the strongest (`unknown`) first.
    unlisted: Vec<Unknown<'a>>,
    cannot_tell_apart: &'a [[String; 2]],
    not_testable: &'a [NotTestable],
    record_next: &'a [String],
    p_nothing: f64,
    /// Mean errors of the calibrations without and with what was found, on the points that `judged` names.
    holdout_mm: BeforeAfter,
    floor_mm: f64,
    judged: JudgedOn,
    /// What is neither explained nor at the floor.
    unexplained: Option<&'a Unexplained>,
    sigma_ratio: f64,
    effects: &'a [FoundEffect],
    explanations: &'a [Explanation],
    /// The choice made again without each part of the hold-out; `null` where it was not.
    nested: Option<&'a Nested>,
}

#[derive(Debug, Clone, Serialize)]
struct Candidate<'a> {
    effect: &'a str,
    target: &'a str,
    /// How `armcal add` is told to add it.
    spec: &'a str,
    parameters: BTreeMap<&'a str, Amplitude>,
    log_evidence: f64,
    probability: f64,
    p_adjusted: f64,
    /// Of the linearised fit, each place left out in turn; `refits` has the calibrations.
    holdout_mm: Option<BeforeAfter>,
    same_to_the_data: &'a [String],
    absorbed: f64,
    smallest_seen: f64,
}

/// One-step estimate of an amplitude, in its SI `unit`.
#[derive(Debug, Clone, Copy, Serialize)]
struct Amplitude {
    value: f64,
    ci95: [f64; 2],
    unit: Unit,
}

#[derive(Debug, Clone, Serialize)]
struct Unknown<'a> {
    channel: &'a str,
    driver: &'a str,
    expression: &'a str,
    acts_on: Option<&'a str>,
    /// The `[[effects]]` table to paste into the pipeline; empty where nothing offered reaches the shape.
    table: String,
    probability: f64,
    /// Of the linearised fit, each place left out in turn.
    holdout_mm: BeforeAfter,
    unit: Unit,
    shape: &'a [ShapePoint],
    /// What repeats in a joint's error over its own angle; null where nothing does.
    ripple: Option<Ripple>,
    rivals: &'a [String],
}

impl<'a> DiagnosisSummary<'a> {
    pub fn of(d: &'a Diagnosis) -> DiagnosisSummary<'a> {
        DiagnosisSummary {
            verdict: d.verdict,
            names: &d.names,
            probability: d.probability,
            p_adjusted: d.p_adjusted,
            candidates: d.candidates.iter().map(candidate).collect(),
            unknown: d.unknown.as_ref().map(unknown),
            unlisted: d.unlisted.iter().map(unknown).collect(),
            cannot_tell_apart: &d.cannot_tell_apart,
            not_testable: &d.not_testable,
            record_next: &d.record_next,
            p_nothing: d.p_nothing,
            holdout_mm: d.holdout_mm,
            floor_mm: d.floor_mm,
            judged: d.judged,
            unexplained: d.unexplained.as_ref(),
            sigma_ratio: d.noise.sigma_ratio,
            effects: &d.effects,
            explanations: &d.explanations,
            nested: d.nested.as_ref(),
        }
    }
}

fn candidate(c: &CandidateReport) -> Candidate<'_> {
    let amplitude = |p: &ParameterReport| Amplitude { value: p.value, ci95: p.ci95, unit: p.unit };
    Candidate {
        effect: &c.effect,
        target: &c.target,
        spec: &c.spec,
        parameters: c.parameters.iter().map(|p| (p.name.as_str(), amplitude(p))).collect(),
        log_evidence: c.log_evidence,
        probability: c.probability,
        p_adjusted: c.p_adjusted,
        holdout_mm: c.holdout_mm,
        same_to_the_data: &c.same_to_the_data,
        absorbed: c.absorbed,
        smallest_seen: c.smallest_seen,
    }
}

fn unknown(u: &UnknownReport) -> Unknown<'_> {
    let expression = u.expression.as_ref();
    Unknown {
        channel: &u.channel,
        driver: &u.driver,
        expression: expression.map_or("", |e| &e.formula),
        acts_on: expression.map(|e| e.acts_on.as_str()),
        table: pasted(u),
        probability: u.probability,
        holdout_mm: BeforeAfter { before: u.places.before, after: u.places.after },
        unit: u.unit,
        shape: &u.shape,
        ripple: u.ripple,
        rivals: &u.rivals,
    }
}
