//! Why a result cannot be put to use.

use std::path::PathBuf;

/// Why there is no file, or no set-point.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum DeployError {
    /// A text that people write.
    #[error(transparent)]
    Config(#[from] armcal_config::ConfigError),
    /// A model that cannot be written.
    #[error(transparent)]
    Model(#[from] armcal_model::ModelError),
    /// Reading back the result.
    #[error(transparent)]
    StoredRun(#[from] armcal_result::StoredResultError),
    /// A format that cannot hold the arm.
    #[error(transparent)]
    Format(#[from] armcal_formats::FormatError),
    /// A file of targets is not what it should be.
    #[error("targets {}: {problem}", path.display())]
    BadTargets { path: PathBuf, problem: String },
    /// No set-point.
    #[error(transparent)]
    Compensate(#[from] armcal_compensate::CompensateError),
    /// Writing set-points as CSV.
    #[error("writing the set-points as CSV: {0}")]
    Csv(#[from] csv::Error),
}
