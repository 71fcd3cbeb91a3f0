//! What is wrong with a file that people write.

use std::path::PathBuf;

/// Why a pipeline, or a text that it names, cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum ConfigError {
    /// A file could not be read.
    #[error("reading the {what} {}: {source}", path.display())]
    ReadFile {
        /// `pipeline`, `board`, `DH model`, ...
        what: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    /// Something else where a file that people write belongs: a recording, a folder.
    #[error("{} is {found}, where a {wanted} belongs: {next}", path.display())]
    NotText { path: PathBuf, found: &'static str, wanted: &'static str, next: String },
    /// The pipeline file is not what it should be.
    #[error("pipeline {}: {source}", path.display())]
    Syntax { path: PathBuf, source: Box<toml::de::Error> },
    /// What was named as recordings and is not.
    #[error("recordings `{what}`: {why}")]
    Recordings { what: String, why: String },
    /// Two parts of the pipeline contradict each other.
    #[error("pipeline {}: `{key}` {problem}", path.display())]
    Contradiction { path: PathBuf, key: String, problem: String },
}
