//! What can go wrong in the lab.

use std::path::PathBuf;

/// Why a simulation could not be run.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum LabError {
    /// A file named by the configuration could not be read.
    #[error("reading the {what} {path}: {source}", path = path.display())]
    Read { what: &'static str, path: PathBuf, source: std::io::Error },
    /// A TOML file does not say what it should.
    #[error("the {what} {path} is not valid: {source}", path = path.display())]
    Parse { what: &'static str, path: PathBuf, source: Box<toml::de::Error> },
    /// A file of set-points does not say what it should.
    #[error("the set-points {path}: {why}", path = path.display())]
    SetPoints { path: PathBuf, why: String },
    /// A value that the lab cannot work with.
    #[error("lab key `{key}`: {why}")]
    Value { key: String, why: String },
    /// The true or the nominal arm cannot get to where the task sends it.
    #[error(
        "recording `{recording}`: the {arm} arm stays {short_by_mm:.1} mm away from {what}; move the board \
         (`board.in_base`) or choose another seed"
    )]
    Unreachable {
        recording: String,
        /// `true` or `nominal`.
        arm: &'static str,
        what: String,
        short_by_mm: f64,
    },
    /// One of two joined arms cannot get to where the hand leads the tips.
    #[error(
        "recording `{recording}`: an arm stays {short_by_mm:.1} mm away from {what}; narrow `task.region_m`, move \
         `arms.base` or choose another seed"
    )]
    JoinedOutOfReach { recording: String, what: String, short_by_mm: f64 },
    /// No free pose that keeps clear of the board was found.
    #[error(
        "recording `{recording}`: found only {found} of {wanted} free poses that keep clear of the board and of \
         the arm's own axis; widen `task.free.range_deg` or lower `task.free.poses`"
    )]
    NoFreePose { recording: String, found: usize, wanted: usize },
    /// The folder of the results could not be made.
    #[error("making the folder {path}: {source}", path = path.display())]
    Folder { path: PathBuf, source: std::io::Error },
    /// A recording could not be written.
    #[error("writing the recording {path}: {source}", path = path.display())]
    Recording { path: PathBuf, source: Box<armcal_recording::RecordingError> },
    /// An output would replace what must stay.
    #[error(transparent)]
    InTheWay(#[from] armcal_recording::RecordingError),
    /// The truth file could not be written.
    #[error("writing the truth {path}: {why}", path = path.display())]
    Truth { path: PathBuf, why: String },
}
