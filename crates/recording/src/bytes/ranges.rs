//! Bytes of a file that are read by range, on demand: an object in a store, or a local file that is not mapped.

use crate::bytes::identity::prefixed_hash;
use crate::bytes::map::Map;
use crate::{Fetched, ObjectIdentity, RecordingError};
use bytes::Bytes;
use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// The first request takes the end of the file: the summary of all but the largest recordings is in it.
pub(crate) const TAIL_BYTES: u64 = 256 << 10;
/// Wanted ranges that are no further apart than this are read at once: a request costs more than these bytes.
const GAP_BYTES: u64 = 256 << 10;
/// Ranges are not joined beyond this, so that several requests can be under way.
const JOINED_BYTES: u64 = 2 << 20;
/// A file that is copied whole is read in rounds of [`PIECES`] pieces of this size.
const PIECE_BYTES: u64 = 4 << 20;
const PIECES: u64 = 8;

/// Something whose bytes are read by range.
pub(crate) trait ReadRanges: Send + Sync {
    /// Reads every range, whole; they are in bounds.
    fn read(&self, ranges: &[Range<u64>]) -> Result<Vec<Bytes>, RecordingError>;
}

/// A file read by ranges, its size and identity, and what has been read of it.
pub(crate) struct Ranged {
    reader: Box<dyn ReadRanges>,
    size: u64,
    /// The end of the file, which opening has read.
    tail: Bytes,
    pub object: Option<ObjectIdentity>,
    bytes: AtomicU64,
    requests: AtomicU64,
}

impl Ranged {
    /// A file of `size` bytes, of which the last have been read with one request.
    pub fn new(
        reader: Box<dyn ReadRanges>,
        size: u64,
        tail: Bytes,
        object: Option<ObjectIdentity>,
    ) -> Ranged {
        let bytes = AtomicU64::new(tail.len() as u64);
        Ranged { reader, size, tail, object, bytes, requests: AtomicU64::new(1) }
    }

    /// A local file, not mapped.
    pub fn local(file: File, path: &Path) -> Result<Ranged, RecordingError> {
        let read = |source| RecordingError::Read { path: path.to_owned(), source };
        let size = file.metadata().map_err(read)?.len();
        let reader = LocalRanges { file: Mutex::new(file), path: path.to_owned() };
        let tail = reader.read_one(&(size.saturating_sub(TAIL_BYTES)..size)).map_err(read)?;
        Ok(Ranged::new(Box::new(reader), size, tail, None))
    }

    /// Size of the file [bytes].
    pub fn len(&self) -> u64 {
        self.size
    }

    /// What has been read so far.
    pub fn fetched(&self) -> Fetched {
        Fetched { bytes: self.bytes.load(Ordering::Relaxed), requests: self.requests.load(Ordering::Relaxed) }
    }

    /// Reads ranges in ascending order, near ones together. Ranges beyond the end are cut there.
    pub fn read(&self, wanted: &[Range<usize>]) -> Result<Vec<Bytes>, RecordingError> {
        let clamp = |at: usize| (at as u64).min(self.size);
        let wanted: Vec<Range<u64>> = wanted.iter().map(|r| clamp(r.start)..clamp(r.end)).collect();
        let tail_start = self.size - self.tail.len() as u64;
        let missing: Vec<_> = wanted.iter().filter(|r| r.start < tail_start).cloned().collect();
        let joined = coalesce(&missing);
        let pieces = self.fetch(&joined)?;
        let of = |range: &Range<u64>| {
            let cut = |from: u64, bytes: &Bytes| {
                bytes.slice((range.start - from) as usize..(range.end - from) as usize)
            };
            if range.start >= tail_start {
                return cut(tail_start, &self.tail);
            }
            // The last joined range that starts at or before this one is the one it went into.
            let place = joined.partition_point(|j| j.start <= range.start).saturating_sub(1);
            cut(joined[place].start, &pieces[place])
        };
        Ok(wanted.iter().map(of).collect())
    }

    /// Reads one range.
    pub fn read_one(&self, range: Range<usize>) -> Result<Bytes, RecordingError> {
        Ok(self.read(&[range])?.pop().unwrap_or_default())
    }

    /// Copies the whole file to one without a name in the folder for temporary files, and maps that.
    pub fn spool(&self, path: &Path) -> Result<Map, RecordingError> {
        let failed = |source| RecordingError::Spool { path: path.to_owned(), bytes: self.size, source };
        let mut copy = tempfile::tempfile().map_err(failed)?;
        self.each_round(&mut |bytes| copy.write_all(bytes).map_err(failed))?;
        Map::of(&copy).map_err(failed)
    }

    /// What tells its content from any other: what the store says, or a hash, for which all of it is read. With it the CRC
    /// of the first `crc_to` bytes, where all is read.
    pub fn identity(&self, crc_to: usize) -> Result<(String, Option<u32>), RecordingError> {
        if let Some(object) = &self.object {
            return Ok((object.identity(self.size), None));
        }
        let (mut hasher, mut crc, mut left) = (blake3::Hasher::new(), crc32fast::Hasher::new(), crc_to);
        self.each_round(&mut |bytes| {
            hasher.update(bytes);
            let covered = left.min(bytes.len());
            crc.update(&bytes[..covered]);
            left -= covered;
            Ok(())
        })?;
        Ok((prefixed_hash(hasher.finalize()), Some(crc.finalize())))
    }

    /// Hands the file to `f` in order, some pieces at a time in memory.
    pub fn each_round(
        &self,
        f: &mut dyn FnMut(&[u8]) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        let mut at = 0;
        while at < self.size {
            let starts = (0..PIECES).map(|i| at + i * PIECE_BYTES).take_while(|start| *start < self.size);
            let round: Vec<_> = starts.map(|start| start..self.size.min(start + PIECE_BYTES)).collect();
            self.fetch(&round)?.iter().try_for_each(|piece| f(piece))?;
            at += PIECES * PIECE_BYTES;
        }
        Ok(())
    }

    fn fetch(&self, ranges: &[Range<u64>]) -> Result<Vec<Bytes>, RecordingError> {
        let ranges_bytes: u64 = ranges.iter().map(|r| r.end - r.start).sum();
        self.bytes.fetch_add(ranges_bytes, Ordering::Relaxed);
        self.requests.fetch_add(ranges.len() as u64, Ordering::Relaxed);
        if ranges.is_empty() { Ok(Vec::new()) } else { self.reader.read(ranges) }
    }
}

/// Joins ascending ranges that are near each other.
fn coalesce(ranges: &[Range<u64>]) -> Vec<Range<u64>> {
    let mut joined: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last)
                if range.end <= last.end
                    || (range.start <= last.end + GAP_BYTES && range.end - last.start <= JOINED_BYTES) =>
            {
                last.end = last.end.max(range.end);
            }
            _ => joined.push(range.clone()),
        }
    }
    joined
}

/// A local file.
struct LocalRanges {
    file: Mutex<File>,
    path: PathBuf,
}

impl LocalRanges {
    fn read_one(&self, range: &Range<u64>) -> io::Result<Bytes> {
        // A thread that panicked while reading has left nothing but a file position, which is set anew.
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(range.start))?;
        let mut bytes = vec![0; (range.end - range.start) as usize];
        file.read_exact(&mut bytes)?;
        Ok(bytes.into())
    }
}

impl ReadRanges for LocalRanges {
    fn read(&self, ranges: &[Range<u64>]) -> Result<Vec<Bytes>, RecordingError> {
        let read = |source| RecordingError::Read { path: self.path.clone(), source };
        ranges.iter().map(|range| self.read_one(range).map_err(read)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Remembers what was asked for; byte `i` is `i % 251`.
    struct Pattern(Mutex<Vec<Range<u64>>>);

    impl ReadRanges for std::sync::Arc<Pattern> {
        fn read(&self, ranges: &[Range<u64>]) -> Result<Vec<Bytes>, RecordingError> {
            self.0.lock().expect("no panic").extend(ranges.iter().cloned());
            Ok(ranges.iter().map(|r| r.clone().map(|i| (i % 251) as u8).collect()).collect())
        }
    }

    #[test]
    fn near_ranges_are_read_together_and_every_byte_is_the_right_one() {
        const MB: usize = 1 << 20;
        let pattern = std::sync::Arc::new(Pattern(Mutex::new(Vec::new())));
        let size = 40 * MB;
        let tail: Bytes = (size - 1000..size).map(|i| (i % 251) as u8).collect();
        let file = Ranged::new(Box::new(pattern.clone()), size as u64, tail, None);
        let wanted = [
            10..20,
            // Near: joined with the one before.
            100_000..100_700,
            // Far: alone. The next would make it too long.
            10 * MB..13 * MB,
            13 * MB + 5..15 * MB,
            // Across the tail, in the tail, and beyond the end.
            size - 2000..size - 500,
            size - 700..size - 600,
            size - 10..size + 50,
        ];
        let read = file.read(&wanted).expect("readable");
        for (range, bytes) in wanted.iter().zip(&read) {
            let expected = range.clone().take_while(|i| *i < size).map(|i| (i % 251) as u8);
            assert!(expected.eq(bytes.iter().copied()), "{range:?}");
        }
        let (mb, size) = (MB as u64, size as u64);
        let asked = [10..100_700, 10 * mb..13 * mb, 13 * mb + 5..15 * mb, size - 2000..size - 500];
        assert_eq!(*pattern.0.lock().expect("no panic"), asked);
        let bytes: u64 = asked.iter().map(|r| r.end - r.start).sum();
        assert_eq!(file.fetched(), Fetched { bytes: bytes + 1000, requests: 5 });
        assert_eq!(file.spool(Path::new("pattern")).expect("copied").len(), 40 * MB);
    }
}
