//! A warning as people are told it, in terminal, page and viewer alike.

use armcal_core::{Severity, Warning, printable_name};
use armcal_result::RecordingNames;

/// A warning in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ToldWarning {
    /// How much it matters.
    pub severity: Severity,
    /// Stable machine-readable name.
    pub code: String,
    /// What it is about, behind the name of its recording where it is about one.
    pub subject: String,
    /// What was seen, and what to do next.
    pub message: String,
}

impl ToldWarning {
    /// Of a recording of this name, or of the whole run.
    pub fn new(names: &RecordingNames, recording: Option<&str>, w: &Warning) -> ToldWarning {
        let words = |text: &str| names.in_words(&printable_name(text));
        let of = recording.map_or_else(String::new, |name| format!("{}: ", printable_name(name)));
        ToldWarning {
            severity: w.severity,
            code: w.code.to_string(),
            subject: of + &words(&w.subject),
            message: words(&w.message),
        }
    }

    /// What it is about and what it says.
    pub fn text(&self) -> String {
        format!("{}: {}", self.subject, self.message)
    }

    /// The same with its severity and code, for a viewer that has one line for all.
    pub fn line(&self) -> String {
        format!("{}: {} [{}]", self.severity.word(), self.text(), self.code)
    }

    /// Class of its style on a page.
    pub fn class(&self) -> &'static str {
        if self.severity == Severity::Notice { "notice" } else { "grave" }
    }
}

/// The gravest first, otherwise in the order given.
pub fn gravest_first(mut warnings: Vec<ToldWarning>) -> Vec<ToldWarning> {
    warnings.sort_by_key(|w| std::cmp::Reverse(w.severity));
    warnings
}
