//! Why a case could not be made or run.

use armcal_lab::LabError;
use std::path::PathBuf;

/// Why a case could not be made or run: never because of what the program said.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum Error {
    /// The lab refused.
    #[error(transparent)]
    Lab(#[from] LabError),
    /// A shipped TOML text does not parse.
    #[error("parsing the {what}: {source}")]
    Toml { what: &'static str, source: Box<toml::de::Error> },
    /// A table could not be written as TOML.
    #[error("writing the {what} as TOML: {source}")]
    Text { what: &'static str, source: Box<toml::ser::Error> },
    /// A file or folder could not be used.
    #[error("{doing} {path}: {source}", path = path.display())]
    File { doing: &'static str, path: PathBuf, source: std::io::Error },
    /// A name that is not in the list.
    #[error("no {what} is named `{name}`; known: {known}")]
    Unknown { what: &'static str, name: String, known: String },
}

impl Error {
    /// For `map_err`: what was being done to which file.
    pub fn file(doing: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Error {
        let path = path.into();
        move |source| Error::File { doing, path, source }
    }
}
