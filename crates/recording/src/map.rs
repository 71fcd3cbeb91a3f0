//! The bytes of a file, memory-mapped, and their SHA-256.

use crate::RecordingError;
use memmap2::Mmap;
use sha2::{Digest as _, Sha256};
use std::fs::File;
use std::path::Path;

/// Maps a file read-only. An empty file or a folder is an error that says so.
pub(crate) fn map(path: &Path) -> Result<Mmap, RecordingError> {
    let open = |source| RecordingError::Open { path: path.to_owned(), source };
    let file = File::open(path).map_err(open)?;
    let about = file.metadata().map_err(open)?;
    if about.is_dir() {
        let why = "it is a folder; name the .mcap files in it".to_owned();
        return Err(RecordingError::NotMcap { path: path.to_owned(), why });
    }
    if about.is_file() && about.len() == 0 {
        let why = "the file is empty".to_owned();
        return Err(RecordingError::NotMcap { path: path.to_owned(), why });
    }
    #[expect(unsafe_code, reason = "mapping is the only way to read gigabytes without copying them")]
    // SAFETY: the map is read-only and private to this process. Another process that truncates the file while it
    // is mapped can still kill us with SIGBUS; recordings are finished files, which nobody truncates.
    let mapped = unsafe { Mmap::map(&file) }.map_err(open)?;
    Ok(mapped)
}

/// SHA-256 of a file, hexadecimal.
///
/// # Errors
/// A file that cannot be opened, is empty or a folder.
pub fn sha256_of_file(path: &Path) -> Result<String, RecordingError> {
    Ok(sha256_hex(&map(path)?))
}

/// SHA-256, hexadecimal.
pub(crate) fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
