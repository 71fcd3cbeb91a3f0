//! Where the bytes of a file come from: a memory map, or ranges read on demand.
//!
//! Everything after [`crate::structure::layout`] asks a [`FileBytes`]; nothing else knows which of the two it is.

pub(crate) mod budget;
pub(crate) mod identity;
pub mod input;
pub(crate) mod logs;
pub(crate) mod map;
#[cfg(any(test, not(feature = "s3")))]
pub(crate) mod no_object;
#[cfg(feature = "s3")]
pub(crate) mod object;
pub(crate) mod ranges;
pub(crate) mod remote;
pub(crate) mod shortened;
pub(crate) mod url;

use crate::bytes::logs::logs_of;
use crate::bytes::map::Map;
use crate::bytes::ranges::Ranged;
use crate::{Fetched, RecordingError};
use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

/// How local files are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Access {
    /// Memory-mapped: the fastest, and all of a file is judged. A file that is shortened meanwhile is an error on Linux; elsewhere
    /// it kills the process (SIGBUS).
    #[default]
    Mapped,
    /// By ranges, as from object storage: for files on network storage or in the hands of other programs. A file that
    /// is shortened meanwhile is an error. Chunks without a wanted channel are not read, and not judged.
    Ranges,
}

impl Access {
    /// [`Access::Ranges`] where the environment variable `ARMCAL_NO_MMAP` is set to something other than 0.
    pub fn from_env() -> Access {
        match std::env::var_os("ARMCAL_NO_MMAP") {
            Some(value) if !value.is_empty() && value != "0" => Access::Ranges,
            _ => Access::Mapped,
        }
    }
}

/// The bytes of one file.
pub(crate) enum FileBytes {
    /// All there, page by page.
    Mapped(Map),
    /// Read when asked for.
    Ranged(Ranged),
}

impl FileBytes {
    /// Opens a file, or an object by its URL. An empty file or a folder is an error that says so.
    pub fn open(path: &Path, access: Access) -> Result<FileBytes, RecordingError> {
        if url::is_url(path) {
            return Ok(FileBytes::Ranged(remote::open(path)?));
        }
        let open = |source| RecordingError::Open { path: path.to_owned(), source };
        let refused = |why: &str| RecordingError::NotMcap { path: path.to_owned(), why: why.to_owned() };
        // Looked at before it is opened: opening a pipe waits for whoever writes to it.
        let about = std::fs::metadata(path).map_err(open)?;
        if about.is_dir() {
            std::fs::read_dir(path).map_err(open)?;
            return Err(refused("it is a folder without a recording in it (.mcap, .db3); name the files"));
        }
        if let Some(what) = input::irregular_kind(&about) {
            return Err(refused(&format!("it is {what}; copy it into a file first")));
        }
        let file = input::open(path).map_err(open)?;
        if file.metadata().map_err(open)?.len() == 0 {
            let why = match logs_of(path).is_empty() {
                true => "the file is empty",
                false => {
                    "the file is empty, and the journal beside it was never put into it: nothing was stored"
                }
            };
            return Err(refused(why));
        }
        match access {
            Access::Mapped => Map::of(&file).map(FileBytes::Mapped).map_err(open),
            Access::Ranges => Ranged::local(file, path).map(FileBytes::Ranged),
        }
    }

    /// Size of the file [bytes].
    pub fn len(&self) -> u64 {
        match self {
            FileBytes::Mapped(map) => map.len() as u64,
            FileBytes::Ranged(ranged) => ranged.len(),
        }
    }

    /// One range, borrowed where it is mapped.
    pub fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, RecordingError> {
        match self {
            FileBytes::Mapped(map) => Ok(map.get(range).unwrap_or_default().into()),
            FileBytes::Ranged(ranged) => Ok(Vec::from(ranged.read_one(range)?).into()),
        }
    }

    /// What tells the content from any other: what the store says, or a hash of all of it.
    /// With it the CRC of the first `crc_to` bytes, where all of it is read.
    pub fn identity(&self, crc_to: usize) -> Result<(String, Option<u32>), RecordingError> {
        match self {
            FileBytes::Mapped(map) => Ok(map.identity()).map(|(name, crc)| (name, Some(crc))),
            FileBytes::Ranged(ranged) => ranged.identity(crc_to),
        }
    }

    /// # Errors
    /// It became shorter since it was opened, so that what was read is worth nothing.
    pub fn unshortened(&self, path: &Path) -> Result<(), RecordingError> {
        match self {
            FileBytes::Mapped(map) if map.is_shortened() => {
                let source =
                    std::io::Error::other("bytes that it had when it was opened cannot be read any more");
                Err(RecordingError::Read { path: path.to_owned(), source })
            }
            _ => Ok(()),
        }
    }

    /// Hashes what a pass has just read, while it is at hand.
    pub fn hash(&self, range: &Range<usize>) {
        if let FileBytes::Mapped(map) = self
            && let Some(pieces) = &map.hashed
        {
            pieces.hash(map, range);
        }
    }

    /// Says that a pass is done with a range.
    pub fn passed(&self, range: Range<usize>) {
        if let FileBytes::Mapped(map) = self {
            map.passed(range);
        }
    }

    /// What was read, where only parts are.
    pub fn fetched(&self) -> Option<Fetched> {
        match self {
            FileBytes::Mapped(_) => None,
            FileBytes::Ranged(ranged) => Some(ranged.fetched()),
        }
    }
}
