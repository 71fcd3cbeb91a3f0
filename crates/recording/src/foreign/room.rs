//! No room for a copy.

use crate::RecordingError;
use std::io;
use std::path::Path;

/// Says that a copy cannot be written.
pub(super) fn no_room(path: &Path) -> impl Fn(io::Error) -> RecordingError {
    move |source| RecordingError::Copy { path: path.to_owned(), source }
}
