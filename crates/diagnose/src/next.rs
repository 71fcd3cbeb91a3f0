//! What to record next, in words.

use crate::diagnosis::{Diagnosis, Verdict};
use crate::problem::Problem;
use std::collections::BTreeSet;

/// Recommendations that follow from what could not be told or not be tested.
pub(crate) fn record_next(problem: &Problem, diagnosis: &Diagnosis) -> Vec<String> {
    let mut all = Vec::new();
    if diagnosis.verdict == Verdict::Ambiguous {
        for e in diagnosis.effects.iter().filter(|e| e.set.len() > 1) {
            all.push(format!(
                "to tell {} apart: `armcal plan` proposes the dwells that separate them most, or says that only another \
                 sensor can",
                e.set.join(" and ")
            ));
        }
    }
    let untested = |word: &str| diagnosis.not_testable.iter().any(|n| n.why.contains(word));
    if untested("same side") || untested("arrival directions") {
        all.push(
            "enter some cavities (or poses) a second time from the other side in every joint".to_string(),
        );
    }
    if untested("load never changes") || (untested("takes over") && diagnosis.verdict != Verdict::Identified)
    {
        all.push(
            "repeat a dozen dwells with a known load, and add free poses over a wider range of every joint"
                .to_string(),
        );
    }
    if untested("takes over") {
        all.push(format!(
            "{} effects of realistic size could hide in these motions: `armcal plan` proposes the dwells in which they would show",
            diagnosis.not_testable.len()
        ));
    }
    let recordings: BTreeSet<usize> = problem.dwells.iter().map(|d| d.id.recording).collect();
    if recordings.len() == 1 {
        all.push("record the first part again at the end: with one recording, what changes between recordings cannot be seen".to_string());
    }
    let directions_known = problem.dwells.iter().any(|d| d.arrival.iter().any(|s| *s != 0.0));
    if !directions_known {
        all.push(
            "record the motion before each dwell: without arrival directions no lost motion can be tested"
                .to_string(),
        );
    }
    all
}
