//! What can go wrong in a diagnosis.

/// Why a diagnosis could not be made.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// Matrices of the problem do not belong together.
    #[error("diagnosis: {what} has {found} rows or entries, {expected} are needed")]
    Shape {
        /// Which matrix or vector.
        what: String,
        /// Its size.
        found: usize,
        /// The size that fits.
        expected: usize,
    },
    /// A number is not finite.
    #[error(
        "diagnosis: {what} holds a number that is not finite; check the observations and the start values"
    )]
    NotFinite {
        /// Which matrix or vector.
        what: String,
    },
    /// Too little data to judge anything.
    #[error(
        "diagnosis: {rows} residual rows for {parameters} parameters leave nothing to judge by; record more dwells \
         or fix parameters (free = false)"
    )]
    TooFew {
        /// Residual rows.
        rows: usize,
        /// Free parameters.
        parameters: usize,
    },
    /// A key of the configuration is out of range.
    #[error("diagnosis.{key} = {value}: {why}")]
    BadConfig {
        /// The key.
        key: &'static str,
        /// Its value.
        value: String,
        /// What is allowed.
        why: &'static str,
    },
    /// A name that the catalogue or the arm does not have.
    #[error("diagnosis.{key}, {effect}: {source}")]
    BadEffect {
        /// The key.
        key: &'static str,
        /// What stands there.
        effect: String,
        /// What is wrong with it.
        source: armcal_model::ModelError,
    },
    /// An effect cannot be put into the model.
    #[error("diagnosis: {0}")]
    Model(#[from] armcal_model::ModelError),
    /// A refit failed.
    #[error("diagnosis: {0}")]
    Calibrate(#[from] armcal_calibrate::CalibrateError),
}
