//! What stops a pool.

use armcal_stages::RunError;

/// Why results cannot be pooled.
#[derive(Debug, thiserror::Error)]
pub enum PoolError {
    /// The pipeline, or the fit of all of them.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Reading back a result, one that cannot be pooled, or a folder without any.
    #[error(transparent)]
    StoredRun(#[from] armcal_result::StoredResultError),
}

armcal_stages::stopped_as_run!(
    PoolError:
    armcal_config::ConfigError,
    armcal_model::ModelError,
    armcal_calibrate::CalibrateError
);
