//! Why there is no number.

use armcal_compensate::CompensateError;
use armcal_model::ModelError;
use armcal_model_file::FileError;

/// Every variant says what was asked, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum KinematicsError {
    /// The text is no `model.json`.
    #[error("reading model.json: {0}; run the pipeline again with this version of armcal")]
    File(#[from] FileError),
    /// What it holds does not fit together.
    #[error("making the arm of model.json: {0}; run the pipeline again")]
    Model(#[from] ModelError),
    /// An argument that makes no sense.
    #[error("{what}: {problem}")]
    Argument {
        /// Which.
        what: &'static str,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
    /// A target that the arm cannot be brought to.
    #[error(transparent)]
    SetPoint(#[from] CompensateError),
}

impl KinematicsError {
    pub(crate) fn argument(what: &'static str, problem: impl Into<String>) -> KinematicsError {
        KinematicsError::Argument { what, problem: problem.into() }
    }
}
