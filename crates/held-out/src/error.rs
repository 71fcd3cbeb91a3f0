//! Why a model cannot be judged on other recordings.

use armcal_stages::RunError;

/// Why nothing was judged.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum HeldOutError {
    /// The recordings, or a fit to them.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Reading back the result, or one that cannot be used here.
    #[error(transparent)]
    StoredRun(#[from] armcal_result::StoredResultError),
    /// Judging by ISO 9283.
    #[error("judging by ISO 9283: {0}")]
    Iso(#[from] armcal_iso9283::IsoError),
    /// An effect that the user named and that is none.
    #[error(transparent)]
    Usage(armcal_model::ModelError),
    /// A session that shows nothing.
    #[error("no dwell of `{pipeline}` has a place that anything could be judged by; see `armcal run` of it")]
    NothingToJudge { pipeline: String },
}

armcal_stages::stopped_as_run!(
    HeldOutError:
    armcal_config::ConfigError,
    armcal_table::TableError,
    armcal_model::ModelError,
    armcal_calibrate::CalibrateError
);
