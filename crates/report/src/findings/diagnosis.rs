//! The verdict and what it was weighed against, in rows that a table panel shows.

use crate::viewer_text::for_viewer;
use armcal_core::printable_name;
use armcal_diagnose::{CandidateReport, Diagnosis, FoundEffect, UnknownReport};
use armcal_result::analysis::{effects_label, error_curve, finite, or_zero, round_significant};
use armcal_result::{Run, proto};
use armcal_wording::{
    Answer, candidate_sizes, channel_told, driver_told, explanations, headline, shown_unlisted,
    size_in_table, sizes_of,
};

pub(super) fn diagnosis_message(run: &Run, d: &Diagnosis) -> proto::Diagnosis {
    let names = run.recording_names();
    let not_testable = d.not_testable.iter().map(|n| proto::NotTestable {
        effect: names.label(&n.effect),
        smallest_seen: n.smallest_seen.clone(),
        typical: n.typical.clone(),
        why: n.why.clone(),
    });
    let told = explanations(d);
    let explanations = told
        .iter()
        .map(|e| proto::Explanation { number: e.number.clone(), sentence: run.in_words(&e.sentence) });
    proto::Diagnosis {
        timestamp: None,
        verdict: d.verdict.word().into(),
        sentence: headline(&run.called(), d),
        names: d.names.clone(),
        probability: d.probability.and_then(finite),
        p_adjusted: finite(d.p_adjusted),
        p_nothing: or_zero(d.p_nothing),
        effects: d.effects.iter().map(effect_message).collect(),
        record_next: for_viewer(d.record_next.iter().map(|r| run.in_words(r))),
        not_testable: not_testable.collect(),
        told: for_viewer(
            told.iter().map(|e| format!("{}: {}", names.number_label(&e.number), run.in_words(&e.sentence))),
        ),
        explanations: explanations.collect(),
        cannot_tell_apart: (d.cannot_tell_apart.iter())
            .map(|[a, b]| format!("{} and {}", names.label(a), names.label(b)))
            .collect(),
    }
}

/// The same of a run without one: why.
pub(super) fn undiagnosed_message(answer: Answer) -> proto::Diagnosis {
    proto::Diagnosis { verdict: answer.word.into(), sentence: answer.sentence, ..Default::default() }
}

pub(super) fn candidates_message(run: &Run, d: &Diagnosis) -> proto::Candidates {
    proto::Candidates {
        timestamp: None,
        candidates: d.candidates.iter().map(|c| candidate_message(run, c)).collect(),
    }
}

fn candidate_message(run: &Run, c: &CandidateReport) -> proto::Candidate {
    proto::Candidate {
        effect: c.spec.clone(),
        target: run.in_words(&c.target),
        size: candidate_sizes(c),
        probability: c.standing.and_then(|s| finite(s.probability)).map(round_significant),
        behind_nats: c.standing.and_then(|s| finite(s.behind_nats)).map(round_significant),
        behind_se: c.standing.and_then(|s| finite(s.behind_se)).map(round_significant),
        p_adjusted: finite(c.p_adjusted).map(round_significant),
        before_mm: c.holdout_mm.and_then(|h| finite(h.before).map(round_significant)),
        after_mm: c.holdout_mm.and_then(|h| finite(h.after).map(round_significant)),
        absorbed_percent: finite(100.0 * c.absorbed).map(round_significant),
        same_to_the_data: c.same_to_the_data.join(", "),
    }
}

fn effect_message(e: &FoundEffect) -> proto::FoundEffect {
    proto::FoundEffect {
        effect: e.name.clone(),
        one_of: if e.set.len() > 1 { e.set.join(", ") } else { String::new() },
        size: sizes_of(e),
        probability: round_significant(or_zero(e.probability)),
        p_adjusted: finite(e.p_adjusted).map(round_significant),
        before_mm: finite(e.places.before).map(round_significant),
        after_mm: finite(e.places.after).map(round_significant),
        rival: e.rival.as_ref().map(|r| r.name.clone()).unwrap_or_default(),
        rival_behind_nats: e.rival.as_ref().and_then(|r| finite(r.behind_nats).map(round_significant)),
    }
}

/// What was found and the candidates, each in a row of words: a table panel has the columns that its first row has, and
/// begins with what comes first.
pub(super) fn effect_table(run: &Run, d: &Diagnosis) -> proto::EffectTable {
    let names = run.recording_names();
    let candidates = d.candidates.iter().map(|c| proto::EffectRow {
        effect: kind_names([&c.spec]),
        left_out_mm: c.holdout_mm.map_or_else(String::new, |h| before_after_text(h.before, h.after)),
        probability: c.standing.map_or_else(String::new, |s| probability_text(s.probability)),
        r#where: run.in_words(&c.target),
        size: size_in_table(&c.parameters),
        name: names.label(&c.spec),
    });
    let found = d.effects.iter().map(|e| proto::EffectRow {
        effect: kind_names(&e.set),
        left_out_mm: before_after_text(e.places.before, e.places.after),
        probability: probability_text(e.probability),
        r#where: d
            .candidates
            .iter()
            .find(|c| c.spec == e.name)
            .map(|c| run.in_words(&c.target))
            .unwrap_or_default(),
        size: size_in_table(&e.parameters),
        name: e.set.iter().map(|name| names.label(name)).collect::<Vec<_>>().join(" or "),
    });
    let found = found.chain(shown_unlisted(d).map(|u| unlisted_row(run, u)));
    proto::EffectTable { timestamp: None, found: found.collect(), candidates: candidates.collect() }
}

/// An error without a name: what it depends on, and how far its shape goes.
fn unlisted_row(run: &Run, u: &UnknownReport) -> proto::EffectRow {
    let curve = error_curve(u, run.model.chain());
    let most = curve.value.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    proto::EffectRow {
        effect: "not listed".into(),
        left_out_mm: before_after_text(u.places.before, u.places.after),
        probability: probability_text(u.probability),
        r#where: printable_name(&format!("{}, over {}", channel_told(&u.channel), driver_told(u.driver))),
        size: format!("up to {} {}", round_significant(most), curve.unit).trim_end().to_owned(),
        name: u
            .effect()
            .map_or_else(String::new, |effect| effects_label(&run.recording_names(), &[effect.to_string()])),
    }
}

/// The kinds of effects, each once: the names of a group are wider than a panel.
fn kind_names<'a>(names: impl IntoIterator<Item = &'a String>) -> String {
    let mut kinds: Vec<&str> = Vec::new();
    for name in names {
        // What a user calls an expression follows a colon too.
        let end = if name.starts_with("expression:") {
            name.len()
        } else {
            name.find([':', '@']).unwrap_or(name.len())
        };
        if !kinds.contains(&&name[..end]) {
            kinds.push(&name[..end]);
        }
    }
    kinds.join(" or ")
}

fn before_after_text(before_mm: f64, after_mm: f64) -> String {
    match before_mm.is_finite() && after_mm.is_finite() {
        true => format!("{before_mm:.3} to {after_mm:.3}"),
        false => String::new(),
    }
}

fn probability_text(p: f64) -> String {
    match p {
        p if p.is_nan() => String::new(),
        p if p < 5e-4 => "< 0.001".into(),
        p => format!("{p:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_and_alternatives_are_called_by_their_kinds() {
        let kinds = |names: &[&str]| kind_names(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
        assert_eq!(kinds(&["bearing_compliance:2+bearing_compliance:3"]), "bearing_compliance");
        assert_eq!(kinds(&["compliance:2", "compliance:3", "frame_shift@2.43"]), "compliance or frame_shift");
        assert_eq!(kinds(&["base_compliance,height=0.1"]), "base_compliance,height=0.1");
        assert_eq!(
            kinds(&["expression:lengths_over_t", "something not listed"]),
            "expression:lengths_over_t or something not listed"
        );
    }

    #[test]
    fn a_small_probability_is_not_none() {
        assert_eq!(
            [0.0, 1e-9, 0.02, 1.0, f64::NAN].map(probability_text),
            ["< 0.001", "< 0.001", "0.020", "1.000", ""]
        );
    }
}
