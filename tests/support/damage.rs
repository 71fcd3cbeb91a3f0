//! Ways in which real recordings break, applied to a sound one: each says how many messages must still be usable.
//!
//! What is expected comes from the sound file, read by the MCAP project's own library, never from armcal.

use mcap::records::ChunkIndex;
use std::io::Cursor;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const FOOTER_BYTES: usize = 9 + 20;

/// A sound recording in zstd chunks with a summary, and where its parts are.
pub struct Sound {
    pub bytes: Vec<u8>,
    pub chunks: Vec<ChunkIndex>,
    /// Messages of each chunk.
    pub counts: Vec<u64>,
}

/// One damaged recording.
pub struct Damaged {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    /// Messages that can be used.
    pub usable: u64,
    /// What is said about it; empty for a file in which nothing is wrong.
    pub says: &'static str,
    /// Whether data were lost.
    pub lost: bool,
}

impl Sound {
    pub fn new(bytes: Vec<u8>) -> Sound {
        let summary = mcap::Summary::read(&bytes).expect("sound").expect("with a summary");
        let mut chunks = summary.chunk_indexes.clone();
        chunks.sort_by_key(|c| c.chunk_start_offset);
        let count = |c: &ChunkIndex| summary.stream_chunk(&bytes, c).expect("sound").flatten().count() as u64;
        let counts: Vec<u64> = chunks.iter().map(count).collect();
        assert!(chunks.len() >= 3 && counts.iter().all(|n| *n > 0), "{counts:?}");
        Sound { bytes, chunks, counts }
    }

    pub fn messages(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The chunk that is hit: one in the middle.
    fn hit(&self) -> usize {
        self.chunks.len() / 2
    }

    fn chunk(&self, i: usize) -> std::ops::Range<usize> {
        let start = self.chunks[i].chunk_start_offset as usize;
        start..start + self.chunks[i].chunk_length as usize
    }

    fn before_hit(&self) -> u64 {
        self.counts[..self.hit()].iter().sum()
    }

    fn footer(&self) -> usize {
        self.bytes.len() - MAGIC.len() - FOOTER_BYTES
    }

    fn summary_start(&self) -> usize {
        let at = self.footer() + 9;
        u64::from_le_bytes(self.bytes[at..at + 8].try_into().expect("8 bytes")) as usize
    }

    /// Changes a copy.
    fn changed(&self, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        change(&mut bytes);
        bytes
    }

    /// Changes a copy in its summary, which no CRC vouches for any more (0 is "not computed").
    fn with_other_summary(&self, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
        let crc = self.footer() + 9 + 16;
        self.changed(|bytes| {
            bytes[crc..crc + 4].fill(0);
            change(bytes);
        })
    }

    /// Where in the summary the body of the first record of this kind is.
    fn in_summary(&self, op: u8) -> usize {
        let mut at = self.summary_start();
        while self.bytes[at] != op {
            let length = u64::from_le_bytes(self.bytes[at + 1..at + 9].try_into().expect("8 bytes"));
            at += 9 + length as usize;
        }
        at + 9
    }

    /// A place inside the hit chunk, behind a byte that is not zero.
    fn mid_chunk(&self) -> usize {
        let chunk = self.chunk(self.hit());
        let middle = chunk.start + chunk.len() / 2;
        (middle..chunk.end).find(|at| self.bytes[at - 1] != 0).expect("compressed bytes are not all zero")
    }

    /// The set. `all` messages in a sound file, `hit` in the chunk that is damaged.
    pub fn damaged(&self) -> Vec<Damaged> {
        let (all, hit) = (self.messages(), self.counts[self.hit()]);
        let broken = |name, bytes, usable, says, lost| Damaged { name, bytes, usable, says, lost };
        let cut = |at: usize| self.bytes[..at].to_vec();
        let mid = self.mid_chunk();
        let in_part = readable(&cut(mid));
        let mut set = vec![
            broken("sound", self.bytes.clone(), all, "", false),
            broken("cut in mid chunk", cut(mid), in_part, "the file is cut off here", true),
            broken(
                "cut between chunks",
                cut(self.chunk(self.hit()).start),
                self.before_hit(),
                "cut off here",
                true,
            ),
        ];
        set.extend(self.in_chunks(all, hit, mid, in_part));
        set.extend(self.at_the_end(all));
        set.extend(self.in_the_index(all));
        set
    }

    fn in_chunks(&self, all: u64, hit: u64, mid: usize, in_part: u64) -> Vec<Damaged> {
        let chunk = self.chunk(self.hit());
        // Start and end time, size, then the CRC.
        let crc = chunk.start + 9 + 24;
        let broken = |name, bytes, usable, says, lost| Damaged { name, bytes, usable, says, lost };
        vec![
            broken(
                "bit flip in a zstd chunk",
                self.changed(|b| b[mid] ^= 0x10),
                all - hit,
                "chunk dropped",
                true,
            ),
            broken("bad CRC", self.changed(|b| b[crc] ^= 1), all - hit, "its CRC is", true),
            broken(
                "claims to inflate to 1 GiB",
                self.changed(|b| b[crc - 8..crc].copy_from_slice(&(1_u64 << 30).to_le_bytes())),
                all - hit,
                "chunk dropped",
                true,
            ),
            broken("zero-filled tail", self.changed(|b| b[mid..].fill(0)), in_part, "zero-filled", true),
            broken(
                "zeros over a chunk",
                self.changed(|b| b[chunk.clone()].fill(0)),
                all - hit,
                "no record can be read here",
                true,
            ),
            broken(
                "huge record length",
                self.changed(|b| b[chunk.start + 1..chunk.start + 9].fill(0xff)),
                all,
                "the length of this chunk is wrong",
                true,
            ),
        ]
    }

    fn at_the_end(&self, all: u64) -> Vec<Damaged> {
        let (footer, summary) = (self.footer(), self.summary_start());
        // No message is missing, but what would vouch for that is.
        let broken = |name, bytes, says| Damaged { name, bytes, usable: all, says, lost: true };
        vec![
            broken("no footer", self.bytes[..footer].to_vec(), "ends before its footer"),
            broken("no summary and no footer", self.bytes[..summary].to_vec(), "ends before its footer"),
            broken(
                "no end magic",
                self.bytes[..footer + FOOTER_BYTES].to_vec(),
                "magic bytes at the end are missing",
            ),
            broken(
                "trailing bytes",
                self.changed(|b| b.extend(b"appended by a careless tool")),
                "27 bytes follow",
            ),
            broken("bad summary CRC", self.changed(|b| b[summary + 12] ^= 1), "CRC of the summary disagrees"),
            broken(
                "bad summary offset",
                self.with_other_summary(|b| b[footer + 9..footer + 17].copy_from_slice(&7_u64.to_le_bytes())),
                "does not point to the summary",
            ),
        ]
    }

    /// Lies of the chunk index and the statistics; chunks are found by walking all the same, and the disagreement is told.
    fn in_the_index(&self, all: u64) -> Vec<Damaged> {
        let index = self.in_summary(0x08);
        let statistics = self.in_summary(0x0b);
        let put = |at: usize, value: u64| {
            self.with_other_summary(|b| b[at..at + 8].copy_from_slice(&value.to_le_bytes()))
        };
        let broken = |name, bytes, says| Damaged { name, bytes, usable: all, says, lost: true };
        let into_index = put(index + 16, self.chunk(0).end as u64);
        vec![
            broken("chunk index with a short length", put(index + 24, 3), "and 3 by the index"),
            broken("chunk index with a long length", put(index + 24, u64::MAX), "by the index"),
            broken("chunk index beyond the file", put(index + 16, 1 << 50), "does not list this chunk"),
            broken("chunk index into a message index", into_index, "does not list this chunk"),
            broken("statistics declare more", put(statistics, all + 5), "declare"),
            broken("statistics declare fewer", put(statistics, all - 5), "declare"),
        ]
    }
}

/// Messages that the MCAP project's own reader gets out of a cut file before it gives up.
fn readable(cut: &[u8]) -> u64 {
    let stream = mcap::MessageStream::new_with_options(cut, mcap::read::Options::IgnoreEndMagic.into());
    stream.expect("it begins as an MCAP file").map_while(Result::ok).count() as u64
}

/// How a recording of joint states and points is written.
#[derive(Clone, Copy)]
pub struct Style {
    pub chunks: bool,
    pub summary: bool,
    pub message_indexes: bool,
    pub compression: Option<mcap::Compression>,
}

impl Style {
    pub const PLAIN: Style = Style {
        chunks: true,
        summary: true,
        message_indexes: true,
        compression: Some(mcap::Compression::Zstd),
    };
}

/// A recording of `messages` joint states with seeded noise, in chunks of a few kilobytes. `schema`: whether the channel
/// has one.
pub fn recording(messages: u32, style: Style, schema: bool) -> Vec<u8> {
    use armcal_recording::ros2::{self, Header};
    let mut options = mcap::WriteOptions::new()
        .profile("ros2")
        .library("damaged")
        .compression(style.compression)
        .compression_threads(0)
        .use_chunks(style.chunks)
        .chunk_size(style.chunks.then_some(4096))
        .emit_message_indexes(style.message_indexes);
    if !style.summary {
        options = options.emit_summary_records(false).emit_summary_offsets(false).emit_statistics(false);
    }
    let mut writer = options.create(Cursor::new(Vec::new())).expect("a writer into memory");
    let about = &ros2::JOINT_STATE;
    let schema = match schema {
        true => {
            writer.add_schema(about.name, ros2::SCHEMA_ENCODING, about.text.as_bytes()).expect("a schema")
        }
        false => 0,
    };
    let channel_id =
        writer.add_channel(schema, "/joint_states", "cdr", &Default::default()).expect("a channel");
    let mut state = 1_u64;
    for sequence in 0..messages {
        let mut noise = || {
            // The LCG of Knuth's MMIX.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 * 1e-8
        };
        let log_time = 1_000_000_000 + u64::from(sequence) * 10_000_000;
        let header = Header { stamp_ns: log_time as i64, frame_id: "" };
        let data = ros2::joint_state(header, &["a", "b"], &[noise(), noise()], &[noise(), noise()], &[]);
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &data).expect("written to memory");
    }
    writer.finish().expect("finished in memory");
    writer.into_inner().into_inner()
}
