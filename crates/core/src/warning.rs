//! Warnings are data: collected by every stage, shown in terminal, page and MCAP alike.

use crate::Code;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much a warning matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Worth knowing; the result stands.
    Notice,
    /// The result cannot be trusted as it is (the model or the data is inadequate): exit code 3.
    Inadequate,
    /// Data of the input was damaged or could not be used: exit code 3.
    DataLost,
}

impl Severity {
    /// For people.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Notice => "notice",
            Severity::Inadequate => "inadequate",
            Severity::DataLost => "data lost",
        }
    }
}

/// The stage of the story that noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Reading the file.
    Recording,
    /// Clock alignment and dwell detection.
    Dwell,
    /// Board and association.
    Table,
    /// Mistakes of wiring, files, frames and units.
    Setup,
    /// Fit and hold-out.
    Calibrate,
    /// What is missing from the model.
    Diagnose,
    /// Writing results.
    Output,
}

/// Something the user should know, with what it is about and what to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Warning {
    /// How much it matters.
    pub severity: Severity,
    /// Who noticed.
    pub stage: Stage,
    /// What it is.
    pub code: Code,
    /// The file, channel, dwell, cavity or parameter it is about.
    pub subject: String,
    /// One sentence: what was seen, and what to do next.
    pub message: String,
}

impl Warning {
    /// A warning of the given severity.
    pub fn new(
        severity: Severity,
        stage: Stage,
        code: Code,
        subject: impl Into<String>,
        message: impl Into<String>,
    ) -> Warning {
        Warning { severity, stage, code, subject: subject.into(), message: message.into() }
    }
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.subject, self.message)
    }
}

/// Names listed in one warning.
const LISTED: usize = 5;

/// The first few names and how many more: the subject of a warning about many.
pub fn list_names(names: &[String]) -> String {
    let shown = names[..names.len().min(LISTED)].join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}
