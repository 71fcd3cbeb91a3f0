//! Writing MCAP: same messages in the same order, same bytes, and all of them or no file.

use crate::RecordingError;
use crate::write::atomic::AtomicFile;
use mcap::records::{MessageHeader, Metadata};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::error::Error as _;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Uncompressed bytes in a chunk.
const CHUNK_BYTES: u64 = 1 << 20;
/// Of zstd: its own choice, and its fastest.
const USUAL_LEVEL: u32 = 3;
const QUICK_LEVEL: u32 = 1;
/// Written to the header, so that files do not change with the version of the mcap crate.
const LIBRARY: &str = concat!("armcal/", env!("CARGO_PKG_VERSION"));

/// An MCAP file under construction. Only [`McapOutput::finish`] makes it appear; dropped before, it leaves nothing.
pub struct McapOutput {
    writer: mcap::Writer<BufWriter<AtomicFile>>,
    path: PathBuf,
}

impl McapOutput {
    /// Starts an MCAP file with the given profile (`ros2`, or empty).
    pub fn create(path: &Path, profile: &str) -> Result<McapOutput, RecordingError> {
        McapOutput::at_level(path, profile, USUAL_LEVEL)
    }

    /// The same for a file of gigabytes that is made again from another one whenever somebody asks. Poses and joints are noise to
    /// a compressor, which finds as much in them in half the time.
    pub fn quickly(path: &Path, profile: &str) -> Result<McapOutput, RecordingError> {
        McapOutput::at_level(path, profile, QUICK_LEVEL)
    }

    fn at_level(path: &Path, profile: &str, level: u32) -> Result<McapOutput, RecordingError> {
        let file = AtomicFile::create(path)?;
        // No compression threads: the bytes of the output must not depend on the machine.
        let options = mcap::WriteOptions::new()
            .profile(profile)
            .library(LIBRARY)
            .compression(Some(mcap::Compression::Zstd))
            .compression_level(level)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES));
        match options.create(BufWriter::new(file)) {
            Ok(writer) => Ok(McapOutput { writer, path: path.to_owned() }),
            Err(e) => Err(write_error(path, &e)),
        }
    }

    /// Adds a channel with its schema as (name, encoding, data), if it has one. The same channel again gives the
    /// same id.
    pub fn add_channel(
        &mut self,
        topic: &str,
        schema: Option<(&str, &str, &[u8])>,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16, RecordingError> {
        let schema = match schema {
            Some((name, encoding, data)) => self.writer.add_schema(name, encoding, data),
            None => Ok(0),
        };
        let id = schema.and_then(|schema| self.writer.add_channel(schema, topic, message_encoding, metadata));
        id.map_err(|e| self.failed(&e))
    }

    /// Writes one message; times in nanoseconds.
    pub fn put(
        &mut self,
        channel_id: u16,
        sequence: u32,
        log_ns: u64,
        publish_ns: u64,
        data: &[u8],
    ) -> Result<(), RecordingError> {
        let header = MessageHeader { channel_id, sequence, log_time: log_ns, publish_time: publish_ns };
        self.writer.write_to_known_channel(&header, data).map_err(|e| self.failed(&e))
    }

    /// Attaches a file.
    pub fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        log_ns: u64,
        create_ns: u64,
        data: &[u8],
    ) -> Result<(), RecordingError> {
        let attachment = mcap::Attachment {
            log_time: log_ns,
            create_time: create_ns,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(data),
        };
        self.writer.attach(&attachment).map_err(|e| self.failed(&e))
    }

    /// Writes a metadata record.
    pub fn metadata(&mut self, name: &str, entries: &BTreeMap<String, String>) -> Result<(), RecordingError> {
        let metadata = Metadata { name: name.to_owned(), metadata: entries.clone() };
        self.writer.write_metadata(&metadata).map_err(|e| self.failed(&e))
    }

    /// Completes the file, syncs it and gives it its name.
    pub fn finish(self) -> Result<(), RecordingError> {
        self.stage()?.commit()
    }

    /// Completes the file, which has no name yet.
    pub fn stage(mut self) -> Result<AtomicFile, RecordingError> {
        self.writer.finish().map_err(|e| self.failed(&e))?;
        let path = self.path;
        let buffered = self.writer.into_inner();
        buffered.into_inner().map_err(|e| RecordingError::Write { path, why: e.error().to_string() })
    }

    fn failed(&self, error: &mcap::McapError) -> RecordingError {
        write_error(&self.path, error)
    }
}

/// What the system refused is the cause of a refusal to write: a full disk is "Record parse failed" to the library.
fn write_error(path: &Path, error: &mcap::McapError) -> RecordingError {
    let why = error.source().map_or_else(|| error.to_string(), ToString::to_string);
    RecordingError::Write { path: path.to_owned(), why }
}
