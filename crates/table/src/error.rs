//! What can go wrong with a board, a tilt or an association.

use std::path::PathBuf;

/// Errors of this crate; each names the file, key or recording, and what to do next.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum TableError {
    /// The file is not TOML, or a value has the wrong type, or a required key is missing.
    #[error("reading the board file {}: {message}", path.display())]
    Syntax { path: PathBuf, message: String },
    /// A key nobody knows.
    #[error("reading the board file {}: unknown key `{key}`{}; known keys here: {known}", path.display(), hint(.suggestion))]
    UnknownKey { path: PathBuf, key: String, suggestion: Option<String>, known: String },
    /// A value that makes no sense.
    #[error("reading the board file {}: {what}", path.display())]
    Invalid { path: PathBuf, what: String },
    /// Two cavities with one name.
    #[error("reading the board file {}: cavities {first} and {second} (counted from 1) are both named `{name}`; give each its own name", path.display())]
    DuplicateName { path: PathBuf, name: String, first: usize, second: usize },
    /// Two cavities in one place.
    #[error("reading the board file {}: cavities `{first}` and `{second}` are only {distance_mm:.3} mm apart; a tip cannot tell them apart, so remove one or correct its xyz_mm (in millimetres, not metres or inches)", path.display())]
    Coincident { path: PathBuf, first: String, second: String, distance_mm: f64 },
    /// A tilt the mechanism cannot make.
    #[error(
        "tilting board `{board}`: {axis}_deg = {value_deg:.3} is beyond the limit of the mechanism, max_{axis}_deg = {limit_deg}; correct the tilt, or raise the limit in the board file if the mechanism reaches further"
    )]
    TiltLimit {
        board: String,
        /// `roll` or `pitch`.
        axis: &'static str,
        value_deg: f64,
        limit_deg: f64,
    },
    /// A tilt that is not a number.
    #[error("tilting board `{board}`: roll_deg and pitch_deg must be finite numbers")]
    TiltNotFinite { board: String },
    /// A tilt of a board that has no mechanism.
    #[error(
        "tilting board `{board}`: its file has no [mechanism]; add pivot_xyz_mm, roll_axis, pitch_axis, max_roll_deg and max_pitch_deg, or remove the tilt"
    )]
    NoMechanism { board: String },
    /// A configuration value that makes no sense.
    #[error("association of dwells to cavities: {what}")]
    Config { what: String },
    /// The board cannot be the one that was visited, or its pose is wrong.
    #[error(
        "board `{board}` does not fit the dwells of this recording: {what}. Check that the board file is the board that was used, that its pose and tilt are right, that the model's base and tool are right, and that the arm rested in its cavities"
    )]
    DoesNotFit {
        board: String,
        what: String,
        /// Root mean square distance per axis between aligned tips and cavities in the best explanation [m];
        /// NaN when not even one was found.
        best_rms_m: f64,
    },
}

fn hint(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map(|s| format!(", did you mean `{s}`?")).unwrap_or_default()
}
