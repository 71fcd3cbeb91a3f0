//! What can go wrong while a run is put into files.

/// Why a run cannot be put into what its results are read back from.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResultError {
    /// A recording cannot be read once more for its hash.
    #[error("hashing a recording for the summary: {0}")]
    Hash(Box<armcal_recording::RecordingError>),
    /// The calibrated model cannot be written.
    #[error("writing the calibrated model: {0}")]
    Model(#[source] Box<armcal_model::ModelError>),
    /// What a fit saw cannot be written as JSON.
    #[error("encoding the report's data as JSON: {0}")]
    Json(#[source] serde_json::Error),
    /// The run contradicts itself; a bug of whoever put it together.
    #[error("the run is inconsistent: {0}")]
    Inconsistent(String),
}

impl From<armcal_model::ModelError> for ResultError {
    fn from(source: armcal_model::ModelError) -> ResultError {
        ResultError::Model(Box::new(source))
    }
}
