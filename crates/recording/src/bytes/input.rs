//! Files that a command was given: each is noted when it is read or named, and nothing is ever written over it.
//!
//! The register belongs to the process, because a command is a process: whatever reads goes through [`open`] or
//! [`read_to_string`] (a lint refuses `std::fs` in their place), and whatever writes, through
//! [`crate::write::atomic`], asks it. Nothing has to be handed from one to the other, so nothing can be forgotten on the way.
//!
//! A file is known by what it is and not by how it is spelt: by device, inode and time of birth (an inode is used again
//! when its file is gone), and, where a system has none of these, by its real path.

#![allow(clippy::disallowed_methods, reason = "this is where inputs are read")]

use std::collections::BTreeMap;
use std::fs::{File, Metadata};
use std::io::{self, Read as _, Seek as _};
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

/// What an input is read as, and with that how large it may be: more is not read, whatever the system says of its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// What people write: pipelines, boards, models of arms.
    Text,
    /// What programs write: tables, lists of recordings, results.
    Data,
}

impl Kind {
    /// The most that is read [bytes].
    pub fn most_bytes(self) -> u64 {
        match self {
            Kind::Text => 16 << 20,
            Kind::Data => 256 << 20,
        }
    }
}

/// Opens an input: a file, and nothing else that has a name. A pointer that Git LFS left in its place is none.
///
/// # Errors
/// A pipe, a device, a socket, a folder or a pointer, each by what it is; what the system refuses.
pub fn open(path: &Path) -> io::Result<File> {
    let file = open_regular(path)?;
    refuse_pointer(&file)?;
    add_to_register(path, &file.metadata()?);
    Ok(file)
}

/// Reads an input that is text.
///
/// # Errors
/// As [`open`] and [`read_on`]; bytes that are no UTF-8.
pub fn read_to_string(path: &Path, kind: Kind) -> io::Result<String> {
    let mut bytes = Vec::new();
    read_on(&mut open(path)?, kind, &mut bytes)?;
    String::from_utf8(bytes).map_err(|_| invalid_input("it is not UTF-8 text".to_owned()))
}

/// Reads the rest of an input of which `bytes` has the beginning.
///
/// # Errors
/// More bytes than an input of its kind has.
pub fn read_on(file: &mut File, kind: Kind, bytes: &mut Vec<u8>) -> io::Result<()> {
    let most = kind.most_bytes();
    file.take((most + 1).saturating_sub(bytes.len() as u64)).read_to_end(bytes)?;
    if bytes.len() as u64 > most {
        return Err(invalid_input(format!(
            "it is larger than the {} MiB that such a file may have",
            most >> 20
        )));
    }
    Ok(())
}

/// Opens a file that is read but no input, such as what is at the place of an output.
///
/// # Errors
/// As [`open`], but for the pointer.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Asked before, because opening some devices does something, and after, because the name may lead elsewhere by then.
    refuse_irregular(&std::fs::metadata(path)?)?;
    let mut options = File::options();
    options.read(true);
    // Opening a pipe would wait for whoever writes to it.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK | libc::O_NOCTTY);
    let file = options.open(path)?;
    refuse_irregular(&file.metadata()?)?;
    Ok(file)
}

/// What a name leads to that is no file, in words.
pub(crate) fn irregular_kind(about: &Metadata) -> Option<&'static str> {
    let kind = about.file_type();
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if kind.is_fifo() {
            return Some("a pipe");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
    }
    match (kind.is_file(), kind.is_dir()) {
        (true, _) => None,
        (_, true) => Some("a folder"),
        _ => Some("a device"),
    }
}

fn refuse_irregular(about: &Metadata) -> io::Result<()> {
    match irregular_kind(about) {
        None => Ok(()),
        Some("a folder") => Err(invalid_input("it is a folder, where a file belongs".to_owned())),
        Some(what) => {
            Err(invalid_input(format!("it is {what}, and only files are read: copy what it gives into one")))
        }
    }
}

/// How a file begins that stands for another one.
const POINTERS: [&[u8]; 2] =
    [b"version https://git-lfs.github.com/spec/", b"version https://hawser.github.com/spec/"];

fn refuse_pointer(mut file: &File) -> io::Result<()> {
    let mut head = Vec::new();
    file.take(64).read_to_end(&mut head)?;
    file.rewind()?;
    if POINTERS.iter().any(|begins| head.starts_with(begins)) {
        let why =
            "it is a Git LFS pointer, which only names the file: `git lfs pull` fetches the file itself";
        return Err(invalid_input(why.to_owned()));
    }
    Ok(())
}

fn invalid_input(why: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why)
}

/// Notes an input that will be read later, so that no output is begun in its place. What is not there, or no file, is none.
pub fn register_path(path: &Path) {
    if let Ok(about) = std::fs::metadata(path) {
        add_to_register(path, &about);
    }
}

/// The input that this file is, as it was named; `None` if it is none.
pub(crate) fn registered_path(path: &Path) -> Option<PathBuf> {
    let about = std::fs::metadata(path).ok()?;
    let inputs = lock_inputs();
    identities(path, &about).iter().find_map(|identity| inputs.get(identity)).cloned()
}

fn add_to_register(path: &Path, about: &Metadata) {
    if about.is_file() {
        let mut inputs = lock_inputs();
        for identity in identities(path, about) {
            inputs.entry(identity).or_insert_with(|| path.to_owned());
        }
    }
}

fn lock_inputs() -> MutexGuard<'static, BTreeMap<Identity, PathBuf>> {
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::net::UnixListener;

    #[test]
    fn only_files_are_read_and_everything_else_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let made = std::process::Command::new("mkfifo").arg(path("pipe")).status();
        assert!(made.is_ok_and(|status| status.success()));
        let _socket = UnixListener::bind(path("socket")).expect("bound");
        std::os::unix::fs::symlink(path("pipe"), path("link")).expect("linked");
        std::fs::write(path("large"), "").expect("written");
        let large = File::options().write(true).open(path("large")).expect("opened");
        large.set_len(Kind::Text.most_bytes() + 1).expect("a hole");
        std::fs::write(path("bytes"), [0xff, 0xfe]).expect("written");
        std::fs::write(path("lfs"), "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
            .expect("written");
        for (name, what) in [
            ("pipe", "a pipe"),
            ("link", "a pipe"),
            ("socket", "a socket"),
            (".", "a folder"),
            ("/dev/zero", "a device"),
            ("large", "16 MiB"),
            ("bytes", "UTF-8"),
            ("lfs", "git lfs pull"),
        ] {
            let error = read_to_string(&path(name), Kind::Text).expect_err(name).to_string();
            assert!(error.contains(what), "{name}: {error}");
        }
        assert!(read_to_string(&path("large"), Kind::Data).is_ok(), "of a kind that may be so large");
        let missing = open(&path("missing")).expect_err("missing");
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
