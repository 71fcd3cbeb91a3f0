//! Going on where the walk through the data section stopped: in a cut-off file, or in the middle of a finished one.

use super::summary::indexed_chunk;
use super::{Block, Content, FOOTER_BYTES, Layout, Walk, Walked};
use crate::bytes::map::Map;
use crate::structure::records::{ChunkHeader, Cursor, ENVELOPE, RawRecord, Records, Stop};
use mcap::records::op;
use std::ops::Range;

/// A chunk at the end of a cut file counts as zero-filled from here on.
const ZERO_TAIL_BYTES: usize = 16;

impl Layout {
    /// The walk stopped inside the data section. Returns where to go on.
    pub(super) fn recover(&mut self, map: &Map, walk: &mut Walk<'_>, stop: Stop) -> Option<usize> {
        let bytes = walk.bytes;
        let (Stop::CutOff(at) | Stop::ZeroOpcode(at)) = stop;
        let footer_bytes = ENVELOPE + FOOTER_BYTES;
        let footer = bytes.len().checked_sub(footer_bytes + mcap::MAGIC.len()).filter(|f| *f >= at);
        let footer = footer.and_then(|f| {
            let whole = bytes.ends_with(mcap::MAGIC);
            let record = Records::new(bytes, f, f + footer_bytes).next()?.ok()?;
            (whole && record.op == op::FOOTER && record.body.len() == FOOTER_BYTES).then_some(record)
        });
        match footer {
            Some(footer) => self.skip_damage(walk, at, &footer),
            None => {
                self.cut_off(map, walk, stop, at);
                None
            }
        }
    }

    /// Finished but damaged at `at`: the chunk index knows where the next chunk is, from which the walk goes on.
    fn skip_damage(&mut self, walk: &mut Walk<'_>, at: usize, footer: &RawRecord<'_>) -> Option<usize> {
        let start = Cursor::new(footer.body).u64().and_then(|s| usize::try_from(s).ok());
        if let Some(start) = start.filter(|s| (at..footer.offset).contains(s)) {
            self.use_summary(walk, start, footer);
        }
        let next = next_indexed(walk, at);
        if let Some(chunk) = next.clone().filter(|r| r.start == at + ENVELOPE) {
            let what = if walk.bytes[at] == op::CHUNK { "length" } else { "kind" };
            self.faults
                .lost(at, || format!("the {what} of this chunk is wrong; the index has the right one"));
            let end = chunk.end;
            walk.chunks.push(Walked { offset: at, length: end - at, used_to: end });
            self.take_indexed(walk, at, chunk);
            return Some(end);
        }
        let resume = next.map(|r| r.start - ENVELOPE);
        let skipped = resume.unwrap_or(footer.offset) - at;
        self.faults.lost(at, || format!("no record can be read here; {skipped} bytes are lost"));
        resume
    }

    /// Ends without a footer: whatever of the last chunk is sound is still used.
    fn cut_off(&mut self, map: &Map, walk: &Walk<'_>, stop: Stop, at: usize) {
        let bytes = walk.bytes;
        self.truncated_at = Some(at);
        if let Stop::ZeroOpcode(_) = stop {
            let mut zero_filled = true;
            map.pieces(at..bytes.len(), |piece| zero_filled &= piece.iter().all(|b| *b == 0));
            let what = if zero_filled { "zero-filled" } else { "not readable" };
            let left = bytes.len() - at;
            self.faults.lost(at, || format!("the file is {what} from here on ({left} bytes)"));
            self.doubt_last_record(bytes, at);
        } else {
            self.faults.lost(at, || "the file is cut off here".to_owned());
            if bytes.get(at) == Some(&op::CHUNK) && bytes.len() > at + ENVELOPE {
                self.chunks += 1;
                let header = ChunkHeader::parse(&bytes[at + ENVELOPE..]);
                let claim = header
                    .map_or(0, |(header, packed)| self.admitted(walk.allowance, at, &header, packed.len()));
                let content = Content::CutChunk(at + ENVELOPE..bytes.len());
                self.blocks.push(Block { claim, ..Block::of(at, content) });
            }
        }
    }

    /// Zeros may have begun inside the last record before `at`.
    fn doubt_last_record(&mut self, bytes: &[u8], at: usize) {
        let Some(block) = self.blocks.last_mut().filter(|block| block.range().end == at) else { return };
        match &mut block.content {
            Content::Chunk { body, indexes }
                if indexes.start == indexes.end && ends_in_zeros(&bytes[body.clone()]) =>
            {
                block.content = Content::CutChunk(body.clone());
            }
            Content::Records(range) => {
                let last = Records::new(bytes, range.start, range.end).flatten().last();
                let Some(last) = last else { return };
                if last.op == op::CHUNK && ends_in_zeros(last.body) {
                    range.end = last.offset;
                    let body = last.offset + ENVELOPE..at;
                    self.blocks.push(Block::of(last.offset, Content::CutChunk(body)));
                } else if last.op != op::CHUNK && last.body.ends_with(&[0; 8]) {
                    range.end = last.offset;
                    self.faults.lost(last.offset, || {
                        "the last record may be partly zero-filled; it is not used".to_owned()
                    });
                }
            }
            _ => {}
        }
    }
}

fn ends_in_zeros(body: &[u8]) -> bool {
    body.len() >= ZERO_TAIL_BYTES && body[body.len() - ZERO_TAIL_BYTES..].iter().all(|b| *b == 0)
}

/// The first chunk of the index that starts at `at` or later; its body.
fn next_indexed(walk: &Walk<'_>, at: usize) -> Option<Range<usize>> {
    let chunks = &walk.index.chunks;
    let from = chunks.partition_point(|(offset, _)| *offset < at);
    chunks[from..].iter().find_map(|(offset, length)| indexed_chunk(walk.bytes, *offset, *length))
}
