//! What stops a pool.

use armcal_stages::RunError;
use std::path::PathBuf;

/// Why results cannot be pooled.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum PoolError {
    /// The pipeline, or the fit of all of them.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Reading back a result.
    #[error(transparent)]
    StoredRun(#[from] armcal_result::StoredResultError),
    /// A result that cannot be used here, or a folder without any.
    #[error("{} {problem}", path.display())]
    Result { path: PathBuf, problem: String },
}

armcal_stages::stopped_as_run!(
    PoolError:
    armcal_config::ConfigError,
    armcal_model::ModelError,
    armcal_calibrate::CalibrateError
);
