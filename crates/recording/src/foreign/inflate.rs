//! Files and messages that are compressed as a whole (zstd), as rosbag2 does with `compression_mode` FILE and MESSAGE.

use super::copy::no_room;
use crate::RecordingError;
use crate::layout::Damage;
use crate::map::Map;
use std::borrow::Cow;
use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, Write as _};
use std::path::Path;
use zstd::stream::read::Decoder;

/// How a zstd frame begins (RFC 8878, 3.1.1).
pub(super) const MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Inflated and written at once.
const BUFFER_BYTES: usize = 1 << 20;
/// The most that one message may inflate to, as a chunk of an MCAP file.
const MAX_MESSAGE_BYTES: u64 = 1 << 30;
/// The most that a file may inflate to: this, and so many times its size. No recording that is worth its room comes near.
const MAX_FILE_BYTES: u64 = 1 << 30;
const MAX_FILE_TIMES: u64 = 1000;

/// Inflates a file into another. What ends or goes wrong on the way is damage; all before it is there.
pub(super) fn whole(map: &Map, path: &Path, to: &mut File) -> Result<Option<Damage>, RecordingError> {
    let limit = MAX_FILE_BYTES + (map.len() as u64).saturating_mul(MAX_FILE_TIMES);
    let mut decoder = Decoder::with_buffer(&map[..]).map_err(no_room(path))?;
    let (mut buffer, mut written, mut at) = (vec![0; BUFFER_BYTES], 0, 0);
    let why = loop {
        match decoder.read(&mut buffer) {
            Ok(0) => return Ok(None),
            Ok(_) if written > limit => break format!("it inflates to more than {limit} bytes"),
            Ok(bytes) => to.write_all(&buffer[..bytes]).map_err(no_room(path))?,
            Err(e) if e.kind() == ErrorKind::UnexpectedEof => {
                break "what is compressed is cut off".to_owned();
            }
            Err(e) => break format!("what is compressed is damaged near here ({e})"),
        }
        let now = map.len() - decoder.get_ref().len();
        map.passed(at..now);
        (at, written) = (now, to.stream_position().map_err(no_room(path))?);
    };
    Ok(Some(Damage { offset: at, why: format!("{why}, and is read no further"), lost: true }))
}

/// A message, inflated where it is compressed. No CDR message begins as compressed ones do.
///
/// # Errors
/// What is compressed is damaged or too large, in words.
pub fn inflated(data: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    if !data.starts_with(&MAGIC) {
        return Ok(data.into());
    }
    let failed = |e: std::io::Error| format!("what is compressed is damaged: {e}");
    let mut inflated = Vec::new();
    let decoder = Decoder::with_buffer(data).map_err(failed)?;
    decoder.take(MAX_MESSAGE_BYTES + 1).read_to_end(&mut inflated).map_err(failed)?;
    match inflated.len() as u64 > MAX_MESSAGE_BYTES {
        true => Err(format!("it inflates to more than {MAX_MESSAGE_BYTES} bytes")),
        false => Ok(inflated.into()),
    }
}
