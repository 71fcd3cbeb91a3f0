//! Warnings of a run, told, and lists of what is said.

use armcal_core::{Code, Severity, Warning, printable_name};
use armcal_result::Run;

/// Rejections, parameters, warnings listed in one check.
const LISTED: usize = 6;

/// The first few, and how many more there are.
pub fn listed_up(mut all: Vec<String>, what: &str) -> Vec<String> {
    if all.len() > LISTED {
        let more = all.len() - LISTED;
        all.truncate(LISTED);
        all.push(format!("And {more} more {what}."));
    }
    all
}

/// A warning, told with its recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Told {
    /// How much it matters.
    pub severity: Severity,
    /// What it is.
    pub code: Code,
    /// A sentence.
    pub text: String,
}

/// Every warning of the run.
pub fn all_warnings(run: &Run) -> Vec<Told> {
    let told = |w: &Warning, text: String| Told {
        severity: w.severity,
        code: w.code,
        text: run.in_words(&printable_name(&text)),
    };
    let of_recordings = run
        .recordings
        .iter()
        .flat_map(|r| r.all_warnings().into_iter().map(move |w| told(w, format!("`{}`: {w}.", r.name))));
    let overall = run.overall_warnings().into_iter().map(|w| told(&w, format!("{w}.")));
    of_recordings.chain(overall).collect()
}
