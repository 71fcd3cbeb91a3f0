//! Opening a recording: its files laid out, and looked into where no summary has their definitions.

use crate::RecordingError;
use crate::bytes::Access;
use crate::bytes::budget::Allowance;
use crate::foreign::names::{files_of, is_recording, without_ending};
use crate::recording::Recording;
use crate::recording::file::RecordingFile;
use crate::recording::sweep::{blocks_within_budget, sweep};
use crate::structure::survey::FileSurvey;
use rayon::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};

impl Recording {
    /// Opens the files of one recording, in any order: paths, or URLs such as `s3://bucket/key` (feature `s3`). Local
    /// files are mapped, unless the environment variable `ARMCAL_NO_MMAP` is set: see [`Access`].
    ///
    /// # Errors
    /// As [`Recording::open_with`].
    pub fn open(paths: &[PathBuf]) -> Result<Recording, RecordingError> {
        Recording::open_with(paths, Access::from_env())
    }

    /// Opens the files of one recording; a folder stands for the recordings in it. Their structure is found without
    /// inflating anything, unless a file has no sound summary. Objects, and local files with [`Access::Ranges`], are read by ranges: the summary first, later
    /// only chunks with a wanted channel. One without a sound summary is copied whole to an unnamed file in the folder
    /// for temporary files, and read from there; so are the messages of a rosbag2 database and of a file that is compressed
    /// as a whole.
    ///
    /// # Errors
    /// No paths, a path listed twice, a file that cannot be opened or is no recording, an object that is not there or cannot
    /// be reached. A damaged MCAP file is no error: see [`RecordingReport::warnings`].
    pub fn open_with(paths: &[PathBuf], access: Access) -> Result<Recording, RecordingError> {
        if paths.is_empty() {
            return Err(RecordingError::NoFiles);
        }
        let paths = &files_of(paths);
        refuse_repeated(paths)?;
        let open = |path: &PathBuf| RecordingFile::open(path, access, paths.len());
        let mut files = paths.par_iter().map(open).collect::<Result<Vec<_>, _>>()?;
        files.sort_by_key(|f| f.layout.first_ns.unwrap_or(u64::MAX));
        let surveys = Mutex::new(vec![FileSurvey::default(); files.len()]);
        let passes = Allowance::of_passes(files.iter().map(|file| file.original().len()).sum());
        let mut recording = Recording { files, surveys, judged: OnceLock::new(), passes };
        recording.complete_definitions()?;
        recording.substitute_definitions()?;
        Ok(recording)
    }

    /// Looks into the chunks for definitions where no summary repeats them all.
    fn complete_definitions(&mut self) -> Result<(), RecordingError> {
        if self.files.iter().any(|f| !f.layout.definitions_complete) {
            // Some blocks at a time, so that what each of them repeats is not held at once.
            let (unread, most) = (self.unread(), 4 * rayon::current_num_threads());
            let mut left = &unread[..];
            while !left.is_empty() {
                let now;
                (now, left) = left.split_at(blocks_within_budget(&self.files, left, most));
                let (found, _) = sweep(self, now, |_| (), |(), _, _| ())?;
                self.remember(found);
                let surveys = self.surveys.get_mut().unwrap_or_else(PoisonError::into_inner);
                for (file, survey) in self.files.iter_mut().zip(surveys) {
                    if let Err(why) = file.layout.definitions.merge(std::mem::take(&mut survey.definitions)) {
                        file.layout.faults.lost(0, || format!("in its chunks: {why}"));
                    }
                }
            }
            let surveys = self.surveys.get_mut().unwrap_or_else(PoisonError::into_inner);
            for (file, survey) in self.files.iter_mut().zip(surveys) {
                // Whoever reads a block again only compares with these.
                file.layout.definitions_complete = true;
                let first = survey.tallies.values().map(|t| t.first_ns).min();
                file.layout.first_ns = first.or(file.layout.first_ns);
            }
        }
        for file in &mut self.files {
            file.layout.definitions.resolve();
            file.annotate();
        }
        Ok(())
    }
}

/// The same file twice, or a part of a bag beside what it was converted to, would silently double every message.
fn refuse_repeated(paths: &[PathBuf]) -> Result<(), RecordingError> {
    let mut real: Vec<(PathBuf, &PathBuf)> =
        paths.iter().map(|p| (p.canonicalize().unwrap_or_else(|_| p.clone()), p)).collect();
    real.sort();
    if let Some(pair) = real.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(RecordingError::ListedTwice { path: pair[1].1.clone() });
    }
    let mut parts: Vec<(PathBuf, &PathBuf)> = real
        .into_iter()
        .filter(|(_, p)| is_recording(p))
        .map(|(real, p)| (without_ending(&real), p))
        .collect();
    parts.sort();
    match parts.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => Err(RecordingError::TwoForms { path: pair[0].1.clone(), other: pair[1].1.clone() }),
        None => Ok(()),
    }
}
