//! What may be written over: nothing but what armcal itself made, of the same kind, and never an input.
//!
//! Asked twice: by name, before hours of work, and by content, when a finished file is to get its name.

#![allow(clippy::disallowed_methods, reason = "what is at the place of an output is no input")]

use crate::RecordingError;
use crate::bytes::input;
use crate::bytes::url::is_url;
use crate::write::mark::{Mark, attached_to_run};
use crate::write::seal::sealed_bytes;
use std::io;
use std::path::{Path, PathBuf};

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
/// that armcal did not make or that somebody changed since.
///
/// # Errors
/// [`RecordingError::NoFile`], [`RecordingError::IsInput`], [`RecordingError::NotOurs`], or a folder at `target`.
pub fn may_write(target: &Path) -> Result<(), RecordingError> {
    may_write_over(target, Over::Unchanged)
}

/// The same where it is said what may be lost.
///
/// # Errors
/// As [`may_write`].
pub fn may_write_over(target: &Path, over: Over) -> Result<(), RecordingError> {
    match existing_target(target, over)? {
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

/// What an output may take the place of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// What armcal made and nobody has changed since.
    Unchanged,
    /// What armcal made, changed or not: somebody asked for that.
    Changed,
}

/// Whether just these bytes may be written to `target`: where they are there already, too.
///
/// # Errors
/// As [`may_write`], and a result of another kind.
pub fn may_put(target: &Path, bytes: &[u8]) -> Result<(), RecordingError> {
    let bytes = &sealed_bytes(bytes);
    if is_there(target, bytes)? {
        return Ok(());
    }
    check_replaceable(target, existing_target(target, Over::Unchanged)?, Mark::of_text(bytes))
}

/// Whether a file has just this content; an input is an error even then.
pub(crate) fn is_there(target: &Path, bytes: &[u8]) -> Result<bool, RecordingError> {
    refuse_input(target)?;
    Ok(file_has_content(target, bytes))
}

/// Whether a file, and no link to one, has just this content.
pub fn file_has_content(path: &Path, bytes: &[u8]) -> bool {
    let plain = path.symlink_metadata().is_ok_and(|a| a.is_file() && a.len() == bytes.len() as u64);
    plain && std::fs::read(path).is_ok_and(|there| there == bytes)
}

/// Whether a finished file may take the place of `target`; says whether there is anything to replace.
pub(crate) fn may_replace(target: &Path, finished: &Path, over: Over) -> Result<bool, RecordingError> {
    let there = existing_target(target, over)?;
    if let There::Nothing = there {
        return Ok(false);
    }
    let failed = |e: io::Error| RecordingError::Write { path: target.to_owned(), why: e.to_string() };
    check_replaceable(target, there, Mark::of_file(finished).map_err(failed)?).map(|()| true)
}

fn check_replaceable(target: &Path, there: There, new: Option<Mark>) -> Result<(), RecordingError> {
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

/// What an output can be: a file here. A path such as `s3://bucket/out` would quietly become a folder called `s3:`.
fn refuse_url(target: &Path) -> Result<(), RecordingError> {
    if is_url(target) { Err(RecordingError::NoFile { path: target.to_owned() }) } else { Ok(()) }
}

fn existing_target(target: &Path, over: Over) -> Result<There, RecordingError> {
    refuse_url(target)?;
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
    if let Some(what) = input::irregular_kind(&about) {
        return Ok(There::Foreign(format!("is {what}")));
    }
    if about.len() == 0 {
        return Ok(There::Empty);
    }
    let unread = |e: &dyn std::fmt::Display| {
        Ok(There::Foreign(format!("cannot be read ({e}), so armcal cannot know it for its own")))
    };
    match Mark::of_file(target) {
        Ok(Some(mark)) => Ok(match mark.edited() {
            Some(what) if over == Over::Unchanged => There::Foreign(what.to_owned()),
            _ => There::Ours(Some(mark)),
        }),
        Ok(None) => match attached_to_run(target) {
            Ok(true) => Ok(There::Ours(None)),
            Ok(false) => Ok(There::Foreign("was not made by armcal".to_owned())),
            Err(e) => unread(&e),
        },
        Err(e) => unread(&e),
    }
}

/// Makes the folder of results that somebody named, if need be.
///
/// # Errors
/// What is no folder here; what the system refuses.
pub fn make_folder(folder: &Path) -> Result<(), RecordingError> {
    refuse_url(folder)?;
    std::fs::create_dir_all(folder)
        .map_err(|source| RecordingError::Folder { path: folder.to_owned(), source })
}

/// Makes a folder inside one of results, if need be. The name of the outer one is the user's, and may be a link; what is in it
/// is armcal's, and a link there would lead the results somewhere else.
///
/// # Errors
/// As [`make_folder`], and a link.
pub fn make_folder_in(outer: &Path, inner: impl AsRef<Path>) -> Result<PathBuf, RecordingError> {
    make_folder(outer)?;
    let mut folder = outer.to_owned();
    for name in inner.as_ref() {
        folder.push(name);
        if folder.is_symlink() {
            return Err(not_ours(&folder, "is a link".to_owned()));
        }
        make_folder(&folder)?;
    }
    Ok(folder)
}

fn refuse_input(target: &Path) -> Result<(), RecordingError> {
    match input::registered_path(target) {
        Some(input) => Err(RecordingError::IsInput { path: target.to_owned(), input }),
        None => Ok(()),
    }
}

fn not_ours(path: &Path, what: String) -> RecordingError {
    RecordingError::NotOurs { path: path.to_owned(), what }
}
