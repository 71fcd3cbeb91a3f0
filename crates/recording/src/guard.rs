//! What may be written over: nothing but what armcal itself made, of the same kind, and never an input.
//!
//! Asked twice: by name, before hours of work, and by content, when a finished file is to get its name.

#![allow(clippy::disallowed_methods, reason = "what is at the place of an output is no input")]

use crate::mark::{Mark, attached_to_run};
use crate::{RecordingError, input};
use std::io;
use std::path::Path;

/// What is at a path.
enum There {
    Nothing,
    /// A file without content: there is nothing to lose.
    Empty,
    /// A result of armcal; its kind, where it says so itself.
    Ours(Option<Mark>),
    /// What must stay, and what it is.
    Foreign(String),
}

/// Whether an output may be begun at `target`, as far as its name tells: not an input of this process, and nothing else
/// that armcal did not make.
///
/// # Errors
/// [`RecordingError::IsInput`], [`RecordingError::NotOurs`], or a folder at `target`.
pub fn may_write(target: &Path) -> Result<(), RecordingError> {
    match there(target)? {
        There::Foreign(what) => Err(not_ours(target, what)),
        _ => Ok(()),
    }
}

/// The same of several outputs: all are looked at, so that none is written where another one cannot be.
///
/// # Errors
/// As [`may_write`], of the first that cannot.
pub fn may_write_all(targets: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<(), RecordingError> {
    targets.into_iter().try_for_each(|target| may_write(target.as_ref()))
}

/// Whether just these bytes may be written to `target`: where they are there already, too.
///
/// # Errors
/// As [`may_write`], and a result of another kind.
pub fn may_put(target: &Path, bytes: &[u8]) -> Result<(), RecordingError> {
    if is_there(target, bytes)? { Ok(()) } else { fits(target, there(target)?, Mark::of_text(bytes)) }
}

/// Whether a file has just this content; an input is an error even then.
pub(crate) fn is_there(target: &Path, bytes: &[u8]) -> Result<bool, RecordingError> {
    refuse_input(target)?;
    let plain = target.symlink_metadata().is_ok_and(|a| a.is_file() && a.len() == bytes.len() as u64);
    Ok(plain && std::fs::read(target).is_ok_and(|there| there == bytes))
}

/// Whether a finished file may take the place of `target`; says whether there is anything to replace.
pub(crate) fn may_replace(target: &Path, finished: &Path) -> Result<bool, RecordingError> {
    let there = there(target)?;
    if let There::Nothing = there {
        return Ok(false);
    }
    let failed = |e: io::Error| RecordingError::Write { path: target.to_owned(), why: e.to_string() };
    fits(target, there, Mark::of_file(finished).map_err(failed)?).map(|()| true)
}

fn fits(target: &Path, there: There, new: Option<Mark>) -> Result<(), RecordingError> {
    match (there, new) {
        (There::Nothing | There::Empty, _) | (There::Ours(None), Some(_)) => Ok(()),
        (There::Ours(Some(old)), Some(new)) if new.replaces(&old) => Ok(()),
        (There::Ours(old), _) => {
            let old = old.map_or_else(String::new, |mark| format!(" ({})", mark.kind()));
            Err(not_ours(target, format!("is another result of armcal{old}")))
        }
        (There::Foreign(what), _) => Err(not_ours(target, what)),
    }
}

fn there(target: &Path) -> Result<There, RecordingError> {
    // Without following a link, which is nothing that armcal makes.
    let about = match target.symlink_metadata() {
        Ok(about) => about,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(There::Nothing),
        Err(e) => return Err(RecordingError::Write { path: target.to_owned(), why: e.to_string() }),
    };
    refuse_input(target)?;
    if target.is_dir() {
        let why = "it is a folder, not a file name".to_owned();
        return Err(RecordingError::Write { path: target.to_owned(), why });
    }
    if about.is_symlink() {
        return Ok(There::Foreign("is a link".to_owned()));
    }
    if !about.is_file() {
        return Ok(There::Foreign("is a device or a pipe".to_owned()));
    }
    if about.len() == 0 {
        return Ok(There::Empty);
    }
    let unread = |e: &dyn std::fmt::Display| {
        Ok(There::Foreign(format!("cannot be read ({e}), so armcal cannot know it for its own")))
    };
    match Mark::of_file(target) {
        Ok(Some(mark)) => Ok(There::Ours(Some(mark))),
        Ok(None) => match attached_to_run(target) {
            Ok(true) => Ok(There::Ours(None)),
            Ok(false) => Ok(There::Foreign("was not made by armcal".to_owned())),
            Err(e) => unread(&e),
        },
        Err(e) => unread(&e),
    }
}

fn refuse_input(target: &Path) -> Result<(), RecordingError> {
    match input::noted(target) {
        Some(input) => Err(RecordingError::IsInput { path: target.to_owned(), input }),
        None => Ok(()),
    }
}

fn not_ours(path: &Path, what: String) -> RecordingError {
    RecordingError::NotOurs { path: path.to_owned(), what }
}
