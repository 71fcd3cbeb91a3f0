//! What tells the content of a file from any other: its BLAKE3, which `b3sum` prints too.
//!
//! BLAKE3 is a tree (O'Connor, Aumasson, Neves, Wilcox-O'Hearn 2020, section 2.1): its parts are hashed in any order by
//! any thread, and give the same hash. So a pass over a file hashes each piece while the processor has it at hand; only
//! what no pass came by is read for the hash alone.

use blake3::hazmat::{ChainingValue, HasherExt as _, Mode, merge_subtrees_non_root, merge_subtrees_root};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::OnceLock;

/// A power of two of BLAKE3's chunks of 1 KiB, so that each piece is a subtree.
const PIECE_BYTES: usize = 256 << 10;

/// The hashes of the pieces of one file, as far as they are known.
pub(crate) struct Pieces {
    known: Vec<OnceLock<Piece>>,
    /// Of so many bytes from the start the CRC is made too.
    pub crc_to: usize,
}

/// What is known of a piece.
#[derive(Clone, Copy)]
struct Piece {
    hash: ChainingValue,
    /// Of its bytes before the end of the CRC.
    crc: u32,
}

impl Pieces {
    /// None known yet of a file of this size.
    pub fn of(bytes: usize) -> Pieces {
        let known = (0..bytes.div_ceil(PIECE_BYTES)).map(|_| OnceLock::new()).collect();
        Pieces { known, crc_to: 0 }
    }

    /// The same, with the CRC of so many bytes from the start.
    pub fn with_crc(bytes: usize, crc_to: usize) -> Pieces {
        Pieces { crc_to, ..Pieces::of(bytes) }
    }

    /// Hashes the pieces that begin in a range of the file.
    pub fn hash(&self, file: &[u8], begin_in: &Range<usize>) {
        let end = begin_in.end.div_ceil(PIECE_BYTES).min(self.known.len());
        for piece in begin_in.start.div_ceil(PIECE_BYTES)..end {
            self.known[piece].get_or_init(|| {
                let start = piece * PIECE_BYTES;
                let bytes = &file[start..file.len().min(start + PIECE_BYTES)];
                let hash =
                    blake3::Hasher::new().set_input_offset(start as u64).update(bytes).finalize_non_root();
                Piece { hash, crc: crc32fast::hash(&bytes[..self.checked(start, bytes.len())]) }
            });
        }
    }

    /// Bytes of a piece that the CRC covers.
    fn checked(&self, start: usize, length: usize) -> usize {
        self.crc_to.saturating_sub(start).min(length)
    }

    /// The identity, and the CRC. What no pass came by is hashed now; `passed` is told of it.
    pub fn identity(&self, file: &[u8], passed: impl Fn(Range<usize>) + Sync) -> (String, u32) {
        self.known.par_iter().enumerate().filter(|(_, piece)| piece.get().is_none()).for_each(
            |(piece, _)| {
                let range = piece * PIECE_BYTES..(piece + 1) * PIECE_BYTES;
                self.hash(file, &range);
                passed(range);
            },
        );
        let known: Vec<Piece> = self.known.iter().filter_map(|piece| piece.get().copied()).collect();
        let mut crc = crc32fast::Hasher::new();
        for (i, piece) in known.iter().enumerate() {
            let covered = self.checked(i * PIECE_BYTES, PIECE_BYTES) as u64;
            crc.combine(&crc32fast::Hasher::new_with_initial_len(piece.crc, covered));
        }
        let hashes: Vec<ChainingValue> = known.iter().map(|piece| piece.hash).collect();
        let name = prefixed_hash(match split_halves(&hashes) {
            Some((left, right)) => merge_subtrees_root(&subtree_hash(left), &subtree_hash(right), Mode::Hash),
            None => blake3::hash(file),
        });
        (name, crc.finalize())
    }
}

/// By the name of the hash, so that nobody takes it for another.
pub(crate) fn prefixed_hash(hash: blake3::Hash) -> String {
    format!("blake3:{}", hash.to_hex())
}

fn subtree_hash(pieces: &[ChainingValue]) -> ChainingValue {
    match split_halves(pieces) {
        Some((left, right)) => merge_subtrees_non_root(&subtree_hash(left), &subtree_hash(right), Mode::Hash),
        None => pieces.first().copied().unwrap_or_default(),
    }
}

/// The left half is as large as a power of two can be that leaves something to the right.
fn split_halves(pieces: &[ChainingValue]) -> Option<(&[ChainingValue], &[ChainingValue])> {
    (pieces.len() > 1).then(|| pieces.split_at(pieces.len().next_power_of_two() / 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_in_any_order_give_the_blake3_of_the_file() {
        for bytes in [1, 1000, PIECE_BYTES, PIECE_BYTES + 1, 3 * PIECE_BYTES, 5 * PIECE_BYTES + 12_345] {
            let file: Vec<u8> =
                (0..bytes as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
            let crc_to = bytes - bytes / 3;
            let pieces = Pieces::with_crc(bytes, crc_to);
            let mut rest = bytes;
            // From the end, in stretches that end in the middle of pieces.
            while rest > 0 {
                let start = rest.saturating_sub(PIECE_BYTES / 3 + 7);
                pieces.hash(&file, &(start..rest));
                rest = start;
            }
            let expected = (prefixed_hash(blake3::hash(&file)), crc32fast::hash(&file[..crc_to]));
            assert_eq!(pieces.identity(&file, |_| panic!("all are hashed")), expected, "{bytes}");
            let anew = Pieces::with_crc(bytes, crc_to);
            assert_eq!(anew.identity(&file, drop), expected, "{bytes}");
        }
    }
}
