//! What can go wrong with a board, a tilt or an association.

use std::path::PathBuf;

/// Errors of this crate; each names the file, key or recording, and what to do next.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file is not TOML, or a value has the wrong type, or a required key is missing.
    #[error("reading the board file {}: {message}", path.display())]
    Syntax {
        /// The board file.
        path: PathBuf,
        /// What the parser says, with line and column.
        message: String,
    },
    /// A key nobody knows.
    #[error("reading the board file {}: unknown key `{key}`{}; known keys here: {known}", path.display(), hint(.suggestion))]
    UnknownKey {
        /// The board file.
        path: PathBuf,
        /// The key with the table it is in.
        key: String,
        /// The nearest known key.
        suggestion: Option<String>,
        /// All keys known in that table.
        known: String,
    },
    /// A value that makes no sense.
    #[error("reading the board file {}: {what}", path.display())]
    Invalid {
        /// The board file.
        path: PathBuf,
        /// Which key, which value, and what is allowed.
        what: String,
    },
    /// Two cavities with one name.
    #[error("reading the board file {}: cavities {first} and {second} (counted from 1) are both named `{name}`; give each its own name", path.display())]
    DuplicateName {
        /// The board file.
        path: PathBuf,
        /// The name.
        name: String,
        /// Position of the first in the file, from 1.
        first: usize,
        /// Position of the second in the file, from 1.
        second: usize,
    },
    /// Two cavities in one place.
    #[error("reading the board file {}: cavities `{first}` and `{second}` are only {distance_mm:.3} mm apart; a tip cannot tell them apart, so remove one or correct its xyz_mm (in millimetres, not metres or inches)", path.display())]
    Coincident {
        /// The board file.
        path: PathBuf,
        /// The first cavity.
        first: String,
        /// The second cavity.
        second: String,
        /// Their distance [mm].
        distance_mm: f64,
    },
    /// A tilt the mechanism cannot make.
    #[error(
        "tilting board `{board}`: {axis}_deg = {value_deg:.3} is beyond the limit of the mechanism, max_{axis}_deg = {limit_deg}; correct the tilt, or raise the limit in the board file if the mechanism reaches further"
    )]
    TiltLimit {
        /// The board.
        board: String,
        /// `roll` or `pitch`.
        axis: &'static str,
        /// The tilt asked for [deg].
        value_deg: f64,
        /// The limit [deg].
        limit_deg: f64,
    },
    /// A tilt that is not a number.
    #[error("tilting board `{board}`: roll_deg and pitch_deg must be finite numbers")]
    TiltNotFinite {
        /// The board.
        board: String,
    },
    /// A tilt of a board that has no mechanism.
    #[error(
        "tilting board `{board}`: its file has no [mechanism]; add pivot_xyz_mm, roll_axis, pitch_axis, max_roll_deg and max_pitch_deg, or remove the tilt"
    )]
    NoMechanism {
        /// The board.
        board: String,
    },
    /// A configuration value that makes no sense.
    #[error("association of dwells to cavities: {what}")]
    Config {
        /// Which key, which value, and what is allowed.
        what: String,
    },
    /// The board cannot be the one that was visited, or its pose is wrong.
    #[error(
        "board `{board}` does not fit the dwells of this recording: {what}. Check that the board file is the board that was used, that its pose and tilt are right, that the model's base and tool are right, and that the arm rested in its cavities"
    )]
    DoesNotFit {
        /// The board.
        board: String,
        /// The best explanation found: how many dwells it explains and how badly.
        what: String,
        /// Root mean square distance per axis between aligned tips and cavities in the best explanation [m];
        /// NaN when not even one was found.
        best_rms_m: f64,
    },
}

fn hint(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map(|s| format!(", did you mean `{s}`?")).unwrap_or_default()
}
