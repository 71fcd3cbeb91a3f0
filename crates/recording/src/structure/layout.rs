//! Where in a file its messages lie, found by walking a map of it (files read by ranges: [`crate::structure::index`]).
//!
//! The data section is always walked, record by record, without inflating anything: that costs a page a chunk and
//! cannot be lied to by an index. The summary, once its CRC agrees, contributes the channel definitions and the
//! statistics, and its chunk index leads past a spot where the walk lost its footing. Records stand together in blocks, so
//! that what is remembered of a file does not grow with the number of its records.

mod recover;
mod summary;

use crate::bytes::budget::Allowance;
use crate::bytes::map::Map;
use crate::report::Source;
use crate::structure::channels::Definitions;
use crate::structure::damage::Faults;
use crate::structure::records::{
    ChunkHeader, Cursor, ENVELOPE, Message, RawRecord, Records, Statistics, Stop,
};
use crate::structure::survey::Tally;
use mcap::records::op;
use std::collections::BTreeMap;
use std::ops::Range;

/// Records are gathered into blocks of about this size, to be decoded in parallel.
const BLOCK_BYTES: usize = 1 << 20;
/// A chunk of at least so many bytes, or that inflates to so many, is a block of its own.
const LARGE_CHUNK_BYTES: usize = 64 << 10;
const LARGE_CLAIM_BYTES: u64 = 1 << 20;
/// Chunks of one block inflate to about this at most.
const BLOCK_CLAIM_BYTES: u64 = 4 << 20;
/// Bytes of a footer and of an end of the data.
pub(crate) const FOOTER_BYTES: usize = 20;
pub(crate) const DATA_END_BYTES: usize = 4;
/// What the system brings into memory at least when the head of a record is looked at.
const TOUCHED_BYTES: usize = 64 << 10;
/// Pages of the walk are given back by so much that is in memory.
const RELEASED_BYTES: usize = 4 << 20;
/// Kinds of records from here on belong to applications; those below are of the format (MCAP specification, "Opcodes").
pub(crate) const FIRST_PRIVATE: u8 = 0x80;

/// A stretch of a file that holds messages, decoded by one thread.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Block {
    /// Where its (first) record starts.
    pub offset: usize,
    /// What it is.
    pub content: Content,
    /// Channels with messages in it, where the index says; `None` where only looking tells.
    pub holds: Option<Vec<u16>>,
    /// What it inflates to [bytes], where the index says and the chunk itself was not looked at.
    pub inflates_to: Option<u64>,
    /// What a pass inflates of it [bytes].
    pub claim: u64,
}

impl Block {
    /// A block of which only looking tells what it holds.
    pub fn of(offset: usize, content: Content) -> Block {
        Block { offset, content, holds: None, inflates_to: None, claim: 0 }
    }

    /// Whether it is one chunk.
    pub fn is_alone(&self) -> bool {
        !matches!(self.content, Content::Records(_))
    }

    /// A chunk by itself, of whose message indexes nothing is known.
    fn chunk(offset: usize, body: Range<usize>, claim: u64) -> Block {
        let indexes = body.end..body.end;
        Block { claim, ..Block::of(offset, Content::Chunk { body, indexes }) }
    }

    /// What a pass holds of it at most [bytes].
    pub fn held(&self) -> u64 {
        self.claim.max(self.range().len() as u64)
    }

    /// The bytes to read for it, with the envelope of a chunk.
    pub fn range(&self) -> Range<usize> {
        match &self.content {
            Content::Chunk { indexes, .. } => self.offset..indexes.end,
            Content::CutChunk(bytes) | Content::Records(bytes) => self.offset..bytes.end,
        }
    }
}

/// What a block holds; ranges are bytes of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Content {
    /// The body of a chunk record, and the message indexes that follow it.
    Chunk { body: Range<usize>, indexes: Range<usize> },
    /// The body of a chunk record at the end of a cut file: whole or not, its sound prefix is used.
    CutChunk(Range<usize>),
    /// Records one after the other, small chunks among them.
    Records(Range<usize>),
}

/// What the data section holds by its own account: the place behind it, and the CRC of all before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DataCrc {
    pub end: usize,
    pub crc: u32,
}

/// Attachments or metadata records, so many and at these places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Places {
    pub count: usize,
    /// Offsets and lengths, mixed so that one that is off shows.
    mixed: u64,
}

impl Places {
    pub fn add(&mut self, offset: u64, length: u64) {
        self.count += 1;
        self.mixed = self.mixed.wrapping_add(hash_pair(offset, length));
    }
}

/// Two numbers as one, in which a change of either shows; a sum of such is the same in any order.
pub(crate) fn hash_pair(a: u64, b: u64) -> u64 {
    let product = (a ^ b.rotate_left(32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    product ^ (product >> 29)
}

/// The structure of one file.
#[derive(Debug, Default)]
pub(crate) struct Layout {
    pub profile: String,
    pub library: String,
    pub source: Option<Source>,
    pub blocks: Vec<Block>,
    /// Chunks, good and bad.
    pub chunks: usize,
    /// Offsets of chunks that would inflate beyond the allowance, in rising order.
    pub refused: Vec<usize>,
    pub attachments: Vec<Range<usize>>,
    pub metadata: Vec<Range<usize>>,
    pub definitions: Definitions,
    /// Whether `definitions` are all there are; otherwise the chunks must be looked into.
    pub definitions_complete: bool,
    pub statistics: Option<Statistics>,
    pub data_crc: Option<DataCrc>,
    /// What the summary says of each channel, for those that are not read of a file read by ranges.
    pub declared: BTreeMap<u16, Tally>,
    pub truncated_at: Option<usize>,
    pub faults: Faults,
    /// Log time of the first message or chunk [ns].
    pub first_ns: Option<u64>,
}

/// What a walk knows until it ends.
struct Walk<'a> {
    bytes: &'a [u8],
    allowance: &'a Allowance,
    /// Every chunk.
    chunks: Vec<Walked>,
    index: summary::Index,
}

/// A chunk that the walk came by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Walked {
    offset: usize,
    length: usize,
    /// Where what belongs to it ends; a record of wrong length can reach further.
    used_to: usize,
}

impl Layout {
    /// Finds the structure. The error says why the bytes are no MCAP file.
    pub fn of(map: &Map, allowance: &Allowance) -> Result<Layout, String> {
        let bytes: &[u8] = map;
        check_magic(bytes)?;
        let mut layout = Layout::default();
        let mut walk = Walk { bytes, allowance, chunks: Vec::new(), index: summary::Index::default() };
        let mut from = Some(mcap::MAGIC.len());
        while let Some(start) = from {
            let mut records = Records::new(bytes, start, bytes.len());
            from = match layout.walk_data(map, &mut walk, &mut records) {
                DataSection::Ended(data_end) => {
                    layout.walk_summary(&mut walk, data_end, records);
                    None
                }
                DataSection::Footer(footer) => {
                    layout.without_data_end(&mut walk, &footer);
                    None
                }
                DataSection::Stopped(stop) => layout.recover(map, &mut walk, stop),
            };
        }
        layout.compare_with_index(&mut walk);
        layout.judge_definitions(&walk.index);
        layout.refused.sort_unstable();
        map.release(0..bytes.len());
        Ok(layout)
    }

    fn walk_data<'a>(
        &mut self,
        map: &Map,
        walk: &mut Walk<'a>,
        records: &mut Records<'a>,
    ) -> DataSection<'a> {
        let (mut released_to, mut touched) = (0, 0);
        for record in records {
            let record = match record {
                Ok(record) => record,
                Err(stop) => return DataSection::Stopped(stop),
            };
            match record.op {
                op::DATA_END if record.body.len() == DATA_END_BYTES => {
                    let crc = Cursor::new(record.body).u32().filter(|crc| *crc != 0);
                    self.data_crc = crc.map(|crc| DataCrc { end: record.offset, crc });
                    return DataSection::Ended(body_range(&record).end);
                }
                op::FOOTER if is_footer(walk.bytes, &record) => return DataSection::Footer(record),
                _ => self.take(walk, &record),
            }
            touched += record.body.len().min(TOUCHED_BYTES);
            if touched >= RELEASED_BYTES {
                let end = body_range(&record).end;
                map.release(released_to..end);
                (released_to, touched) = (end, 0);
            }
        }
        DataSection::Stopped(Stop::CutOff(map.len()))
    }

    /// Takes in one record of the data section.
    fn take(&mut self, walk: &mut Walk<'_>, record: &RawRecord<'_>) {
        let range = record.offset..body_range(record).end;
        let first = record.offset == mcap::MAGIC.len();
        if first && record.op != op::HEADER {
            self.faults.lost(record.offset, || "the file does not begin with a header".to_owned());
        }
        match record.op {
            op::HEADER if first => {
                let mut fields = Cursor::new(record.body);
                match fields.string().zip(fields.string()) {
                    Some(words) => (self.profile, self.library) = words,
                    None => self.faults.lost(record.offset, || "the header cannot be read".to_owned()),
                }
            }
            op::CHUNK => self.take_chunk(walk, record),
            op::ATTACHMENT => self.attachments.push(body_range(record)),
            op::METADATA => self.metadata.push(body_range(record)),
            op::SCHEMA | op::CHANNEL => {
                if let Err(why) = self.definitions.absorb(record) {
                    self.faults.lost(record.offset, || why.to_owned());
                }
                self.extend_records(range, 0);
            }
            op::MESSAGE => {
                self.start_at(Message::parse(record.body).map(|m| m.log_ns));
                self.extend_records(range, 0);
            }
            op::MESSAGE_INDEX => match self.blocks.last_mut().map(|block| &mut block.content) {
                Some(Content::Chunk { indexes, .. }) if indexes.end == range.start => indexes.end = range.end,
                Some(Content::Records(last)) if last.end == range.start => last.end = range.end,
                _ => self.extend_records(range, 0),
            },
            kind => {
                if kind < FIRST_PRIVATE {
                    self.faults.lost(record.offset, || {
                        format!(
                            "a record of kind {kind:#04x} ({} bytes) has no place here",
                            record.body.len()
                        )
                    });
                }
                self.extend_records(range, 0);
            }
        }
    }

    fn take_chunk(&mut self, walk: &mut Walk<'_>, record: &RawRecord<'_>) {
        self.chunks += 1;
        let range = record.offset..body_range(record).end;
        let Some((header, packed)) = ChunkHeader::parse(record.body) else {
            // Told by whoever passes over it. What is shorter than any chunk need not be remembered.
            if record.body.len() >= ChunkHeader::LEAST_BYTES {
                let whole = Walked { offset: range.start, length: range.len(), used_to: range.end };
                walk.chunks.push(whole);
            }
            return self.extend_records(range, 0);
        };
        self.start_at(Some(header.start_ns).filter(|ns| *ns > 0));
        let used = usize::try_from(header.compressed_size).unwrap_or(usize::MAX).min(packed.len());
        let used_to = range.end - packed.len() + used;
        walk.chunks.push(Walked { offset: range.start, length: range.len(), used_to });
        let claim = self.admitted(walk.allowance, range.start, &header, used);
        if range.len() < LARGE_CHUNK_BYTES && claim < LARGE_CLAIM_BYTES {
            return self.extend_records(range, claim);
        }
        self.blocks.push(Block::chunk(range.start, body_range(record), claim));
    }

    /// What inflating a chunk makes [bytes]; nothing, where that would be too much.
    fn admitted(
        &mut self,
        allowance: &Allowance,
        offset: usize,
        header: &ChunkHeader<'_>,
        packed: usize,
    ) -> u64 {
        let claim = header.inflates_to();
        if allowance.admits(packed as u64, claim) {
            return claim;
        }
        self.refused.push(offset);
        0
    }

    fn start_at(&mut self, ns: Option<u64>) {
        self.first_ns = self.first_ns.into_iter().chain(ns).min();
    }

    fn extend_records(&mut self, range: Range<usize>, claim: u64) {
        if let Some(Block { content: Content::Records(last), claim: claimed, .. }) = self.blocks.last_mut()
            && last.end == range.start
            && last.len() < BLOCK_BYTES
            && *claimed < BLOCK_CLAIM_BYTES
        {
            last.end = range.end;
            *claimed += claim;
            return;
        }
        self.blocks.push(Block { claim, ..Block::of(range.start, Content::Records(range)) });
    }
}

/// How the walk through the data section ended.
enum DataSection<'a> {
    /// Where the summary section starts.
    Ended(usize),
    /// At the footer, with no end of the data before.
    Footer(RawRecord<'a>),
    Stopped(Stop),
}

/// Whether a record with the footer's opcode is one: of its length, and last.
fn is_footer(bytes: &[u8], record: &RawRecord<'_>) -> bool {
    let end = body_range(record).end;
    record.body.len() == FOOTER_BYTES && (end == bytes.len() || bytes[end..].starts_with(mcap::MAGIC))
}

/// The bytes of a record's body in its file.
fn body_range(record: &RawRecord<'_>) -> Range<usize> {
    let start = record.offset + ENVELOPE;
    start..start + record.body.len()
}

/// Says why bytes are not the start of an MCAP file.
pub(crate) fn check_magic(bytes: &[u8]) -> Result<(), String> {
    let is_mcap = bytes.starts_with(mcap::MAGIC);
    is_mcap.then_some(()).ok_or_else(|| "it does not start with the MCAP magic bytes".to_owned())
}
