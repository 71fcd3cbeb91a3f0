//! Why no pipeline can be proposed.

use armcal_stages::RunError;
use std::path::PathBuf;

/// Why a proposal failed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum InitError {
    /// What was recorded is not enough.
    #[error("{problem}")]
    Init { problem: String },
    /// Nothing says where the tip was.
    #[error("{problem}")]
    NothingSeen { problem: String },
    /// A name that the user gave and that means nothing here.
    #[error("{problem}")]
    Usage { problem: String },
    /// Opening, reading, calibrating.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A folder for the trial cannot be made.
    #[error("making the folder {}: {source}", path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    /// Writing what the trial needs.
    #[error(transparent)]
    Output(armcal_recording::RecordingError),
}

armcal_stages::stopped_as_run!(
    InitError:
    armcal_config::ConfigError,
    armcal_table::TableError,
    armcal_model::ModelError,
    armcal_calibrate::CalibrateError
);
