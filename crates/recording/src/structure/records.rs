//! Record envelopes of the MCAP format (<https://mcap.dev/spec>): opcode, length, body.
//!
//! Every length is checked against the bytes that are there before anything is sliced or allocated. That is why records
//! are parsed here and not by `mcap::parse_record`, which reserves what a string's length claims, up to 4 GiB, before it
//! looks whether the record holds that much.

use mcap::records::op;
use std::collections::BTreeMap;

/// Bytes of opcode and length before the body of a record.
pub(crate) const ENVELOPE: usize = 9;

/// One record: where it starts, what it is, what it holds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RawRecord<'a> {
    pub offset: usize,
    pub op: u8,
    pub body: &'a [u8],
}

/// Why a walk ended before the end of its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stop {
    /// The record at this offset runs past the end of the bytes.
    CutOff(usize),
    /// An opcode of zero, which no record has: zero-filled or overwritten.
    ZeroOpcode(usize),
}

/// Walks the records in `bytes[start..end]`; offsets are those in `bytes`.
pub(crate) struct Records<'a> {
    bytes: &'a [u8],
    at: usize,
    end: usize,
}

impl<'a> Records<'a> {
    pub fn new(bytes: &'a [u8], start: usize, end: usize) -> Records<'a> {
        let end = end.min(bytes.len());
        Records { bytes, at: start.min(end), end }
    }
}

impl<'a> Iterator for Records<'a> {
    type Item = Result<RawRecord<'a>, Stop>;

    fn next(&mut self) -> Option<Self::Item> {
        let (offset, end) = (self.at, self.end);
        if offset >= end {
            return None;
        }
        self.at = end;
        let (&op, rest) = self.bytes[offset..end].split_first()?;
        if op == 0 {
            return Some(Err(Stop::ZeroOpcode(offset)));
        }
        let mut cursor = Cursor::new(rest);
        let body = cursor.u64().and_then(|length| cursor.take(length));
        let Some(body) = body else { return Some(Err(Stop::CutOff(offset))) };
        self.at = offset + ENVELOPE + body.len();
        Some(Ok(RawRecord { offset, op, body }))
    }
}

/// Reads little-endian fields; `None` once the bytes run out.
pub(crate) struct Cursor<'a> {
    rest: &'a [u8],
}

impl<'a> Cursor<'a> {
    pub fn new(bytes: &'a [u8]) -> Cursor<'a> {
        Cursor { rest: bytes }
    }

    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }

    pub fn take(&mut self, length: u64) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(usize::try_from(length).ok()?)?;
        self.rest = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*taken)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// Bytes with their length before them.
    pub fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.take(u64::from(length))
    }

    pub fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.bytes()?).ok()
    }

    pub fn string(&mut self) -> Option<String> {
        self.text().map(str::to_owned)
    }

    /// A map as MCAP writes one, its size in bytes first; `None` where a key comes twice.
    pub fn map<K: Ord, V>(
        &mut self,
        key: impl Fn(&mut Cursor<'a>) -> Option<K>,
        value: impl Fn(&mut Cursor<'a>) -> Option<V>,
    ) -> Option<BTreeMap<K, V>> {
        let mut entries = Cursor::new(self.bytes()?);
        let mut map = BTreeMap::new();
        while !entries.rest.is_empty() {
            if map.insert(key(&mut entries)?, value(&mut entries)?).is_some() {
                return None;
            }
        }
        Some(map)
    }
}

/// A message record, its data borrowed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Message<'a> {
    pub channel_id: u16,
    pub sequence: u32,
    pub log_ns: u64,
    pub publish_ns: u64,
    pub data: &'a [u8],
    /// All of the record behind its envelope.
    pub body: &'a [u8],
}

impl<'a> Message<'a> {
    pub fn parse(body: &'a [u8]) -> Option<Message<'a>> {
        let mut c = Cursor::new(body);
        Some(Message {
            channel_id: c.u16()?,
            sequence: c.u32()?,
            log_ns: c.u64()?,
            publish_ns: c.u64()?,
            data: c.rest(),
            body,
        })
    }
}

impl Message<'_> {
    /// Writes the record as it was.
    pub fn write_to(&self, bytes: &mut Vec<u8>) {
        bytes.push(op::MESSAGE);
        bytes.extend((self.body.len() as u64).to_le_bytes());
        bytes.extend(self.body);
    }
}

/// The fields of a chunk record before its data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ChunkHeader<'a> {
    pub start_ns: u64,
    pub uncompressed_size: u64,
    pub uncompressed_crc: u32,
    pub compression: &'a str,
    pub compressed_size: u64,
}

impl<'a> ChunkHeader<'a> {
    /// Bytes of a header that names no compression.
    pub const LEAST_BYTES: usize = 40;

    /// The header, and whatever follows it.
    pub fn parse(body: &'a [u8]) -> Option<(ChunkHeader<'a>, &'a [u8])> {
        let mut c = Cursor::new(body);
        let start_ns = c.u64()?;
        let _end_ns = c.u64()?;
        let header = ChunkHeader {
            start_ns,
            uncompressed_size: c.u64()?,
            uncompressed_crc: c.u32()?,
            compression: c.text()?,
            compressed_size: c.u64()?,
        };
        Some((header, c.rest()))
    }

    /// Bytes that inflating it makes; none where it is not compressed.
    pub fn inflates_to(&self) -> u64 {
        if self.compression.is_empty() { 0 } else { self.uncompressed_size }
    }
}

/// The fields of a chunk index record that lead to the chunk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ChunkIndex {
    pub start_ns: u64,
    pub end_ns: u64,
    pub chunk_start: u64,
    pub chunk_length: u64,
    /// Channels with messages in the chunk, with the offset of their message index.
    pub message_indexes: BTreeMap<u16, u64>,
    /// Length of the message indexes, which follow the chunk.
    pub message_index_length: u64,
    /// Bytes that inflating the chunk makes; none where it is not compressed.
    pub inflates_to: u64,
}

impl ChunkIndex {
    pub fn parse(body: &[u8]) -> Option<ChunkIndex> {
        let mut c = Cursor::new(body);
        let mut index = ChunkIndex {
            start_ns: c.u64()?,
            end_ns: c.u64()?,
            chunk_start: c.u64()?,
            chunk_length: c.u64()?,
            message_indexes: c.map(Cursor::u16, Cursor::u64)?,
            message_index_length: c.u64()?,
            inflates_to: 0,
        };
        let (compression, _, uncompressed) = (c.text()?, c.u64()?, c.u64()?);
        index.inflates_to = if compression.is_empty() { 0 } else { uncompressed };
        Some(index)
    }
}

/// The fields of a statistics record that say how much there should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Statistics {
    pub message_count: u64,
    pub attachment_count: u32,
    pub metadata_count: u32,
    pub chunk_count: u32,
    pub start_ns: u64,
    pub end_ns: u64,
    pub channel_message_counts: BTreeMap<u16, u64>,
}

impl Statistics {
    pub fn parse(body: &[u8]) -> Option<Statistics> {
        let mut c = Cursor::new(body);
        let message_count = c.u64()?;
        let (_schemas, _channels) = (c.u16()?, c.u32()?);
        Some(Statistics {
            message_count,
            attachment_count: c.u32()?,
            metadata_count: c.u32()?,
            chunk_count: c.u32()?,
            start_ns: c.u64()?,
            end_ns: c.u64()?,
            channel_message_counts: c.map(Cursor::u16, Cursor::u64)?,
        })
    }
}

/// Log times are unsigned in MCAP; beyond the year 2262 they saturate.
pub(crate) fn saturating_ns(unsigned: u64) -> i64 {
    i64::try_from(unsigned).unwrap_or(i64::MAX)
}
