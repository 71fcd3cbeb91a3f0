//! The `diagnosis` of `summary.json`: names as in the contract; whatever else the diagnosis knows follows them.

use armcal_diagnose::{BeforeAfter, CandidateReport, Diagnosis, ParameterReport, UnknownReport};
use armcal_wording::{explanations, pasted};
use serde_json::{Value, json};
use std::collections::BTreeMap;

pub(crate) fn diagnosis_summary(d: &Diagnosis) -> Value {
    json!({
        "verdict": d.verdict,
        "names": d.names,
        // `null` where the answer is no explanation.
        "probability": d.probability,
        "p_adjusted": d.p_adjusted,
        "candidates": d.candidates.iter().map(candidate).collect::<Value>(),
        "unknown": d.unknown.as_ref().map(unknown),
        // All unlisted shapes, the strongest (`unknown`) first.
        "unlisted": d.unlisted.iter().map(unknown).collect::<Value>(),
        "cannot_tell_apart": d.cannot_tell_apart,
        "not_testable": d.not_testable,
        "record_next": d.record_next,
        "p_nothing": d.p_nothing,
        // Mean errors of the calibrations without and with what was found, on the points that `judged` names.
        "holdout_mm": d.holdout_mm,
        "floor_mm": d.floor_mm,
        "repeatability_mm": d.repeatability_mm,
        "judged": d.judged,
        // What is neither explained nor at the floor.
        "unexplained": d.unexplained,
        "sigma_ratio": d.noise.sigma_ratio,
        "effects": d.effects,
        "explanations": explanations(d),
        // The choice made again without each part of the hold-out; `null` where it was not.
        "nested": d.nested,
    })
}

fn candidate(c: &CandidateReport) -> Value {
    // One-step estimate of an amplitude, in its SI `unit`.
    let amplitude = |p: &ParameterReport| json!({ "value": p.value, "ci95": p.ci95, "unit": p.unit });
    let amplitudes: BTreeMap<&str, Value> =
        c.parameters.iter().map(|p| (p.name.as_str(), amplitude(p))).collect();
    json!({
        "effect": c.effect,
        "target": c.target,
        // How `armcal add` is told to add it.
        "spec": c.spec,
        "parameters": amplitudes,
        // How it stands by the one score: `behind_nats` with its standard error, probability, whether it is of the answer; `null`
        // where it was not among the best.
        "behind_nats": c.standing.map(|s| s.behind_nats),
        "behind_se": c.standing.map(|s| s.behind_se),
        "probability": c.standing.map(|s| s.probability),
        "in_answer": c.standing.is_some_and(|s| s.in_answer),
        "p_adjusted": c.p_adjusted,
        // Of the linearised fit, each place left out in turn; `refits` has the calibrations.
        "holdout_mm": c.holdout_mm,
        "same_to_the_data": c.same_to_the_data,
        "absorbed": c.absorbed,
        "smallest_seen": c.smallest_seen,
    })
}

fn unknown(u: &UnknownReport) -> Value {
    let expression = u.expression.as_ref();
    json!({
        "channel": u.channel,
        "driver": u.driver,
        "expression": expression.map_or("", |e| &e.formula),
        "acts_on": expression.map(|e| &e.acts_on),
        // The `[[effects]]` table to paste into the pipeline; empty where nothing offered reaches the shape.
        "table": pasted(u),
        "probability": u.probability,
        // Of the linearised fit, each place left out in turn.
        "holdout_mm": BeforeAfter { before: u.places.before, after: u.places.after },
        "unit": u.unit,
        "shape": u.shape,
        // What repeats in a joint's error over its own angle; null where nothing does.
        "ripple": u.ripple,
        "rivals": u.rivals,
    })
}
