//! What tells the content of a file from any other: its BLAKE3, which `b3sum` prints too.
//!
//! BLAKE3 is a tree (O'Connor, Aumasson, Neves, Wilcox-O'Hearn 2020, section 2.1): its parts are hashed in any order by
//! any thread, and give the same hash. So a pass over a file hashes each piece while the processor has it at hand; only
//! what no pass came by is read for the hash alone.

use blake3::hazmat::{ChainingValue, HasherExt as _, Mode, merge_subtrees_non_root, merge_subtrees_root};
use std::ops::Range;
use std::sync::OnceLock;

/// Size of a piece: a power of two of BLAKE3's chunks of 1 KiB, so that each is a subtree.
pub(crate) const PIECE_BYTES: usize = 256 << 10;

/// The hashes of the pieces of one file, as far as they are known.
pub(crate) struct Pieces(Vec<OnceLock<ChainingValue>>);

impl Pieces {
    /// None known yet of a file of this size.
    pub fn of(bytes: usize) -> Pieces {
        Pieces((0..bytes.div_ceil(PIECE_BYTES)).map(|_| OnceLock::new()).collect())
    }

    /// Hashes the pieces that begin in a range of the file.
    pub fn hash(&self, file: &[u8], begin_in: Range<usize>) {
        let end = begin_in.end.div_ceil(PIECE_BYTES).min(self.0.len());
        (begin_in.start.div_ceil(PIECE_BYTES)..end).for_each(|piece| self.piece(file, piece));
    }

    /// Bytes of the pieces that are not hashed yet.
    pub fn missing(&self, file: &[u8]) -> Vec<Range<usize>> {
        let missing = (0..self.0.len()).filter(|piece| self.0[*piece].get().is_none());
        missing.map(|piece| range(file, piece)).collect()
    }

    /// The identity, once all pieces are hashed.
    pub fn identity(&self, file: &[u8]) -> String {
        let known: Vec<ChainingValue> = self.0.iter().filter_map(|piece| piece.get().copied()).collect();
        named(match halves(&known) {
            Some((left, right)) => merge_subtrees_root(&subtree(left), &subtree(right), Mode::Hash),
            None => blake3::hash(file),
        })
    }

    fn piece(&self, file: &[u8], piece: usize) {
        // The only piece of a file is its root, and hashed as that.
        if self.0.len() > 1 {
            self.0[piece].get_or_init(|| {
                let range = range(file, piece);
                let mut hasher = blake3::Hasher::new();
                hasher.set_input_offset(range.start as u64).update(&file[range]).finalize_non_root()
            });
        }
    }
}

/// A hash as an identity: hexadecimal, and by its name, so that nobody takes it for another.
pub(crate) fn named(hash: blake3::Hash) -> String {
    format!("blake3:{}", hash.to_hex())
}

fn range(file: &[u8], piece: usize) -> Range<usize> {
    piece * PIECE_BYTES..file.len().min((piece + 1) * PIECE_BYTES)
}

fn subtree(pieces: &[ChainingValue]) -> ChainingValue {
    match halves(pieces) {
        Some((left, right)) => merge_subtrees_non_root(&subtree(left), &subtree(right), Mode::Hash),
        None => pieces.first().copied().unwrap_or_default(),
    }
}

/// The left half of a tree is as large as a power of two can be that leaves something to the right.
fn halves(pieces: &[ChainingValue]) -> Option<(&[ChainingValue], &[ChainingValue])> {
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
            let pieces = Pieces::of(bytes);
            let mut rest = bytes;
            // From the end, in stretches that end in the middle of pieces.
            while rest > 0 {
                let start = rest.saturating_sub(PIECE_BYTES / 3 + 7);
                pieces.hash(&file, start..rest);
                rest = start;
            }
            assert!(bytes <= PIECE_BYTES || pieces.missing(&file).is_empty());
            assert_eq!(pieces.identity(&file), named(blake3::hash(&file)), "{bytes}");
        }
    }
}
