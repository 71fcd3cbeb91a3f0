//! What stops a command.

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A name on the command line that means nothing.
    #[error(transparent)]
    Usage(armcal_lab::LabError),
    /// A scenario without an answer.
    #[error(transparent)]
    Score(#[from] armcal_score::ScoreError),
    /// The suite of mistakes.
    #[error(transparent)]
    Mistakes(#[from] armcal_mistakes::Error),
    /// Starting threads, or printing.
    #[error(transparent)]
    Program(#[from] armcal::Error),
    /// Writing a page.
    #[error(transparent)]
    Output(armcal_recording::RecordingError),
}

impl Error {
    /// What the program exits with: 2 where the user asked for something that cannot be, 1 otherwise.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Error::Usage(_)) { 2 } else { 1 }
    }
}
