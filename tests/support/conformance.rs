//! The conformance corpus of the MCAP project, made again from the format's specification: six inputs
//! times every sensible combination of ten features of a file, 416 files, byte for byte the published ones
//! (`corpus_is_the_published_one` holds their digest).

use std::collections::{BTreeMap, BTreeSet};

/// The features of a file that the corpus varies, in the order in which names list them.
pub const FEATURES: [&str; 10] = ["ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad"];

const MAGIC: &[u8] = &[0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

/// One file of the corpus.
pub struct ConformanceFile {
    /// `<input>-<features>`.
    pub name: String,
    /// The file.
    pub bytes: Vec<u8>,
    /// Messages in it.
    pub messages: u64,
}

enum Data {
    Schema,
    Channel { schema: u16, encoding: &'static str, metadata: &'static [(&'static str, &'static str)] },
    Message { log_time: u64, publish_time: u64, sequence: u32 },
    Attachment,
    Metadata,
}

/// All 416 files.
pub fn corpus() -> Vec<ConformanceFile> {
    let mut files = Vec::new();
    for (input, records) in inputs() {
        for bits in 0u32..1 << FEATURES.len() {
            let features: BTreeSet<&str> =
                FEATURES.iter().enumerate().filter(|(i, _)| bits & (1 << i) != 0).map(|(_, f)| *f).collect();
            if makes_sense(&features, &records) {
                let name =
                    std::iter::once(input).chain(features.iter().copied()).collect::<Vec<_>>().join("-");
                let messages = records.iter().filter(|r| matches!(r, Data::Message { .. })).count() as u64;
                files.push(ConformanceFile { name, bytes: file(&features, &records), messages });
            }
        }
    }
    files
}

fn inputs() -> Vec<(&'static str, Vec<Data>)> {
    let channel = || Data::Channel { schema: 1, encoding: "a", metadata: &[("foo", "bar")] };
    let one = || Data::Message { log_time: 2, publish_time: 1, sequence: 10 };
    let mut ten = vec![Data::Schema, channel()];
    for (sequence, time) in [0, 2, 1, 3, 3, 5, 4, 7, 8, 9].into_iter().enumerate() {
        ten.push(Data::Message { log_time: time, publish_time: time, sequence: sequence as u32 });
    }
    vec![
        ("NoData", vec![]),
        ("OneSchemalessMessage", vec![Data::Channel { schema: 0, encoding: "text", metadata: &[] }, one()]),
        ("OneMessage", vec![Data::Schema, channel(), one()]),
        ("OneAttachment", vec![Data::Attachment]),
        ("OneMetadata", vec![Data::Metadata]),
        ("TenMessages", ten),
    ]
}

fn makes_sense(features: &BTreeSet<&str>, records: &[Data]) -> bool {
    let has = |f: &str| features.contains(f);
    let any = |wanted: fn(&Data) -> bool| records.iter().any(wanted);
    let schema = any(|r| matches!(r, Data::Schema));
    let channel = any(|r| matches!(r, Data::Channel { .. }));
    let chunked = has("ch");
    (!has("ax") || any(|r| matches!(r, Data::Attachment)))
        && (!has("mdx") || any(|r| matches!(r, Data::Metadata)))
        && (!has("rsh") || schema)
        && (!has("rch") || channel)
        && (channel || !(chunked || has("chx") || has("mx")))
        && (!has("sum") || ["chx", "rsh", "rch", "mdx", "ax", "st"].iter().any(|f| has(f)))
        && (chunked || !(has("chx") || has("mx")))
}

/// One record: opcode, length, body; padded with three bytes that readers must skip.
fn record(opcode: u8, body: &[u8], pad: bool) -> Vec<u8> {
    let padding: &[u8] = if pad { &[0x01, 0xff, 0xff] } else { &[] };
    let mut out = vec![opcode];
    out.extend(((body.len() + padding.len()) as u64).to_le_bytes());
    out.extend(body);
    out.extend(padding);
    out
}

/// Little-endian fields, length-prefixed strings.
#[derive(Default)]
struct Body(Vec<u8>);

impl Body {
    fn u16(mut self, v: u16) -> Self {
        self.0.extend(v.to_le_bytes());
        self
    }
    fn u32(mut self, v: u32) -> Self {
        self.0.extend(v.to_le_bytes());
        self
    }
    fn u64(mut self, v: u64) -> Self {
        self.0.extend(v.to_le_bytes());
        self
    }
    fn string(self, s: &str) -> Self {
        let mut with_length = self.u32(s.len() as u32);
        with_length.0.extend(s.as_bytes());
        with_length
    }
    fn bytes(mut self, b: &[u8]) -> Self {
        self.0.extend(b);
        self
    }
    fn map(self, entries: &[(&str, &str)]) -> Self {
        let body = entries.iter().fold(Body::default(), |b, (k, v)| b.string(k).string(v)).0;
        self.u32(body.len() as u32).bytes(&body)
    }
}

fn schema_record(pad: bool) -> Vec<u8> {
    record(0x03, &Body::default().u16(1).string("Example").string("c").u32(3).bytes(&[4, 5, 6]).0, pad)
}

fn channel_record(schema: u16, encoding: &str, metadata: &[(&str, &str)], pad: bool) -> Vec<u8> {
    record(0x04, &Body::default().u16(1).u16(schema).string("example").string(encoding).map(metadata).0, pad)
}

fn file(features: &BTreeSet<&str>, records: &[Data]) -> Vec<u8> {
    let has = |f: &str| features.contains(f);
    let pad = has("pad");
    let mut out = MAGIC.to_vec();
    out.extend(record(0x01, &Body::default().string("").string("").0, pad));

    let mut chunk = Vec::new();
    let (mut index, mut times) = (Vec::new(), Vec::new());
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    let (mut attachment_index, mut metadata_index) = (Vec::new(), Vec::new());
    for data in records {
        // Records inside a chunk are never padded.
        let (into, padded) = if has("ch") { (&mut chunk, false) } else { (&mut out, pad) };
        match data {
            Data::Schema => {
                *counts.entry("schema").or_default() += 1;
                into.extend(schema_record(padded));
            }
            Data::Channel { schema, encoding, metadata } => {
                *counts.entry("channel").or_default() += 1;
                into.extend(channel_record(*schema, encoding, metadata, padded));
            }
            Data::Message { log_time, publish_time, sequence } => {
                index.push((*log_time, into.len() as u64));
                times.push(*log_time);
                let body = Body::default().u16(1).u32(*sequence).u64(*log_time).u64(*publish_time);
                into.extend(record(0x05, &body.bytes(&[1, 2, 3]).0, false));
            }
            Data::Attachment => {
                *counts.entry("attachment").or_default() += 1;
                let offset = out.len() as u64;
                let body = Body::default().u64(2).u64(1).string("myFile").string("application/octet-stream");
                let body = body.u64(3).bytes(&[1, 2, 3]);
                let crc = crc32(&body.0);
                let written = record(0x09, &body.u32(crc).0, pad);
                let entry = Body::default().u64(offset).u64(written.len() as u64).u64(2).u64(1).u64(3);
                attachment_index =
                    record(0x0A, &entry.string("myFile").string("application/octet-stream").0, pad);
                out.extend(written);
            }
            Data::Metadata => {
                *counts.entry("metadata").or_default() += 1;
                let offset = out.len() as u64;
                let body = Body::default().string("myMetadata").map(&[("foo", "bar")]);
                let written = record(0x0C, &body.0, pad);
                let entry = Body::default().u64(offset).u64(written.len() as u64).string("myMetadata");
                metadata_index = record(0x0D, &entry.0, pad);
                out.extend(written);
            }
        }
    }
    let (first, last) = (times.iter().min().copied().unwrap_or(0), times.iter().max().copied().unwrap_or(0));
    let mut chunk_index = Vec::new();
    if has("ch") {
        chunk_index = write_chunk(&mut out, &chunk, (first, last), &index, has("mx"), pad);
    }
    let data_crc = crc32(&out);
    out.extend(record(0x0F, &Body::default().u32(data_crc).0, false));
    let count = |name: &str| counts.get(name).copied().unwrap_or(0);

    let mut groups: Vec<(u8, Vec<u8>)> = Vec::new();
    if has("rsh") {
        groups.push((0x03, schema_record(pad)));
    }
    if has("rch") {
        let mut channels = Vec::new();
        for data in records {
            if let Data::Channel { schema, encoding, metadata } = data {
                channels.extend(channel_record(*schema, encoding, metadata, pad));
            }
        }
        groups.push((0x04, channels));
    }
    if has("st") {
        let body = Body::default().u64(times.len() as u64).u16(count("schema") as u16);
        let body = body.u32(count("channel") as u32).u32(count("attachment") as u32);
        let body = body.u32(count("metadata") as u32).u32(u32::from(has("ch"))).u64(first).u64(last);
        let body = match times.len() {
            0 => body.u32(0),
            n => body.u32(10).u16(1).u64(n as u64),
        };
        groups.push((0x0B, record(0x0B, &body.0, pad)));
    }
    if has("mdx") {
        groups.push((0x0D, metadata_index));
    }
    if has("ax") {
        groups.push((0x0A, attachment_index));
    }
    if has("chx") {
        groups.push((0x08, chunk_index));
    }
    write_summary(&mut out, &groups, has("sum"), pad);
    out
}

/// Appends the chunk and its message index; returns the chunk index record.
fn write_chunk(
    out: &mut Vec<u8>,
    chunk: &[u8],
    (first, last): (u64, u64),
    index: &[(u64, u64)],
    with_index: bool,
    pad: bool,
) -> Vec<u8> {
    let size = chunk.len() as u64;
    let body = Body::default().u64(first).u64(last).u64(size).u32(crc32(chunk)).string("");
    let start = out.len() as u64;
    out.extend(record(0x06, &body.u64(size).bytes(chunk).0, false));
    let chunk_length = out.len() as u64 - start;

    let index_start = out.len() as u64;
    let mut offsets = Body::default();
    if with_index {
        let entries = index.iter().fold(Body::default(), |b, (time, at)| b.u64(*time).u64(*at)).0;
        let body = Body::default().u16(1).u32(entries.len() as u32).bytes(&entries);
        out.extend(record(0x07, &body.0, pad));
        offsets = offsets.u16(1).u64(index_start);
    }
    let index_length = out.len() as u64 - index_start;
    let body = Body::default().u64(first).u64(last).u64(start).u64(chunk_length);
    let body = body.u32(offsets.0.len() as u32).bytes(&offsets.0).u64(index_length);
    record(0x08, &body.string("").u64(size).u64(size).0, pad)
}

fn write_summary(out: &mut Vec<u8>, groups: &[(u8, Vec<u8>)], with_offsets: bool, pad: bool) {
    let summary_start = out.len();
    let mut offsets = Vec::new();
    for (opcode, bytes) in groups.iter().filter(|(_, bytes)| !bytes.is_empty()) {
        let body = Body(vec![*opcode]).u64(out.len() as u64).u64(bytes.len() as u64);
        offsets.extend(record(0x0E, &body.0, pad));
        out.extend(bytes);
    }
    let has_summary = out.len() != summary_start;
    let offset_start = if with_offsets { out.len() as u64 } else { 0 };
    if with_offsets {
        out.extend(offsets);
    }
    let footer = Body::default().u64(if has_summary { summary_start as u64 } else { 0 }).u64(offset_start);
    let mut covered = out[summary_start..].to_vec();
    covered.push(0x02);
    covered.extend(20u64.to_le_bytes());
    covered.extend(&footer.0);
    out.extend(record(0x02, &footer.u32(crc32(&covered)).0, false));
    out.extend(MAGIC);
}

/// CRC-32 (IEEE), as the specification asks.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}
