//! Where in a file its messages lie, found by walking a map of it (files read by ranges: [`crate::index`]).
//!
//! The data section is always walked, record by record, without inflating anything: that costs a page a chunk and
//! cannot be lied to by an index. The summary, once its CRC agrees, contributes the channel definitions and the
//! statistics, and its chunk index leads past a spot where the walk lost its footing.

use crate::channels::Definitions;
use crate::map::Map;
use crate::records::{
    ChunkHeader, ChunkIndex, Cursor, ENVELOPE, Message, RawRecord, Records, Statistics, Stop, is_content,
};
use crate::report::Source;
use crate::sweep::Tally;
use mcap::records::op;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Records outside chunks are gathered into blocks of about this size, to be decoded in parallel.
const LOOSE_BLOCK_BYTES: usize = 1 << 20;
/// Footer record and end magic.
const FOOTER_BYTES: usize = ENVELOPE + 20;
/// What the system brings into memory at least when the head of a record is looked at.
const TOUCHED_BYTES: usize = 64 << 10;
/// Pages of the walk are given back by so much that is in memory.
const RELEASED_BYTES: usize = 4 << 20;
/// A chunk at the end of a cut file counts as zero-filled from here on.
const ZERO_TAIL_BYTES: usize = 16;

/// A stretch of a file that holds messages, decoded by one thread.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Block {
    /// Where its (first) record starts.
    pub offset: usize,
    /// What it is.
    pub content: Content,
    /// Channels with messages in it, where the index says; `None` where only looking tells.
    pub holds: Option<Vec<u16>>,
}

impl Block {
    /// A block of which only looking tells what it holds.
    fn of(offset: usize, content: Content) -> Block {
        Block { offset, content, holds: None }
    }

    /// The bytes to read for it, with the envelope of a chunk.
    pub fn range(&self) -> Range<usize> {
        let (Content::Chunk(body) | Content::CutChunk(body) | Content::Loose(body)) = &self.content;
        self.offset..body.end
    }
}

/// What a block holds; ranges are bytes of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Content {
    /// The body of a chunk record.
    Chunk(Range<usize>),
    /// The body of a chunk record at the end of a cut file: whole or not, its sound prefix is used.
    CutChunk(Range<usize>),
    /// Records outside any chunk.
    Loose(Range<usize>),
}

/// Something wrong with a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Damage {
    /// Where [byte].
    pub offset: usize,
    /// What.
    pub why: String,
    /// Whether data were lost by it.
    pub lost: bool,
}

/// The structure of one file.
#[derive(Debug, Default)]
pub(crate) struct Layout {
    pub profile: String,
    pub library: String,
    pub source: Option<Source>,
    pub blocks: Vec<Block>,
    pub attachments: Vec<Range<usize>>,
    pub metadata: Vec<Range<usize>>,
    pub definitions: Definitions,
    /// Whether `definitions` is known to be all there are; otherwise the chunks must be looked into.
    pub definitions_complete: bool,
    pub statistics: Option<Statistics>,
    /// What the summary says of each channel, for those that are not read of a file read by ranges.
    pub declared: BTreeMap<u16, Tally>,
    pub truncated_at: Option<usize>,
    pub damage: Vec<Damage>,
    /// Log time of the first message or chunk [ns].
    pub first_ns: Option<u64>,
    /// The chunk index, while it is needed to find a way past damage.
    pub indexed: Vec<ChunkIndex>,
    /// Whether a summary was already taken in.
    pub summary_used: bool,
}

impl Layout {
    /// Finds the structure. The error says why the bytes are no MCAP file.
    pub fn of(map: &Map) -> Result<Layout, String> {
        let bytes: &[u8] = map;
        check_magic(bytes)?;
        let mut layout = Layout::default();
        let mut from = Some(mcap::MAGIC.len());
        while let Some(start) = from {
            let mut records = Records::new(bytes, start, bytes.len());
            from = match layout.walk_data(map, &mut records) {
                DataSection::Ended(data_end) => {
                    layout.walk_summary(bytes, data_end, &mut records);
                    None
                }
                DataSection::Stopped(stop) => layout.recover(map, stop),
            };
        }
        layout.add_unvisited(bytes);
        layout.judge_definitions();
        // The index has served, and of a long recording it is large.
        layout.indexed = Vec::new();
        map.release(0..bytes.len());
        Ok(layout)
    }

    /// Number of chunks, good and bad.
    pub fn chunks(&self) -> usize {
        self.blocks.iter().filter(|b| !matches!(b.content, Content::Loose(_))).count()
    }

    fn walk_data(&mut self, map: &Map, records: &mut Records<'_>) -> DataSection {
        let (mut released_to, mut touched) = (0, 0);
        for record in records {
            let record = match record {
                Ok(record) => record,
                Err(stop) => return DataSection::Stopped(stop),
            };
            match record.op {
                op::DATA_END => {
                    self.check_data_crc(map, &record);
                    return DataSection::Ended(body(&record).end);
                }
                op::FOOTER => return DataSection::Ended(record.offset),
                _ => self.take(&record),
            }
            touched += record.body.len().min(TOUCHED_BYTES);
            if touched >= RELEASED_BYTES {
                let end = body(&record).end;
                map.release(released_to..end);
                (released_to, touched) = (end, 0);
            }
        }
        DataSection::Stopped(Stop::CutOff(map.len()))
    }

    /// Takes in one record of the data section.
    fn take(&mut self, record: &RawRecord<'_>) {
        match record.op {
            op::HEADER => {
                let mut fields = Cursor::new(record.body);
                if let (Some(profile), Some(library)) = (fields.string(), fields.string()) {
                    (self.profile, self.library) = (profile, library);
                }
            }
            op::CHUNK => {
                let start = ChunkHeader::parse(record.body).map(|(header, _)| header.start_ns);
                self.start_at(start.filter(|ns| *ns > 0));
                self.blocks.push(Block::of(record.offset, Content::Chunk(body(record))));
            }
            op::ATTACHMENT => self.attachments.push(body(record)),
            op::METADATA => self.metadata.push(body(record)),
            content if is_content(content) => {
                self.definitions.absorb(record);
                if content == op::MESSAGE {
                    self.start_at(Message::parse(record.body).map(|m| m.log_ns));
                }
                self.extend_loose(record.offset..body(record).end);
            }
            _ => {}
        }
    }

    fn start_at(&mut self, ns: Option<u64>) {
        self.first_ns = self.first_ns.into_iter().chain(ns).min();
    }

    fn extend_loose(&mut self, range: Range<usize>) {
        if let Some(Block { content: Content::Loose(last), .. }) = self.blocks.last_mut()
            && last.end == range.start
            && last.len() < LOOSE_BLOCK_BYTES
        {
            last.end = range.end;
            return;
        }
        self.blocks.push(Block::of(range.start, Content::Loose(range)));
    }

    /// Chunks have their own CRCs; only for messages outside chunks does the one of the data section add anything.
    fn check_data_crc(&mut self, map: &Map, data_end: &RawRecord<'_>) {
        let loose = self.blocks.iter().any(|b| matches!(b.content, Content::Loose(_)));
        let expected = Cursor::new(data_end.body).u32().unwrap_or(0);
        if !loose || expected == 0 {
            return;
        }
        let mut crc = crc32fast::Hasher::new();
        map.pieces(0..data_end.offset, |piece| crc.update(piece));
        if crc.finalize() != expected {
            let why =
                "the CRC of the data section disagrees: some of its messages outside chunks may be wrong";
            self.damaged(data_end.offset, why, true);
        }
    }

    fn damaged(&mut self, offset: usize, why: impl Into<String>, lost: bool) {
        self.damage.push(Damage { offset, why: why.into(), lost });
    }

    /// From the end of the data section to the end of the file.
    fn walk_summary(&mut self, bytes: &[u8], start: usize, records: &mut Records<'_>) {
        let mut summary = Vec::new();
        for record in records {
            match record {
                Ok(record) if record.op == op::FOOTER => {
                    self.use_summary(bytes, start, &record, &summary);
                    return self.check_end(bytes, body(&record).end);
                }
                Ok(record) => summary.push(record),
                Err(_) => break,
            }
        }
        self.truncated_at = Some(bytes.len());
        self.damaged(start, "the file ends before its footer; every message before it is there", false);
    }

    /// The footer's CRC covers the summary and the footer up to the CRC itself (MCAP specification, "Footer").
    fn use_summary(&mut self, bytes: &[u8], start: usize, footer: &RawRecord<'_>, summary: &[RawRecord<'_>]) {
        let mut fields = Cursor::new(footer.body);
        let (summary_start, _, crc) = (fields.u64(), fields.u64(), fields.u32().unwrap_or(0));
        if summary.is_empty() || self.summary_used {
            return;
        }
        self.summary_used = true;
        let covered = bytes.get(start..footer.offset + ENVELOPE + 16).unwrap_or_default();
        if crc != 0 && crc32fast::hash(covered) != crc {
            return self.damaged(start, "the CRC of the summary disagrees; it is not used", false);
        }
        if summary_start != Some(start as u64) {
            self.damaged(footer.offset, "the footer does not point to the summary", false);
        }
        for record in summary {
            self.definitions.absorb(record);
            match record.op {
                op::STATISTICS => self.statistics = Statistics::parse(record.body).or(self.statistics.take()),
                op::CHUNK_INDEX => self.indexed.extend(ChunkIndex::parse(record.body)),
                _ => {}
            }
        }
        self.indexed.sort_by_key(|c| c.chunk_start);
    }

    fn check_end(&mut self, bytes: &[u8], end: usize) {
        match bytes[end..].strip_prefix(mcap::MAGIC) {
            Some([]) => {}
            Some(rest) => {
                let why = format!("{} bytes follow the end of the recording; they are not read", rest.len());
                self.damaged(end + mcap::MAGIC.len(), why, false);
            }
            None => self.damaged(end, "the magic bytes at the end are missing", false),
        }
    }

    /// The walk stopped inside the data section: a cut-off file, or damage in the middle of a finished one. Returns
    /// where to go on.
    fn recover(&mut self, map: &Map, stop: Stop) -> Option<usize> {
        let bytes: &[u8] = map;
        let (Stop::CutOff(at) | Stop::ZeroOpcode(at)) = stop;
        let footer = bytes.len().checked_sub(FOOTER_BYTES + mcap::MAGIC.len()).filter(|f| *f >= at);
        let footer = footer.and_then(|f| {
            let whole = bytes.ends_with(mcap::MAGIC);
            let record = Records::new(bytes, f, f + FOOTER_BYTES).next()?.ok()?;
            (whole && record.op == op::FOOTER).then_some(record)
        });
        match footer {
            Some(footer) => self.skip_damage(bytes, at, &footer),
            None => {
                self.cut_off(map, stop, at);
                None
            }
        }
    }

    /// Finished but damaged at `at`: the chunk index knows where the next chunk is, from which the walk goes on.
    fn skip_damage(&mut self, bytes: &[u8], at: usize, footer: &RawRecord<'_>) -> Option<usize> {
        let start = Cursor::new(footer.body).u64().and_then(|s| usize::try_from(s).ok());
        if let Some(start) = start.filter(|s| !self.summary_used && (at..footer.offset).contains(s)) {
            let summary: Vec<_> = Records::new(bytes, start, footer.offset).flatten().collect();
            self.use_summary(bytes, start, footer, &summary);
        }
        let next = self.next_indexed(bytes, at);
        if let Some(chunk) = next.clone().filter(|r| r.start == at + ENVELOPE) {
            self.damaged(at, "the length of this chunk is wrong; the index has the right one", false);
            let end = chunk.end;
            self.blocks.push(Block::of(at, Content::Chunk(chunk)));
            return Some(end);
        }
        let resume = next.map(|r| r.start - ENVELOPE);
        let skipped = resume.unwrap_or(footer.offset) - at;
        self.damaged(at, format!("no record can be read here; {skipped} bytes are lost"), true);
        resume
    }

    /// The first chunk of the index that starts at `at` or later; its body.
    fn next_indexed(&self, bytes: &[u8], at: usize) -> Option<Range<usize>> {
        let from = self.indexed.partition_point(|c| c.chunk_start < at as u64);
        self.indexed[from..].iter().find_map(|c| indexed_chunk(bytes, c))
    }

    /// A record whose length is wrong can hide chunks from the walk; the index still has them. Chunks that overlap are
    /// a lie that would have the same bytes inflated again and again: the first of them counts.
    fn add_unvisited(&mut self, bytes: &[u8]) {
        let known: BTreeSet<usize> = self.blocks.iter().map(|b| b.offset).collect();
        // Known chunks are not looked at again: that would bring a page of each back into memory.
        let unknown =
            |c: &&ChunkIndex| usize::try_from(c.chunk_start).is_ok_and(|offset| !known.contains(&offset));
        let chunks = self.indexed.iter().filter(unknown).filter_map(|c| indexed_chunk(bytes, c));
        let hidden: Vec<Range<usize>> = chunks.collect();
        let mut free_from = 0;
        for range in hidden {
            let offset = range.start - ENVELOPE;
            if offset < free_from {
                continue;
            }
            free_from = range.end;
            self.damaged(offset, "a chunk hidden by a record of wrong length; the index leads to it", false);
            self.blocks.push(Block::of(offset, Content::Chunk(range)));
        }
        self.blocks.sort_by_key(|b| b.offset);
    }

    /// Ends without a footer: whatever of the last chunk is sound is still used.
    fn cut_off(&mut self, map: &Map, stop: Stop, at: usize) {
        let bytes: &[u8] = map;
        self.truncated_at = Some(at);
        if let Stop::ZeroOpcode(_) = stop {
            let mut zero_filled = true;
            map.pieces(at..bytes.len(), |piece| zero_filled &= piece.iter().all(|b| *b == 0));
            let what = if zero_filled { "zero-filled" } else { "not readable" };
            self.damaged(at, format!("the file is {what} from here on ({} bytes)", bytes.len() - at), true);
            self.doubt_last_block(bytes, at);
        } else {
            self.damaged(at, "the file is cut off here", true);
            if bytes.get(at) == Some(&op::CHUNK) && bytes.len() > at + ENVELOPE {
                self.blocks.push(Block::of(at, Content::CutChunk(at + ENVELOPE..bytes.len())));
            }
        }
    }

    /// Zeros may have begun inside the last record before `at`.
    fn doubt_last_block(&mut self, bytes: &[u8], at: usize) {
        let Some(block) = self.blocks.last_mut() else { return };
        match &mut block.content {
            Content::Chunk(range) if range.end == at => {
                let sound = bytes[range.clone()].iter().rposition(|b| *b != 0).map_or(0, |i| i + 1);
                if range.len() - sound >= ZERO_TAIL_BYTES {
                    block.content = Content::CutChunk(range.clone());
                }
            }
            Content::Loose(range) if range.end == at => {
                let last = Records::new(bytes, range.start, range.end).flatten().last();
                if let Some(last) = last.filter(|r| r.body.len() >= 8 && r.body[r.body.len() - 8..] == [0; 8])
                {
                    range.end = last.offset;
                    self.damaged(
                        last.offset,
                        "the last record may be partly zero-filled; it is not used",
                        true,
                    );
                }
            }
            _ => {}
        }
    }

    /// Definitions outside chunks have all been read. Those inside are all repeated in the summary when it knows
    /// the channel of every message it speaks of; when it speaks of none, the chunks must be looked into.
    fn judge_definitions(&mut self) {
        let chunked = self.chunks() > 0;
        let mut used: BTreeSet<u16> =
            self.indexed.iter().flat_map(|c| c.message_indexes.keys().copied()).collect();
        used.extend(self.statistics.iter().flat_map(|s| s.channel_message_counts.keys().copied()));
        let known = !used.is_empty() && used.iter().all(|id| self.definitions.contains(*id));
        let empty = self.statistics.as_ref().is_some_and(|s| s.message_count == 0);
        let by_index = chunked && (known || empty) && self.indexed.len() >= self.chunks();
        self.definitions_complete = !chunked || by_index;
        self.source = Some(if by_index { Source::Index } else { Source::Scan });
    }
}

/// How the walk through the data section ended.
enum DataSection {
    /// Where the summary section starts.
    Ended(usize),
    Stopped(Stop),
}

/// The bytes of a record's body in its file.
fn body(record: &RawRecord<'_>) -> Range<usize> {
    let start = record.offset + ENVELOPE;
    start..start + record.body.len()
}

/// The body of an indexed chunk, if the file really has a chunk there.
fn indexed_chunk(bytes: &[u8], index: &ChunkIndex) -> Option<Range<usize>> {
    let offset = usize::try_from(index.chunk_start).ok()?;
    let end = offset.checked_add(usize::try_from(index.chunk_length).ok()?)?;
    let sound = end <= bytes.len() && offset + ENVELOPE < end && bytes.get(offset) == Some(&op::CHUNK);
    sound.then_some(offset + ENVELOPE..end)
}

/// Says why bytes are not the start of an MCAP file.
pub(crate) fn check_magic(bytes: &[u8]) -> Result<(), String> {
    if bytes.starts_with(mcap::MAGIC) {
        return Ok(());
    }
    Err(match bytes {
        b if b.starts_with(b"#ROSBAG") => {
            "it is a ROS 1 bag; convert it with `mcap convert in.bag out.mcap`".into()
        }
        _ => "it does not start with the MCAP magic bytes".into(),
    })
}
