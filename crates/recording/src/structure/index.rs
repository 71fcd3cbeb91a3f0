//! The layout of a file that is read by ranges, out of its summary alone.
//!
//! Walking the data section, as [`crate::structure::layout`] does with a mapped file, would fetch something at every chunk. Here the
//! summary is believed, but only if everything it says fits together and accounts for every byte of the data section;
//! a chunk is checked against it again when it is read. Anything else makes it unusable, and the file is read whole.

use crate::RecordingError;
use crate::bytes::budget::Allowance;
use crate::bytes::ranges::Ranged;
use crate::report::Source;
use crate::structure::channels::Definitions;
use crate::structure::layout::{self, Block, Content, DataCrc, Layout, check_magic};
use crate::structure::records::{ChunkIndex, Cursor, ENVELOPE, RawRecord, Records, Statistics};
use crate::structure::survey::Tally;
use mcap::records::op;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Footer record.
const FOOTER_BYTES: usize = ENVELOPE + layout::FOOTER_BYTES;
/// DataEnd record, the last before the summary.
const DATA_END_BYTES: usize = ENVELOPE + layout::DATA_END_BYTES;
/// The header record is looked for in so many bytes.
const HEAD_BYTES: usize = 4096;
/// A larger summary is not read into memory.
const MAX_SUMMARY_BYTES: usize = 256 << 20;
/// More than this between the records that the summary knows is not read as one block.
const MAX_GAP_BYTES: usize = 16 << 20;

/// A larger chunk is not read into memory.
const MAX_CHUNK_BYTES: usize = 1 << 30;

/// What the summary of a file is good for.
pub(crate) enum Found {
    /// Everything.
    Layout(Box<Layout>),
    /// Nothing, and why: the file must be walked.
    Unusable(&'static str),
    /// The file is no MCAP file, and why.
    NotMcap(String),
}

/// Finds the structure of a file with two or three requests.
pub(crate) fn find(file: &Ranged) -> Result<Found, RecordingError> {
    find_within(file, &Allowance::of(file.len(), 1))
}

/// The same of one that may inflate to so much.
pub(crate) fn find_within(file: &Ranged, allowance: &Allowance) -> Result<Found, RecordingError> {
    let size = file.len() as usize;
    let head = file.read_one(0..HEAD_BYTES)?;
    if let Err(why) = check_magic(&head) {
        return Ok(Found::NotMcap(why));
    }
    let end = size.saturating_sub(FOOTER_BYTES + mcap::MAGIC.len());
    let footer = file.read_one(end..size)?;
    let Some((summary_start, crc)) = parse_footer(&footer) else {
        return Ok(Found::Unusable("it does not end with a footer"));
    };
    if summary_start == 0 {
        return Ok(Found::Unusable("it has no summary"));
    }
    let sound = (mcap::MAGIC.len() + DATA_END_BYTES..end).contains(&summary_start);
    if !sound || end - summary_start > MAX_SUMMARY_BYTES {
        return Ok(Found::Unusable("its footer does not point to a summary"));
    }
    let bytes = file.read_one(summary_start - DATA_END_BYTES..end + ENVELOPE + 16)?;
    let (data_end, summary) = bytes.split_at(DATA_END_BYTES);
    if crc != 0 && crc32fast::hash(summary) != crc {
        return Ok(Found::Unusable("the CRC of its summary disagrees"));
    }
    let data_end = Records::new(data_end, 0, DATA_END_BYTES).next().and_then(Result::ok);
    let Some(data_end) =
        data_end.filter(|r| r.op == op::DATA_END && r.body.len() + ENVELOPE == DATA_END_BYTES)
    else {
        return Ok(Found::Unusable("no end of the data stands before its summary"));
    };
    let crc = Cursor::new(data_end.body).u32().filter(|crc| *crc != 0);
    let data = summary_start - DATA_END_BYTES;
    let layout = Summary::parse(&summary[..end - summary_start])
        .and_then(|summary| summary.layout(&head, data, allowance));
    // A chunk has a CRC of its own. A local file is hashed, an object is read whole only where it is copied.
    if crc.is_some() && file.object.is_some() && layout.as_ref().is_ok_and(|layout| layout.chunks == 0) {
        return Ok(Found::Unusable(
            "its messages are in no chunk, so that only the CRC of all data covers them",
        ));
    }
    let layout =
        layout.map(|layout| Layout { data_crc: crc.map(|crc| DataCrc { end: data, crc }), ..layout });
    Ok(layout.map_or_else(Found::Unusable, |layout| Found::Layout(Box::new(layout))))
}

/// Start of the summary, and its CRC.
fn parse_footer(bytes: &[u8]) -> Option<(usize, u32)> {
    let body = bytes.strip_suffix(mcap::MAGIC)?;
    let record = Records::new(body, 0, FOOTER_BYTES).next()?.ok()?;
    let mut fields = Cursor::new(record.body);
    let (start, _, crc) = (fields.u64()?, fields.u64()?, fields.u32()?);
    (record.op == op::FOOTER).then_some((usize::try_from(start).ok()?, crc))
}

/// The records of a summary.
#[derive(Default)]
struct Summary {
    definitions: Definitions,
    statistics: Option<Statistics>,
    chunks: Vec<ChunkIndex>,
    /// Where attachments and metadata records are: offset and length.
    attachments: Vec<(u64, u64)>,
    metadata: Vec<(u64, u64)>,
}

impl Summary {
    fn parse(bytes: &[u8]) -> Result<Summary, &'static str> {
        let mut summary = Summary::default();
        for record in Records::new(bytes, 0, bytes.len()) {
            let record = record.map_err(|_| "a record of its summary is cut off")?;
            summary.definitions.absorb(&record)?;
            summary.absorb(&record).ok_or("a record of its summary cannot be read")?;
        }
        Ok(summary)
    }

    fn absorb(&mut self, record: &RawRecord<'_>) -> Option<()> {
        let place = |mut fields: Cursor<'_>| Some((fields.u64()?, fields.u64()?));
        match record.op {
            op::STATISTICS => self.statistics = Some(Statistics::parse(record.body)?),
            op::CHUNK_INDEX => self.chunks.push(ChunkIndex::parse(record.body)?),
            op::ATTACHMENT_INDEX => self.attachments.push(place(Cursor::new(record.body))?),
            op::METADATA_INDEX => self.metadata.push(place(Cursor::new(record.body))?),
            _ => {}
        }
        Some(())
    }

    /// The layout of a data section that ends at `data_end`.
    fn layout(mut self, head: &[u8], data_end: usize, allowance: &Allowance) -> Result<Layout, &'static str> {
        let statistics = self.statistics.take().ok_or("its summary has no statistics")?;
        self.check(&statistics)?;
        let header = Records::new(head, mcap::MAGIC.len(), head.len()).next().and_then(Result::ok);
        let header = header.filter(|r| r.op == op::HEADER).ok_or("no header can be read at its start")?;
        let mut words = Cursor::new(header.body);
        let words = words.string().zip(words.string()).ok_or("its header cannot be read")?;
        let data = header.offset + ENVELOPE + header.body.len()..data_end;
        let blocks = self.blocks(&data)?;
        self.chunks.sort_by_key(|chunk| chunk.chunk_start);
        let too_large = |c: &&ChunkIndex| !allowance.admits(c.chunk_length, c.inflates_to);
        let refused = self.chunks.iter().filter(too_large).map(|c| c.chunk_start as usize).collect();
        let bodies = |records: &[(u64, u64)]| -> Result<Vec<Range<usize>>, &'static str> {
            let body = |(offset, length): &(u64, u64)| {
                byte_range(*offset, *length).map(|r| r.start + ENVELOPE..r.end).filter(|r| r.start <= r.end)
            };
            records.iter().map(|r| body(r).ok_or(OUTSIDE)).collect()
        };
        Ok(Layout {
            profile: words.0,
            library: words.1,
            source: Some(Source::Index),
            blocks,
            chunks: self.chunks.len(),
            refused,
            attachments: bodies(&self.attachments)?,
            metadata: bodies(&self.metadata)?,
            first_ns: self.chunks.iter().map(|c| c.start_ns).filter(|ns| *ns > 0).min(),
            declared: declared_tallies(&statistics, &self.chunks),
            definitions: self.definitions,
            definitions_complete: true,
            statistics: Some(statistics),
            ..Layout::default()
        })
    }

    /// Whether the parts of the summary agree with each other.
    fn check(&self, statistics: &Statistics) -> Result<(), &'static str> {
        let counts = [
            (statistics.chunk_count, self.chunks.len()),
            (statistics.attachment_count, self.attachments.len()),
            (statistics.metadata_count, self.metadata.len()),
        ];
        if counts.iter().any(|(declared, listed)| *declared as usize != *listed) {
            return Err("its summary lists other numbers of records than its statistics");
        }
        let listed = self.chunks.iter().flat_map(|c| c.message_indexes.keys());
        let mut used = listed.chain(statistics.channel_message_counts.keys());
        if used.any(|id| self.definitions.channel(*id).is_none()) {
            return Err("its summary does not define all of its channels");
        }
        let counted: u64 = statistics.channel_message_counts.values().fold(0, |n, c| n.saturating_add(*c));
        if counted != statistics.message_count {
            return Err("its statistics do not add up");
        }
        Ok(())
    }

    /// The chunks, and as blocks of unknown content whatever lies between the records that the summary knows.
    fn blocks(&self, data: &Range<usize>) -> Result<Vec<Block>, &'static str> {
        let mut known: Vec<(Range<usize>, Option<Block>)> = Vec::new();
        for (offset, length) in self.attachments.iter().chain(&self.metadata) {
            known.push((byte_range(*offset, *length).ok_or(OUTSIDE)?, None));
        }
        for chunk in &self.chunks {
            let record = byte_range(chunk.chunk_start, chunk.chunk_length)
                .filter(|r| r.len() > ENVELOPE)
                .ok_or(OUTSIDE)?;
            if record.len() > MAX_CHUNK_BYTES {
                return Err("one of its chunks is larger than a chunk may be");
            }
            let indexes = byte_range(record.end as u64, chunk.message_index_length).ok_or(OUTSIDE)?;
            let indexed = !chunk.message_indexes.is_empty();
            let body = record.start + ENVELOPE..record.end;
            let block = Block {
                offset: record.start,
                content: Content::Chunk { body, indexes: indexes.clone() },
                holds: indexed.then(|| chunk.message_indexes.keys().copied().collect()),
                inflates_to: Some(chunk.inflates_to),
                claim: chunk.inflates_to,
            };
            known.push((record.start..indexes.end, Some(block)));
        }
        known.sort_by_key(|(range, _)| (range.start, range.end));
        let mut blocks = Vec::new();
        let mut at = data.start;
        for (range, block) in known.into_iter().chain([(data.end..data.end, None)]) {
            if range.start < at || range.end > data.end {
                return Err(OUTSIDE);
            }
            if range.start - at > MAX_GAP_BYTES {
                return Err("a large part of it is in no chunk");
            }
            if range.start > at {
                blocks.push(Block::of(at, Content::Records(at..range.start)));
            }
            at = range.end;
            blocks.extend(block);
        }
        Ok(blocks)
    }
}

const OUTSIDE: &str = "its summary lists records that overlap or lie outside the data";

fn byte_range(offset: u64, length: u64) -> Option<Range<usize>> {
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    Some(usize::try_from(offset).ok()?..end)
}

/// Messages of each channel as the statistics count them; first and last are times of the chunks that hold any.
fn declared_tallies(statistics: &Statistics, chunks: &[ChunkIndex]) -> BTreeMap<u16, Tally> {
    let mut times: BTreeMap<u16, (u64, u64)> = BTreeMap::new();
    for chunk in chunks {
        for id in chunk.message_indexes.keys() {
            let (first, last) = times.entry(*id).or_insert((u64::MAX, 0));
            *first = chunk.start_ns.min(*first);
            *last = chunk.end_ns.max(*last);
        }
    }
    let of_file = (statistics.start_ns, statistics.end_ns);
    let tally = |(id, messages): (&u16, &u64)| {
        let (first_ns, last_ns) = times.get(id).copied().unwrap_or(of_file);
        (*id, Tally { messages: *messages, first_ns, last_ns })
    };
    statistics.channel_message_counts.iter().filter(|(_, n)| **n > 0).map(tally).collect()
}

/// The body of a chunk read together with its envelope, if that is what the index said.
pub(crate) fn body_of_chunk(record: &[u8]) -> Result<&[u8], String> {
    match Records::new(record, 0, record.len()).next() {
        Some(Ok(found)) if found.op == op::CHUNK && found.body.len() + ENVELOPE == record.len() => {
            Ok(found.body)
        }
        _ => Err("there is no chunk of the length that the index says".to_owned()),
    }
}

/// Numbers the blocks that may hold one of these channels.
pub(crate) fn candidate_blocks(blocks: &[Block], wanted: &BTreeSet<u16>) -> Vec<usize> {
    let may_hold =
        |block: &Block| block.holds.as_ref().is_none_or(|ids| ids.iter().any(|id| wanted.contains(id)));
    (0..blocks.len()).filter(|i| !wanted.is_empty() && may_hold(&blocks[*i])).collect()
}
