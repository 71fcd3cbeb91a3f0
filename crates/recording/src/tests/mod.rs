//! Recordings built in memory, sound and damaged, and what the reader makes of them.

mod conformance;
mod damage;
mod fields;
mod foreign;
mod many;
mod memory;
mod mutation;
mod output;
mod ranges;
mod streams;
mod substitute;
mod transforms;

use crate::{Access, Recording};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::PathBuf;

/// Messages of one channel to write.
pub(crate) struct Track {
    pub topic: &'static str,
    /// Of empty texts none.
    pub schema: (&'static str, &'static str, &'static [u8]),
    pub encoding: &'static str,
    /// Log time [ns], publish time [ns], data.
    pub messages: Vec<(u64, u64, Vec<u8>)>,
}

/// How the file is laid out.
#[derive(Debug, Clone)]
pub(crate) struct Style {
    pub chunk_bytes: Option<u64>,
    pub compression: Option<Compression>,
    pub summary: bool,
    pub crc: bool,
    /// Channels that are added first, so that ids differ from file to file.
    pub fillers: usize,
}

impl Default for Style {
    fn default() -> Style {
        Style {
            chunk_bytes: Some(8192),
            compression: Some(Compression::Zstd),
            summary: true,
            crc: true,
            fillers: 0,
        }
    }
}

/// The bytes of an MCAP file with the messages of all tracks merged in log-time order.
pub(crate) fn mcap_bytes(tracks: &[Track], style: &Style) -> Vec<u8> {
    let mut options = WriteOptions::new()
        .profile("ros2")
        .library("fixture")
        .compression(style.compression)
        .compression_threads(0)
        .use_chunks(style.chunk_bytes.is_some())
        .chunk_size(style.chunk_bytes)
        .calculate_chunk_crcs(style.crc);
    if !style.summary {
        options = options
            .emit_summary_records(false)
            .emit_summary_offsets(false)
            .emit_statistics(false)
            .emit_message_indexes(false);
    }
    let mut writer = options.create(Cursor::new(Vec::new())).expect("a writer into memory");
    for filler in 0..style.fillers {
        add(&mut writer, &format!("/filler{filler}"), ("filler/Filler", "ros2msg", b"bool x"), "cdr");
    }
    let mut merged: Vec<(u64, u16, u64, &[u8])> = Vec::new();
    for track in tracks {
        let id = add(&mut writer, track.topic, track.schema, track.encoding);
        merged
            .extend(track.messages.iter().map(|(log, publish, data)| (*log, id, *publish, data.as_slice())));
    }
    merged.sort_by_key(|(log, ..)| *log);
    for (sequence, (log_time, channel_id, publish_time, data)) in merged.into_iter().enumerate() {
        let header = MessageHeader { channel_id, sequence: sequence as u32, log_time, publish_time };
        writer.write_to_known_channel(&header, data).expect("written to memory");
    }
    writer.finish().expect("finished in memory");
    writer.into_inner().into_inner()
}

fn add(
    writer: &mut Writer<Cursor<Vec<u8>>>,
    topic: &str,
    schema: (&str, &str, &[u8]),
    encoding: &str,
) -> u16 {
    let schema = match schema {
        ("", "", b"") => 0,
        (name, encoding, data) => writer.add_schema(name, encoding, data).expect("a schema"),
    };
    writer.add_channel(schema, topic, encoding, &BTreeMap::new()).expect("a channel")
}

/// A folder with files, and the recording they make up.
pub(crate) struct OnDisk {
    folder: tempfile::TempDir,
    paths: Vec<PathBuf>,
}

impl OnDisk {
    pub fn new(files: &[Vec<u8>]) -> OnDisk {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let paths: Vec<PathBuf> =
            (0..files.len()).map(|i| folder.path().join(format!("part_{i}.mcap"))).collect();
        for (path, bytes) in paths.iter().zip(files) {
            std::fs::write(path, bytes).expect("a writable folder");
        }
        OnDisk { folder, paths }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn open(&self) -> Result<Recording, crate::RecordingError> {
        self.open_with(Access::Mapped)
    }

    pub fn open_with(&self, access: Access) -> Result<Recording, crate::RecordingError> {
        Recording::open_with(&self.paths, access)
    }
}

/// Opens bytes as a recording of one file.
pub(crate) fn open(bytes: &[u8]) -> Recording {
    OnDisk::new(&[bytes.to_vec()]).open().expect("an MCAP file")
}

/// Messages of every channel, counted over the raw pass.
pub(crate) fn raw_count(recording: &Recording) -> u64 {
    let mut count = 0;
    let pass = recording.for_each_raw(&mut |_| {
        count += 1;
        Ok(())
    });
    pass.expect("nothing stops the pass");
    count
}

/// Name, media type, log and creation time [ns] and data of an attachment.
pub(crate) type OwnedAttachment = (String, String, u64, u64, Vec<u8>);

/// Every sound attachment.
pub(crate) fn attachments(recording: &Recording) -> Vec<OwnedAttachment> {
    let mut all = Vec::new();
    let pass = recording.for_each_attachment(&mut |a| {
        all.push((a.name.to_owned(), a.media_type.to_owned(), a.log_ns, a.create_ns, a.data.to_vec()));
        Ok(())
    });
    pass.expect("nothing stops the pass");
    all
}

/// A message's topic, sequence, log and publish time [ns] and data.
pub(crate) type OwnedMessage = (String, u32, u64, u64, Vec<u8>);

/// Every sound message of a topic.
pub(crate) fn messages_of(recording: &Recording, topic: &str) -> Vec<OwnedMessage> {
    let mut all = Vec::new();
    let pass = recording.for_each_raw_of(&|c| c.topic == topic, &mut |m| {
        all.push((m.channel.topic.clone(), m.sequence, m.log_ns, m.publish_ns, m.data.to_vec()));
        Ok(())
    });
    pass.expect("nothing stops the pass");
    all
}

/// A track of `n` opaque messages of 40 bytes, 10 ms apart, hard to compress.
pub(crate) fn opaque(topic: &'static str, n: u64) -> Track {
    let data =
        |i: u64| (0..5).flat_map(|k| (i * 5 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15).to_le_bytes()).collect();
    Track {
        topic,
        schema: ("test/Opaque", "ros2msg", b"byte[40] x"),
        encoding: "cdr",
        messages: (0..n)
            .map(|i| (1_000_000_000 + i * 10_000_000, 1_000_000_000 + i * 10_000_000, data(i)))
            .collect(),
    }
}
