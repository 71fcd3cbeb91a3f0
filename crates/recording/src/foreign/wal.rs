//! The files beside a database that hold what SQLite has not put into it yet: a write-ahead log or a journal.

use crate::RecordingError;
use crate::bytes::identity::prefixed_hash;
use crate::bytes::input;
use crate::bytes::logs::logs_of;
use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::Path;

/// Bytes of the header of a write-ahead log, and of the header of a page in it (SQLite file format, section 4.1).
const HEADER_BYTES: usize = 32;
const FRAME_BYTES: usize = 24;

/// What tells the content of the logs of a database from any other; empty where there are none.
pub(crate) fn identity(database: &Path) -> Result<String, RecordingError> {
    let mut all = String::new();
    for (ending, path) in logs_of(database) {
        let mut hasher = blake3::Hasher::new();
        let read = input::open(&path).and_then(|file| hasher.update_reader(file).map(|_| ()));
        read.map_err(|source| RecordingError::Read { path, source })?;
        all += &format!("+{}:{}", &ending[1..], prefixed_hash(hasher.finalize()));
    }
    Ok(all)
}

/// Pages in a write-ahead log, by the numbers with which the log marks its own; pages of an earlier log follow them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Frames {
    /// Up to the last that is this log's own.
    pub written: u64,
    /// Whether one of them is marked otherwise, or is not whole.
    pub broken: bool,
}

/// Counts the pages; `None` where the file does not begin as a log does.
pub(super) fn count_frames(log: &Path) -> io::Result<Option<Frames>> {
    let mut file = File::open(log)?;
    let mut header = [0; HEADER_BYTES];
    if file.read_exact(&mut header).is_err() {
        return Ok(None);
    }
    let word = |bytes: &[u8], at: usize| {
        u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    };
    let page = word(&header, 8);
    if !matches!(word(&header, 0), 0x377f_0682 | 0x377f_0683) || !page.is_power_of_two() || page > 65536 {
        return Ok(None);
    }
    let marks = [word(&header, 16), word(&header, 20)];
    let (frame_bytes, length) = (FRAME_BYTES as u64 + u64::from(page), file.metadata()?.len());
    let mut found = Frames { written: 0, broken: false };
    let mut at = HEADER_BYTES as u64;
    for frame in 1.. {
        let mut head = [0; FRAME_BYTES];
        file.seek(SeekFrom::Start(at))?;
        match file.read_exact(&mut head) {
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => {
                found.broken |= at < length && length - at < FRAME_BYTES as u64;
                break;
            }
            read => read?,
        }
        let own = [word(&head, 8) == marks[0], word(&head, 12) == marks[1]];
        if own == [true, true] {
            // One that is marked otherwise stood before it.
            found.broken |= found.written + 1 != frame || length - at < frame_bytes;
            found.written = frame;
        }
        found.broken |= own[0] != own[1];
        at += frame_bytes;
    }
    Ok(Some(found))
}
