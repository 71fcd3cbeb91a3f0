//! What stops a batch.

use armcal_stages::RunError;
use std::path::PathBuf;

/// Why an archive cannot be worked on.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum ArchiveError {
    /// A recording, or what its run needs.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A file in a campaign's folder that is not what it should be.
    #[error("campaign {}: {why}", path.display())]
    Campaign { path: PathBuf, why: String },
    /// A defect of armcal itself.
    #[error("recording `{recording}`: armcal itself failed ({why}); please report it with the recording")]
    Internal { recording: String, why: String },
    /// A folder for results cannot be made.
    #[error("making the folder {}: {source}", path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    /// Writing results.
    #[error(transparent)]
    Report(#[from] armcal_report::ReportError),
    /// Reading back a result.
    #[error(transparent)]
    StoredRun(#[from] armcal_result::StoredResultError),
    /// Writing what is remembered of a result.
    #[error("writing the result as JSON: {0}")]
    Json(serde_json::Error),
    /// Making a folder of a campaign.
    #[error(transparent)]
    Output(armcal_recording::RecordingError),
}

armcal_stages::stopped_as_run!(ArchiveError: armcal_config::ConfigError);
