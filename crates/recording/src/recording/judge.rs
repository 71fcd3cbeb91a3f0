//! The records of one block: which of them are sound, and whether they are those that the message indexes list.

use crate::bytes::FileBytes;
use crate::recording::file::RecordingFile;
use crate::structure::chunk::Inflater;
use crate::structure::damage::Faults;
use crate::structure::index::body_of_chunk;
use crate::structure::layout::{Content, FIRST_PRIVATE, Layout, hash_pair};
use crate::structure::records::{ChunkHeader, Cursor, Message, Records};
use crate::structure::survey::{At, FileSurvey, Tally};
use bytes::Bytes;
use mcap::records::op;
use std::collections::BTreeMap;

/// What a block showed.
pub(crate) struct Judged {
    pub survey: FileSurvey,
    /// Records of a chunk that stands alone, where they are not what was inflated last.
    pub inflated: Option<Vec<u8>>,
}

/// Hands every sound message of a block to `each`, and says what else it showed.
pub(crate) fn judge_block(
    file: &RecordingFile,
    at: At,
    fetched: Option<&Bytes>,
    inflater: &mut Inflater,
    each: &mut dyn FnMut(&Message<'_>),
) -> Judged {
    let block = &file.layout.blocks[at.block];
    let survey = FileSurvey { definitions: file.layout.definitions.beside(), ..FileSurvey::default() };
    let mut pass = Pass { file, at, survey, short: 0, each };
    let mut inflated = None;
    match (&block.content, stored_bytes(file, at, fetched)) {
        (_, Err(why)) => pass.lost(block.offset, || format!("chunk dropped: {why}")),
        (Content::Records(_), Ok((bytes, _))) => pass.records(bytes, inflater),
        (Content::Chunk { .. }, Ok((body, indexes))) => {
            let mut chunk = pass.chunk(block.offset, body, inflater);
            for index in Records::new(indexes, 0, indexes.len()).map_while(Result::ok) {
                chunk.compare(index.body, &mut pass.survey.faults);
            }
            chunk.finish(&mut pass.survey);
            inflated = ChunkHeader::parse(body)
                .filter(|(header, _)| header.compression.is_empty() && chunk.sound)
                .map(|(_, packed)| packed.to_vec())
                .or_else(|| (!chunk.sound).then(Vec::new));
        }
        (Content::CutChunk(_), Ok((body, _))) => inflated = Some(pass.cut_chunk(body, inflater)),
    }
    if pass.short > 0 {
        let short = pass.short;
        pass.lost(block.offset, || format!("messages shorter than their header are dropped ({short} here)"));
    }
    Judged { survey: pass.survey, inflated }
}

/// The bytes of a block as they are in the file: the body of a chunk and the message indexes behind it, or records.
fn stored_bytes<'a>(
    file: &'a RecordingFile,
    at: At,
    fetched: Option<&'a Bytes>,
) -> Result<(&'a [u8], &'a [u8]), String> {
    let block = &file.layout.blocks[at.block];
    match (&file.bytes, fetched, &block.content) {
        (FileBytes::Mapped(map), _, Content::Chunk { body, indexes }) => {
            Ok((&map[body.clone()], &map[indexes.clone()]))
        }
        (FileBytes::Mapped(map), _, Content::CutChunk(bytes) | Content::Records(bytes)) => {
            Ok((&map[bytes.clone()], &[]))
        }
        (FileBytes::Ranged(_), Some(bytes), Content::Chunk { body, .. }) => {
            let (record, indexes) = bytes.split_at_checked(body.end - block.offset).ok_or("it is cut off")?;
            Ok((body_of_chunk(record)?, indexes))
        }
        (FileBytes::Ranged(_), Some(bytes), Content::CutChunk(_) | Content::Records(_)) => Ok((bytes, &[])),
        (FileBytes::Ranged(_), None, _) => Err("it was not read".to_owned()),
    }
}

struct Pass<'a> {
    file: &'a RecordingFile,
    at: At,
    survey: FileSurvey,
    /// Messages without a whole header.
    short: u64,
    each: &'a mut dyn FnMut(&Message<'_>),
}

impl Pass<'_> {
    fn lost(&mut self, offset: usize, why: impl FnOnce() -> String) {
        self.survey.faults.lost(offset, why);
    }

    /// Records outside chunks, and small chunks with their indexes.
    fn records(&mut self, bytes: &[u8], inflater: &mut Inflater) {
        let start = self.file.layout.blocks[self.at.block].offset;
        let mut loose = Chunk::default();
        let mut chunk: Option<Chunk> = None;
        for record in Records::new(bytes, 0, bytes.len()) {
            let Ok(record) = record else {
                self.lost(start, || "from somewhere here on, records cannot be read".to_owned());
                break;
            };
            let offset = start + record.offset;
            if record.op == op::MESSAGE_INDEX {
                match &mut chunk {
                    Some(chunk) => chunk.compare(record.body, &mut self.survey.faults),
                    None => self.lost(offset, || "a message index, and no chunk before it".to_owned()),
                }
                continue;
            }
            // A record of a kind that has no place here was a chunk once: its indexes are no fault of their own.
            let odd = Chunk { offset, ..Chunk::default() };
            let next = match record.op {
                op::CHUNK => Some(self.chunk(offset, record.body, inflater)),
                kind if kind < FIRST_PRIVATE && !of_messages(kind) => Some(odd),
                _ => None,
            };
            if let Some(chunk) = std::mem::replace(&mut chunk, next) {
                chunk.finish(&mut self.survey);
            }
            self.content(record.op, record.body, 0, offset, &mut loose);
        }
        chunk.iter().for_each(|chunk| chunk.finish(&mut self.survey));
        loose.finish(&mut self.survey);
    }

    /// A definition or a message.
    fn content(&mut self, kind: u8, body: &[u8], place: u64, offset: usize, found: &mut Chunk) {
        match kind {
            op::MESSAGE => match Message::parse(body) {
                Some(message) => {
                    found.count(&message, place);
                    (self.each)(&message);
                }
                None => self.short += 1,
            },
            op::SCHEMA | op::CHANNEL => {
                let record = crate::structure::records::RawRecord { offset: 0, op: kind, body };
                // Those of the summary may come from other places of the file; all must be the same.
                let layout = &self.file.layout;
                let mut said = layout.definitions.check(&record);
                if !layout.definitions_complete && !layout.definitions.has(&record) {
                    said = said.and(self.survey.definitions.absorb(&record));
                }
                if let Err(why) = said {
                    self.lost(offset, || why.to_owned());
                }
            }
            _ => {}
        }
    }

    /// A chunk, judged as a whole before any of its messages is used.
    fn chunk(&mut self, offset: usize, body: &[u8], inflater: &mut Inflater) -> Chunk {
        let mut found = Chunk { offset, ..Chunk::default() };
        let Layout { refused, blocks, .. } = &self.file.layout;
        let header = ChunkHeader::parse(body);
        let claimed = header.map(|(header, _)| header.inflates_to());
        let listed = blocks[self.at.block].inflates_to;
        let records = match refused.binary_search(&offset) {
            Ok(_) => Err(TOO_LARGE.to_owned()),
            Err(_) if listed.is_some() && listed != claimed => {
                Err("it claims to inflate to another size than its index".to_owned())
            }
            Err(_) => inflater.whole(body).and_then(well_formed),
        };
        match records {
            Ok(bytes) => {
                found.sound = true;
                self.chunk_records(bytes, offset, &mut found);
            }
            Err(why) => self.lost(offset, || format!("chunk dropped: {why}")),
        }
        if let Some((header, packed)) = header
            && packed.len() as u64 > header.compressed_size
        {
            let left = packed.len() as u64 - header.compressed_size;
            self.lost(offset, || format!("{left} bytes are left over at the end of this chunk"));
        }
        found
    }

    fn chunk_records(&mut self, bytes: &[u8], offset: usize, found: &mut Chunk) {
        for record in Records::new(bytes, 0, bytes.len()).map_while(Result::ok) {
            if record.op < FIRST_PRIVATE && !of_messages(record.op) {
                self.lost(offset, || format!("a record of kind {:#04x} in this chunk", record.op));
            }
            self.content(record.op, record.body, record.offset as u64, offset, found);
        }
    }

    /// The last chunk of a cut file: all of it, or what of it inflates. Returns the records used.
    fn cut_chunk(&mut self, body: &[u8], inflater: &mut Inflater) -> Vec<u8> {
        let offset = self.file.layout.blocks[self.at.block].offset;
        let mut found = Chunk { offset, sound: true, ..Chunk::default() };
        if self.file.layout.refused.binary_search(&offset).is_ok() {
            self.lost(offset, || format!("chunk dropped: {TOO_LARGE}"));
            return Vec::new();
        }
        let bytes = match inflater.whole(body).and_then(well_formed) {
            Ok(bytes) => bytes.to_vec(),
            Err(_) => {
                let sound = body.iter().rposition(|b| *b != 0).map_or(0, |i| i + 1);
                let bytes = inflater.prefix(&body[..sound]).unwrap_or_default().to_vec();
                self.lost(offset, || {
                    format!("last chunk cut off: only the first {} bytes of it inflate", bytes.len())
                });
                bytes
            }
        };
        self.chunk_records(&bytes, offset, &mut found);
        found.finish(&mut self.survey);
        bytes
    }
}

/// Why a chunk is not inflated.
const TOO_LARGE: &str = "it claims to inflate to more than it may (docs/hardening.md, ARMCAL_INFLATE_MIB)";

/// Kinds of records that a chunk holds.
fn of_messages(kind: u8) -> bool {
    matches!(kind, op::SCHEMA | op::CHANNEL | op::MESSAGE)
}

/// The bytes, if they are whole records to the last one.
fn well_formed(bytes: &[u8]) -> Result<&[u8], String> {
    match Records::new(bytes, 0, bytes.len()).all(|r| r.is_ok()) {
        true => Ok(bytes),
        false => Err("its records do not add up to its size".to_owned()),
    }
}

/// The messages of a chunk, or those outside any, for comparison with its message indexes.
#[derive(Default)]
struct Chunk {
    offset: usize,
    /// Whether it could be used: of one that could not, nothing can be compared.
    sound: bool,
    channels: BTreeMap<u16, Seen>,
    /// Whether it has message indexes at all.
    indexed: bool,
}

struct Seen {
    tally: Tally,
    /// Times and places of all, mixed.
    mixed: u64,
    indexed: bool,
}

impl Chunk {
    fn count(&mut self, message: &Message<'_>, place: u64) {
        let one = Tally { messages: 1, first_ns: message.log_ns, last_ns: message.log_ns };
        let mixed = hash_pair(message.log_ns, place);
        self.channels
            .entry(message.channel_id)
            .and_modify(|seen| {
                seen.tally.add(one);
                seen.mixed = seen.mixed.wrapping_add(mixed);
            })
            .or_insert(Seen { tally: one, mixed, indexed: false });
    }

    /// Compares with the index of one channel.
    fn compare(&mut self, index: &[u8], faults: &mut Faults) {
        if !self.sound {
            return;
        }
        self.indexed = true;
        let Some((channel, count, sum)) = parse_index(index) else {
            return faults.lost(self.offset, || "a message index of this chunk cannot be read".to_owned());
        };
        let seen = self.channels.get_mut(&channel);
        let found = seen.as_ref().map_or((0, 0), |seen| (seen.tally.messages, seen.mixed));
        if let Some(seen) = seen {
            seen.indexed = true;
        }
        if found != (count, sum) {
            faults.lost(self.offset, || {
                format!(
                    "this chunk has {} messages of channel {channel}, and by their index {count}, or not at the same times \
                     and places",
                    found.0
                )
            });
        }
    }

    /// All indexes have been compared.
    fn finish(&self, survey: &mut FileSurvey) {
        for (channel, seen) in &self.channels {
            survey.count(*channel, seen.tally);
            if self.indexed && !seen.indexed {
                survey.faults.lost(self.offset, || {
                    format!("this chunk has messages of channel {channel}, and no index lists them")
                });
            }
        }
    }
}

/// Channel, number and mixture of the entries of a message index.
fn parse_index(body: &[u8]) -> Option<(u16, u64, u64)> {
    let mut fields = Cursor::new(body);
    let channel = fields.u16()?;
    let mut entries = Cursor::new(fields.bytes()?);
    let (mut count, mut sum) = (0, 0_u64);
    while !entries.rest().is_empty() {
        sum = sum.wrapping_add(hash_pair(entries.u64()?, entries.u64()?));
        count += 1;
    }
    Some((channel, count, sum))
}
