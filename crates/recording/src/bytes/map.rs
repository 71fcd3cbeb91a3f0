//! A file's bytes, memory-mapped, and its pages given back once they are used.
//!
//! Pages of a map count as the process's own memory from the moment they are touched. Reading a recording of many
//! gigabytes once would therefore look, to whoever watches the memory, like holding all of it. So everything that
//! passes over a map says which stretch it is done with, and the pages leave; they stay in the system's cache.

use crate::bytes::identity::Pieces;
use crate::bytes::shortened::Watched;
use std::fs::File;
use std::io;
use std::ops::{Deref, Range};

/// A map is given back in stretches of this size: large enough that it costs no time.
const WINDOW_BYTES: usize = 4 << 20;
/// A whole file is hashed in pieces of this size.
const PIECE_BYTES: usize = 4 << 20;

/// A file mapped read-only.
pub(crate) struct Map {
    /// Dropped first: what is not mapped any more is not watched.
    watched: Watched,
    bytes: memmap2::Mmap,
    /// What passes have hashed of it; `None` where they shall not.
    pub hashed: Option<Pieces>,
    /// Of so many bytes from the start the CRC is wanted too.
    crc_to: usize,
}

impl Map {
    /// Maps a file that is not empty.
    pub fn of(file: &File) -> io::Result<Map> {
        #[expect(unsafe_code, reason = "mapping is the only way to read gigabytes without copying them")]
        // SAFETY: the map is read-only and private to this process. Another process that truncates the file while it
        // is mapped is seen (`crate::bytes::shortened`; elsewhere than on Linux it kills us with SIGBUS).
        let bytes = unsafe { memmap2::Mmap::map(file) }?;
        let hashed = Some(Pieces::of(bytes.len()));
        Ok(Map { watched: Watched::of(&bytes), bytes, hashed, crc_to: 0 })
    }

    /// Whether the file became shorter and something behind its new end was read: then what was read is worth nothing.
    pub fn is_shortened(&self) -> bool {
        self.watched.is_shortened()
    }

    /// Says that with the identity the CRC of so many bytes from the start is wanted, before any of it is hashed.
    pub fn want_crc(&mut self, to: usize) {
        self.crc_to = to;
        if let Some(pieces) = &mut self.hashed {
            pieces.crc_to = to;
        }
    }

    /// The CRC of so many bytes from the start.
    pub fn crc(&self, to: usize) -> u32 {
        let mut crc = crc32fast::Hasher::new();
        self.pieces(0..to, |piece| crc.update(piece));
        crc.finalize()
    }

    /// Says that a pass in order of offsets is done with these bytes. They can be read again at any time.
    pub fn passed(&self, range: Range<usize>) {
        let window = range.start / WINDOW_BYTES;
        if range.end / WINDOW_BYTES != window {
            self.release(window * WINDOW_BYTES..range.end);
        }
    }

    /// Takes the pages of a range out of the process's memory.
    #[cfg(unix)]
    pub fn release(&self, range: Range<usize>) {
        let end = range.end.min(self.len());
        if range.start < end {
            #[expect(unsafe_code, reason = "there is no other way to give pages of a map back")]
            // SAFETY: the map is of a file and nothing writes to it, so pages that leave come back with the same bytes.
            // Memory that cannot be given back is no reason to stop reading.
            let _ = unsafe {
                self.bytes.unchecked_advise_range(
                    memmap2::UncheckedAdvice::DontNeed,
                    range.start,
                    end - range.start,
                )
            };
        }
    }

    /// Other systems manage the pages of a map themselves.
    #[cfg(not(unix))]
    pub fn release(&self, _: Range<usize>) {}

    /// Hands the bytes of a range to `f` in order, piece by piece.
    pub fn pieces(&self, range: Range<usize>, mut f: impl FnMut(&[u8])) {
        let mut at = range.start;
        while at < range.end {
            let end = range.end.min(at + PIECE_BYTES);
            f(&self[at..end]);
            self.release(at..end);
            at = end;
        }
    }

    /// What tells its content from any other ([`crate::bytes::identity`]), and the CRC that is wanted.
    pub fn identity(&self) -> (String, u32) {
        let release = |range| self.release(range);
        match &self.hashed {
            Some(pieces) => pieces.identity(self, release),
            None => Pieces::with_crc(self.len(), self.crc_to).identity(self, release),
        }
    }
}

impl Deref for Map {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}
