//! The check of the diagnosis.

use super::limits::Limits;
use super::measured::{Check, Measured};
use super::reasons;
use armcal_diagnose::{Diagnosis, Verdict};
use armcal_model::EffectSpec;
use armcal_result::Run;

/// Whether the verdict is one of the right ones, or all that is missing may be.
///
/// An effect that the data cannot tell from others may be missing only if every one of its names may: the limit must
/// not hold by the choice of a name.
pub fn check_verdict(run: &Run, limits: &Limits) -> Option<Check> {
    let section = &limits.section;
    if !section.limits_verdict() {
        return None;
    }
    let nothing = vec![Verdict::NothingMissing];
    let right = section.verdicts.as_ref().unwrap_or(&nothing);
    let joints = run.model.chain().joint_names();
    let may_miss = |name: &String| {
        EffectSpec::parse(name, joints).is_ok_and(|found| limits.allowed.iter().any(|a| a.covers(&found)))
    };
    let diagnosis = run.diagnosis.as_ref();
    let allowed = |d: &Diagnosis| {
        let names = d.effects.iter().flat_map(|e| &e.set);
        d.unlisted.is_empty() && !d.effects.is_empty() && names.into_iter().all(may_miss)
    };
    let holds = diagnosis.is_some_and(|d| right.contains(&d.verdict) || allowed(d));
    let words = right.iter().map(|v| v.word().to_owned());
    let effects = limits.allowed.iter().map(EffectSpec::to_string);
    let check = Check {
        name: if section.verdicts.is_some() { "verdicts" } else { "allowed_effects" }.to_owned(),
        measured: diagnosis.map_or(Measured::Nothing, |d| Measured::Words(verdict_text(d))),
        limit: Measured::Words(words.chain(effects).collect::<Vec<_>>().join(", ")),
        unit: "",
        holds,
        said: String::new(),
        why: Vec::new(),
    };
    let said = as_clause(&armcal_wording::answer(run).sentence);
    Some(check.saying(said, || reasons::of_run(run, limits)))
}

/// The verdict with its names: `identified: zero_slip:2@1`.
fn verdict_text(d: &Diagnosis) -> String {
    let names = d.names.join(", ");
    let word = d.verdict.word();
    if names.is_empty() { word.to_owned() } else { format!("{word}: {names}") }
}

/// A sentence as the end of another one: without its capital and full stop.
fn as_clause(sentence: &str) -> String {
    let mut rest = sentence.trim_end_matches('.').chars();
    rest.next().map_or(String::new(), |first| first.to_lowercase().chain(rest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_spelt_as_the_pipeline_spells_them() {
        for verdict in Verdict::ALL {
            assert_eq!(serde_json::to_value(verdict).expect("JSON"), verdict.word());
        }
    }
}
