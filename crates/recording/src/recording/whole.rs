//! What tells the content of a whole file from any other.

use crate::RecordingError;
use crate::bytes::url;
use crate::bytes::{Access, FileBytes};
use crate::foreign;
use sha2::{Digest as _, Sha256};
use std::path::Path;

/// What tells the content of a file or object from any other, without reading its records: as
/// [`crate::FileReport::identity`]; of a database with the log beside it, which is read with it.
///
/// # Errors
/// A file or object that cannot be opened or read, is empty or a folder.
pub fn identity_of(path: &Path) -> Result<String, RecordingError> {
    let bytes = FileBytes::open(path, Access::from_env())?;
    let (identity, _) = bytes.identity(0)?;
    bytes.unshortened(path)?;
    // Nothing stands beside an object.
    let log = if !url::is_url(path) && foreign::is_database(&bytes)? {
        foreign::log_identity(path)?
    } else {
        String::new()
    };
    Ok(identity + &log)
}

/// SHA-256 of a whole file, hexadecimal, for whoever compares it with what `sha256sum` prints.
///
/// # Errors
/// As [`identity_of`].
pub fn sha256_of(path: &Path) -> Result<String, RecordingError> {
    let mut hasher = Sha256::new();
    let bytes = FileBytes::open(path, Access::from_env())?;
    match &bytes {
        FileBytes::Mapped(map) => map.pieces(0..map.len(), |piece| hasher.update(piece)),
        FileBytes::Ranged(ranged) => ranged.each_round(&mut |piece| {
            hasher.update(piece);
            Ok(())
        })?,
    }
    bytes.unshortened(path)?;
    Ok(hex::encode(hasher.finalize()))
}
