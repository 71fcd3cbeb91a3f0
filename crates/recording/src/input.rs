//! Files that a command was given: each is noted when it is read or named, and nothing is ever written over it.
//!
//! The register belongs to the process, because a command is a process: whatever reads goes through [`open`] or
//! [`read_to_string`] (a lint refuses `std::fs` in their place), and whatever writes, through
//! [`crate::atomic`], asks it. Nothing has to be handed from one to the other, so nothing can be forgotten on the way.
//!
//! A file is known by what it is and not by how it is spelt: by device, inode and time of birth (an inode is used again
//! when its file is gone), and, where a system has none of these, by its real path.

#![allow(clippy::disallowed_methods, reason = "this is where inputs are read")]

use std::collections::BTreeMap;
use std::fs::{File, Metadata};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Every input of this process, as it was named first.
static INPUTS: Mutex<BTreeMap<Identity, PathBuf>> = Mutex::new(BTreeMap::new());

/// What makes a file the same file.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Identity {
    #[cfg(unix)]
    Inode {
        device: u64,
        inode: u64,
        born: Option<std::time::SystemTime>,
    },
    Path(PathBuf),
}

/// Opens an input.
pub fn open(path: &Path) -> io::Result<File> {
    let file = File::open(path)?;
    remember(path, &file.metadata()?);
    Ok(file)
}

/// Reads an input that is text.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// Notes an input that will be read later, so that no output is begun in its place. What is not there, or no file, is none.
pub fn note(path: &Path) {
    if let Ok(about) = std::fs::metadata(path) {
        remember(path, &about);
    }
}

/// The input that this file is, as it was named; `None` if it is none.
pub(crate) fn noted(path: &Path) -> Option<PathBuf> {
    let about = std::fs::metadata(path).ok()?;
    let inputs = inputs();
    identities(path, &about).iter().find_map(|identity| inputs.get(identity)).cloned()
}

fn remember(path: &Path, about: &Metadata) {
    if about.is_file() {
        let mut inputs = inputs();
        for identity in identities(path, about) {
            inputs.entry(identity).or_insert_with(|| path.to_owned());
        }
    }
}

fn inputs() -> MutexGuard<'static, BTreeMap<Identity, PathBuf>> {
    // Whoever panicked while holding it has at worst left one out that was being added.
    INPUTS.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(unix)]
fn identities(path: &Path, about: &Metadata) -> Vec<Identity> {
    use std::os::unix::fs::MetadataExt as _;
    let inode = Identity::Inode { device: about.dev(), inode: about.ino(), born: about.created().ok() };
    std::iter::once(inode).chain(path.canonicalize().ok().map(Identity::Path)).collect()
}

#[cfg(not(unix))]
fn identities(path: &Path, _: &Metadata) -> Vec<Identity> {
    path.canonicalize().ok().map(Identity::Path).into_iter().collect()
}
