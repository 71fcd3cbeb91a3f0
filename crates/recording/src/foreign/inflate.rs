//! Files and messages that are compressed as a whole (zstd), as rosbag2 does with `compression_mode` FILE and MESSAGE.

use crate::RecordingError;
use crate::bytes::budget::Allowance;
use crate::bytes::map::Map;
use crate::error::no_room;
use crate::structure::damage::Damage;
use std::borrow::Cow;
use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::Path;
use zstd::stream::read::Decoder;

/// How a zstd frame begins (RFC 8878, 3.1.1).
pub(super) const MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// Inflated and written at once.
const BUFFER_BYTES: usize = 1 << 20;
/// A message is inflated, and paid for, in steps of this size.
const STEP_BYTES: u64 = 64 << 10;

/// Inflates a file into another. What ends or goes wrong on the way is damage; all before it is there.
pub(super) fn to_file(
    map: &Map,
    path: &Path,
    to: &mut File,
    allowance: &Allowance,
) -> Result<Option<Damage>, RecordingError> {
    let mut decoder = Decoder::with_buffer(&map[..]).map_err(no_room(path))?;
    let (mut buffer, mut at) = (vec![0; BUFFER_BYTES], 0);
    let why = loop {
        match decoder.read(&mut buffer) {
            Ok(0) => return Ok(None),
            Ok(bytes) if !allowance.takes(bytes as u64) => break allowance.refusal(),
            Ok(bytes) => to.write_all(&buffer[..bytes]).map_err(no_room(path))?,
            Err(e) if e.kind() == ErrorKind::UnexpectedEof => {
                break "what is compressed is cut off".to_owned();
            }
            Err(e) => break format!("what is compressed is damaged near here ({e})"),
        }
        let now = map.len() - decoder.get_ref().len();
        map.passed(at..now);
        at = now;
    };
    Ok(Some(Damage { offset: at, why: format!("{why}, and is read no further"), lost: true }))
}

/// A message, inflated where it is compressed, as long as the allowance of its recording lasts. No CDR message begins as
/// compressed ones do.
///
/// # Errors
/// What is compressed is damaged or too large, in words.
pub fn inflate_message<'a>(data: &'a [u8], allowance: &Allowance) -> Result<Cow<'a, [u8]>, String> {
    if !data.starts_with(&MAGIC) {
        return Ok(data.into());
    }
    let failed = |e: std::io::Error| format!("what is compressed is damaged: {e}");
    let mut inflated = Vec::new();
    let mut decoder = Decoder::with_buffer(data).map_err(failed)?;
    loop {
        let step = decoder.by_ref().take(STEP_BYTES).read_to_end(&mut inflated).map_err(failed)? as u64;
        if !allowance.takes(step) {
            return Err(allowance.refusal());
        }
        if step < STEP_BYTES {
            return Ok(inflated.into());
        }
    }
}
