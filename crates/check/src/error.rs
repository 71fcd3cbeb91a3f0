//! Why nothing was judged.

use armcal_stages::RunError;
use std::path::PathBuf;

/// Why limits cannot be read, or a judgement not be written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum CheckError {
    /// What a limit names.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A pipeline that limits nothing.
    #[error(
        "pipeline {}: there is no limit to check; add a [check] section, for instance `max_over_floor = 1.5`, \
         `max_holdout_mean_mm = 0.5` and `verdicts = [\"nothing_missing\"]` (docs/check.md lists them)",
        path.display()
    )]
    NoLimits { path: PathBuf },
    /// What `[check]` compares with is not a result.
    #[error(
        "check.reference: {} {problem}; name the summary.json, run.mcap or folder of an accepted `armcal run`",
        path.display()
    )]
    BadReference { path: PathBuf, problem: String },
    /// Reading back that result.
    #[error(transparent)]
    StoredRun(#[from] armcal_result::StoredResultError),
    /// The summary that is judged.
    #[error(transparent)]
    Report(#[from] armcal_report::ReportError),
    /// Reading it as what was written.
    #[error("writing the result as JSON: {0}")]
    Json(serde_json::Error),
    /// Writing JUnit XML.
    #[error("writing the checks as JUnit XML: {0}")]
    Junit(Box<dyn std::error::Error + Send + Sync>),
}

armcal_stages::stopped_as_run!(CheckError: armcal_config::ConfigError);
