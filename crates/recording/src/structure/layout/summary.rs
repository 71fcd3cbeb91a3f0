//! The summary, the footer and the end of a file, as witnesses of what its data section should hold.

use super::{Block, FIRST_PRIVATE, Layout, Places, Walk, Walked, body_range, is_footer};
use crate::report::Source;
use crate::structure::records::{ChunkHeader, ChunkIndex, Cursor, ENVELOPE, RawRecord, Records, Statistics};
use mcap::records::op;
use std::collections::BTreeSet;
use std::ops::Range;

/// What the summary says of chunks, attachments and metadata.
#[derive(Debug, Default)]
pub(super) struct Index {
    /// Whether a summary was taken in.
    pub used: bool,
    /// Offset and length of each chunk, by offset.
    pub chunks: Vec<(usize, usize)>,
    /// How many.
    pub listed: usize,
    /// Channels with messages in any chunk.
    pub channels: BTreeSet<u16>,
    pub attachments: Places,
    pub metadata: Places,
}

impl Index {
    fn absorb(&mut self, record: &RawRecord<'_>) -> Option<()> {
        let place = || {
            let mut fields = Cursor::new(record.body);
            Some((fields.u64()?, fields.u64()?))
        };
        match record.op {
            op::CHUNK_INDEX => {
                let chunk = ChunkIndex::parse(record.body)?;
                let number = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
                self.chunks.push((number(chunk.chunk_start), number(chunk.chunk_length)));
                self.channels.extend(chunk.message_indexes.keys());
            }
            op::ATTACHMENT_INDEX => place().map(|(offset, length)| self.attachments.add(offset, length))?,
            op::METADATA_INDEX => place().map(|(offset, length)| self.metadata.add(offset, length))?,
            _ => {}
        }
        Some(())
    }
}

impl Layout {
    /// From the end of the data section to the end of the file.
    pub(super) fn walk_summary<'a>(&mut self, walk: &mut Walk<'a>, start: usize, records: Records<'a>) {
        for record in records {
            match record {
                Ok(record) if record.op == op::FOOTER && is_footer(walk.bytes, &record) => {
                    self.use_summary(walk, start, &record);
                    return self.check_end(walk.bytes, body_range(&record).end);
                }
                Ok(record) if !of_summary(record.op) => self.faults.lost(record.offset, || {
                    format!("a record of kind {:#04x} after the end of the data; it is not read", record.op)
                }),
                Ok(_) => {}
                Err(_) => break,
            }
        }
        self.truncated_at = Some(walk.bytes.len());
        self.faults.lost(start, || {
            "the file ends before its footer: the recorder did not finish it, or it was cut off".to_owned()
        });
    }

    /// The footer came where the end of the data was due: the summary is where the footer says.
    pub(super) fn without_data_end(&mut self, walk: &mut Walk<'_>, footer: &RawRecord<'_>) {
        self.faults.lost(footer.offset, || "nothing marks the end of the data before the footer".to_owned());
        let start = Cursor::new(footer.body).u64().and_then(|start| usize::try_from(start).ok());
        let start = start.filter(|start| (mcap::MAGIC.len()..footer.offset).contains(start));
        self.use_summary(walk, start.unwrap_or(footer.offset), footer);
        self.check_end(walk.bytes, body_range(footer).end);
    }

    /// The footer's CRC covers the summary and the footer up to the CRC itself (MCAP specification, "Footer").
    pub(super) fn use_summary(&mut self, walk: &mut Walk<'_>, start: usize, footer: &RawRecord<'_>) {
        let mut fields = Cursor::new(footer.body);
        let (summary_start, _, crc) = (fields.u64(), fields.u64(), fields.u32().unwrap_or(0));
        if walk.index.used {
            return;
        }
        let empty = start >= footer.offset;
        if summary_start != Some(if empty { 0 } else { start as u64 }) {
            self.faults.lost(footer.offset, || "the footer does not point to the summary".to_owned());
        }
        if empty {
            return;
        }
        walk.index.used = true;
        let covered = walk.bytes.get(start..footer.offset + ENVELOPE + 16).unwrap_or_default();
        if crc != 0 && crc32fast::hash(covered) != crc {
            return self.faults.lost(start, || "the CRC of the summary disagrees; it is not used".to_owned());
        }
        let mut statistics = 0;
        for record in Records::new(walk.bytes, start, footer.offset).map_while(Result::ok) {
            let read = match record.op {
                op::STATISTICS => {
                    statistics += 1;
                    self.statistics = Statistics::parse(record.body).or(self.statistics.take());
                    self.statistics.as_ref().map(|_| ())
                }
                _ => walk.index.absorb(&record),
            };
            if read.is_none() {
                self.faults.lost(record.offset, || "a record of the summary cannot be read".to_owned());
            }
            if let Err(why) = self.definitions.absorb(&record) {
                self.faults.lost(record.offset, || why.to_owned());
            }
        }
        if statistics > 1 {
            self.faults.lost(start, || format!("the summary has {statistics} statistics; the last counts"));
        }
        walk.index.chunks.sort_unstable();
        walk.index.listed = walk.index.chunks.len();
    }

    pub(super) fn check_end(&mut self, bytes: &[u8], end: usize) {
        match bytes[end..].strip_prefix(mcap::MAGIC) {
            Some([]) => {}
            Some(rest) => self.faults.lost(end + mcap::MAGIC.len(), || {
                format!("{} bytes follow the end of the recording; they are not read", rest.len())
            }),
            None => self.faults.lost(end, || "the magic bytes at the end are missing".to_owned()),
        }
    }

    /// Chunks that the walk did not come by although the index lists them are hidden by a record of wrong length or kind,
    /// and read. Chunks that overlap are a lie that would have the same bytes inflated again and again: the first counts.
    pub(super) fn compare_with_index(&mut self, walk: &mut Walk<'_>) {
        self.compare_extras(&walk.index);
        if walk.index.chunks.is_empty() {
            return;
        }
        let mut walked = std::mem::take(&mut walk.chunks);
        walked.sort_unstable();
        let mut walked = walked.into_iter().peekable();
        let unlisted = |layout: &mut Layout, chunk: Walked| {
            layout.faults.lost(chunk.offset, || "the index does not list this chunk".to_owned());
        };
        let (mut before, mut free_from) = (None, 0);
        for (offset, length) in std::mem::take(&mut walk.index.chunks) {
            while let Some(chunk) = walked.next_if(|chunk| chunk.offset < offset) {
                free_from = chunk.used_to.max(free_from);
                unlisted(self, chunk);
            }
            if before.replace(offset) == Some(offset) {
                self.faults.lost(offset, || "the index lists this chunk twice".to_owned());
                continue;
            }
            match walked.next_if(|chunk| chunk.offset == offset) {
                Some(chunk) => {
                    free_from = chunk.used_to.max(free_from);
                    if chunk.length != length {
                        let found = chunk.length;
                        let why = || format!("this chunk has {found} bytes, and {length} by the index");
                        self.faults.lost(offset, why);
                    }
                }
                None => free_from = self.take_hidden(walk, offset, length, free_from),
            }
        }
        walked.for_each(|chunk| unlisted(self, chunk));
        self.blocks.sort_by_key(|b| b.offset);
    }

    /// Takes in a chunk that only the index leads to, and returns where the next one may begin.
    fn take_hidden(&mut self, walk: &Walk<'_>, offset: usize, length: usize, free_from: usize) -> usize {
        let Some(range) = indexed_chunk(walk.bytes, offset, length).filter(|_| offset >= free_from) else {
            self.faults.lost(offset, || "the index leads to a chunk here, and there is none".to_owned());
            return free_from;
        };
        self.faults.lost(offset, || {
            "a chunk hidden by a record of wrong length or kind; the index leads to it".to_owned()
        });
        self.take_indexed(walk, offset, range.clone());
        range.end
    }

    /// Takes in a chunk by its place alone.
    pub(super) fn take_indexed(&mut self, walk: &Walk<'_>, offset: usize, range: Range<usize>) {
        self.chunks += 1;
        let claim = ChunkHeader::parse(&walk.bytes[range.clone()])
            .map_or(0, |(header, packed)| self.admitted(walk.allowance, offset, &header, packed.len()));
        self.blocks.push(Block::chunk(offset, range, claim));
    }

    fn compare_extras(&mut self, index: &Index) {
        let walked = |records: &[Range<usize>]| {
            let mut places = Places::default();
            records.iter().for_each(|r| places.add((r.start - ENVELOPE) as u64, (r.len() + ENVELOPE) as u64));
            places
        };
        let extras = [
            ("attachments", index.attachments, walked(&self.attachments)),
            ("metadata records", index.metadata, walked(&self.metadata)),
        ];
        for (what, listed, found) in extras {
            if listed.count > 0 && listed != found {
                self.faults.lost(0, || {
                    format!(
                        "the index lists {} {what}, and not just the {} that are there",
                        listed.count, found.count
                    )
                });
            }
        }
    }

    /// Definitions outside chunks have all been read. Those inside are all repeated in the summary when it knows
    /// the channel of every message it speaks of; when it speaks of none, the chunks must be looked into.
    pub(super) fn judge_definitions(&mut self, index: &Index) {
        let chunked = self.chunks > 0;
        let statistics = self.statistics.as_ref();
        let mut used = index.channels.clone();
        used.extend(statistics.iter().flat_map(|s| s.channel_message_counts.keys().copied()));
        let known = !used.is_empty() && used.iter().all(|id| self.definitions.channel(*id).is_some());
        let empty = statistics.is_some_and(|s| s.message_count == 0);
        let by_index = chunked && (known || empty) && index.listed >= self.chunks;
        self.definitions_complete = !chunked || by_index;
        self.source = Some(if by_index { Source::Index } else { Source::Scan });
    }
}

/// Whether records of this kind stand behind the data.
fn of_summary(kind: u8) -> bool {
    let listed = [
        op::SCHEMA,
        op::CHANNEL,
        op::STATISTICS,
        op::CHUNK_INDEX,
        op::ATTACHMENT_INDEX,
        op::METADATA_INDEX,
        op::SUMMARY_OFFSET,
    ];
    kind >= FIRST_PRIVATE || listed.contains(&kind)
}

/// The body of an indexed chunk, if the file has one there: by its kind, or, where that was changed, by its length.
pub(super) fn indexed_chunk(bytes: &[u8], offset: usize, length: usize) -> Option<Range<usize>> {
    let end = offset.checked_add(length)?;
    if end > bytes.len() || length <= ENVELOPE {
        return None;
    }
    let mut fields = Cursor::new(&bytes[offset + 1..]);
    let as_long = fields.u64() == Some((length - ENVELOPE) as u64);
    (bytes[offset] == op::CHUNK || as_long).then_some(offset + ENVELOPE..end)
}
