//! What can go wrong while results are written.

use std::path::PathBuf;

/// Why results could not be written.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
#[non_exhaustive]
pub enum ReportError {
    /// The output folder cannot be made.
    #[error("{0}; choose another one")]
    Folder(Box<armcal_recording::RecordingError>),
    /// A file cannot be written, or an input not be passed through.
    #[error("writing {}: {source}", path.display())]
    Write { path: PathBuf, source: Box<armcal_recording::RecordingError> },
    /// A table cannot be encoded as Parquet.
    #[error("encoding the table {table} as Parquet: {source}")]
    Parquet { table: &'static str, source: Box<dyn std::error::Error + Send + Sync> },
    /// The parameters cannot be written as TOML.
    #[error("encoding the parameters as TOML: {0}")]
    Toml(#[from] toml::ser::Error),
    /// The data of the page, or a summary, cannot be written as JSON.
    #[error("encoding the report's data as JSON: {0}")]
    Page(#[source] serde_json::Error),
    /// The page's template cannot be filled in.
    #[error("writing the report page: {0}")]
    Template(#[from] askama::Error),
    /// The run cannot be written as what its results are read back from.
    #[error(transparent)]
    Result(#[from] armcal_result::ResultError),
}
