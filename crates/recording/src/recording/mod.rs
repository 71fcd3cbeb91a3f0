//! A recording: one or more files, and what passes over them have found and cost.

pub(crate) mod bag;
pub(crate) mod file;
pub(crate) mod judge;
pub(crate) mod judged;
pub(crate) mod losses;
pub(crate) mod open;
pub(crate) mod substitute;
pub(crate) mod sweep;
pub(crate) mod visit;
pub(crate) mod whole;
pub(crate) mod witness;

use crate::bytes::FileBytes;
use crate::bytes::budget::Allowance;
use crate::recording::file::RecordingFile;
use crate::structure::survey::{At, BlockSurvey, FileSurvey, Tally};
use crate::{RecordingError, RecordingReport};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// An opened recording, which may consist of several split files.
pub struct Recording {
    pub(crate) files: Vec<RecordingFile>,
    /// What the passes made so far have found in each file.
    pub(crate) surveys: Mutex<Vec<FileSurvey>>,
    pub(crate) judged: OnceLock<JudgedFiles>,
    /// What all passes may still inflate.
    pub(crate) passes: Allowance,
}

/// What a recording is found to be.
pub(crate) struct JudgedFiles {
    pub report: RecordingReport,
    /// A file that could not be read to its end, and why.
    pub unread: Option<(PathBuf, String)>,
}

impl Recording {
    /// What the messages of one pass may inflate to that are compressed one by one.
    pub fn allowance(&self) -> Allowance {
        Allowance::of(self.files.iter().map(|file| file.original().len()).sum(), 1)
    }

    /// Whether a pass stayed within its allowance, and all passes within theirs.
    ///
    /// # Errors
    /// It did not, so that messages are missing from what it gave.
    pub fn within(&self, allowance: &Allowance) -> Result<(), RecordingError> {
        match self.files.first().filter(|_| allowance.is_exceeded()) {
            Some(file) => Err(allowance.exceeded(&file.path)),
            None => self.pay(allowance.taken()),
        }
    }

    /// Pays for what a pass over these blocks inflates.
    ///
    /// # Errors
    /// The passes before it took all that there was.
    pub(crate) fn pays(&self, blocks: &[At]) -> Result<(), RecordingError> {
        let claims = blocks.iter().map(|at| self.files[at.file].layout.blocks[at.block].claim);
        self.pay(claims.fold(0, u64::saturating_add))
    }

    fn pay(&self, bytes: u64) -> Result<(), RecordingError> {
        match self.files.first().filter(|_| !self.passes.takes(bytes)) {
            Some(file) => Err(self.passes.exceeded(&file.path)),
            None => Ok(()),
        }
    }

    /// Leaves the identity of the files out of the passes over them: whoever does not ask for the report need not pay for it.
    pub fn without_identity(mut self) -> Recording {
        for file in &mut self.files {
            if let FileBytes::Mapped(map) = &mut file.bytes {
                map.hashed = None;
            }
        }
        self
    }

    /// Keeps what a pass found, so that the report needs no pass of its own.
    pub(crate) fn remember(&self, found: Vec<BlockSurvey>) {
        let mut surveys = self.surveys();
        for (at, survey) in found {
            surveys[at.file].add(at.block, survey);
        }
    }

    pub(crate) fn surveys(&self) -> MutexGuard<'_, Vec<FileSurvey>> {
        // Whoever panicked while holding it has at worst left a block out, which another pass finds.
        self.surveys.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts the messages of a block, unless a pass has; `remember` takes in the rest once the pass is over. The sum is the
    /// same in any order.
    pub(crate) fn count(&self, at: At, tallies: BTreeMap<u16, Tally>) {
        self.surveys()[at.file].count_block(at.block, tallies);
    }

    /// Blocks of mapped files that no pass has seen.
    pub(crate) fn unread(&self) -> Vec<At> {
        let surveys = self.surveys();
        let of_file = |((file, f), survey): ((usize, &RecordingFile), &FileSurvey)| {
            let all = if let FileBytes::Mapped(_) = f.bytes { f.layout.blocks.len() } else { 0 };
            let unread = (0..all).filter(|block| !survey.passed.contains(block));
            unread.map(|block| At { file, block }).collect::<Vec<_>>()
        };
        self.files.iter().enumerate().zip(surveys.iter()).flat_map(of_file).collect()
    }
}
