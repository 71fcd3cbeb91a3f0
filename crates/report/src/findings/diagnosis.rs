//! The verdict and what it was weighed against, in rows that a table panel shows.

use super::{finite, or_zero, short};
use crate::diagnosis_text::{headline, sizes, sizes_of};
use crate::proto;
use crate::run::{Answer, Run};
use armcal_diagnose::{CandidateReport, Diagnosis, FoundEffect};

pub(super) fn diagnosis(run: &Run, d: &Diagnosis) -> proto::Diagnosis {
    let not_testable = d.not_testable.iter().map(|n| proto::NotTestable {
        effect: n.effect.clone(),
        smallest_seen: n.smallest_seen.clone(),
        typical: n.typical.clone(),
        why: n.why.clone(),
    });
    let explanations = d
        .explanations
        .iter()
        .map(|e| proto::Explanation { number: e.number.clone(), sentence: run.in_words(&e.sentence) });
    proto::Diagnosis {
        timestamp: None,
        verdict: d.verdict.word().into(),
        sentence: headline(run, d),
        names: d.names.clone(),
        probability: d.probability.and_then(finite),
        p_adjusted: finite(d.p_adjusted),
        p_nothing: or_zero(d.p_nothing),
        effects: d.effects.iter().map(found).collect(),
        record_next: d.record_next.iter().map(|r| run.in_words(r)).collect(),
        not_testable: not_testable.collect(),
        explanations: explanations.collect(),
        cannot_tell_apart: d.cannot_tell_apart.iter().map(|[a, b]| format!("{a} and {b}")).collect(),
    }
}

/// The same of a run without one: why.
pub(super) fn none(answer: Answer) -> proto::Diagnosis {
    proto::Diagnosis { verdict: answer.word.into(), sentence: answer.sentence, ..Default::default() }
}

pub(super) fn candidates(run: &Run, d: &Diagnosis) -> proto::Candidates {
    proto::Candidates {
        timestamp: None,
        candidates: d.candidates.iter().map(|c| candidate(run, c)).collect(),
    }
}

fn candidate(run: &Run, c: &CandidateReport) -> proto::Candidate {
    proto::Candidate {
        effect: c.spec.clone(),
        target: run.in_words(&c.target),
        size: sizes(c),
        probability: short(or_zero(c.probability)),
        log_evidence: finite(c.log_evidence).map(short),
        p_adjusted: finite(c.p_adjusted).map(short),
        before_mm: c.holdout_mm.and_then(|h| finite(h.before).map(short)),
        after_mm: c.holdout_mm.and_then(|h| finite(h.after).map(short)),
        absorbed_percent: finite(100.0 * c.absorbed).map(short),
        same_to_the_data: c.same_to_the_data.join(", "),
    }
}

fn found(e: &FoundEffect) -> proto::FoundEffect {
    proto::FoundEffect {
        effect: e.name.clone(),
        one_of: if e.set.len() > 1 { e.set.join(", ") } else { String::new() },
        size: sizes_of(e),
        probability: short(or_zero(e.probability)),
        p_adjusted: finite(e.p_adjusted).map(short),
        before_mm: finite(e.places.before).map(short),
        after_mm: finite(e.places.after).map(short),
        rival: e.rival.as_ref().map(|r| r.name.clone()).unwrap_or_default(),
        rival_behind_nats: e.rival.as_ref().and_then(|r| finite(r.behind_nats).map(short)),
    }
}
