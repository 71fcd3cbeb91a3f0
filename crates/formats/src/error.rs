//! What a format cannot hold.

use crate::Format;
use armcal_model::ModelError;

/// Why an arm is not written in a format.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum FormatError {
    /// The format has no place for such an arm.
    #[error("this arm cannot be written as {format}: {problem}")]
    CannotHold { format: Format, problem: String },
    /// The file that the hash of a UR's calibration should come from.
    #[error("the hash of the arm's kinematics: {0}")]
    Hash(String),
    /// The model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Rows as CSV.
    #[error("writing DH rows as CSV: {0}")]
    Csv(#[from] csv::Error),
}
