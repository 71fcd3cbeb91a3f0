//! The MCAP file that messages of another format are copied into.

use super::inflate::inflate_message;
use super::{Converted, Origin};
use crate::RecordingError;
use crate::bytes::budget::Allowance;
use crate::bytes::map::Map;
use crate::error::no_room;
use crate::structure::damage::{Damage, Faults};
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// Messages of a chunk [bytes]; a chunk is what one thread decodes.
const CHUNK_BYTES: u64 = 1 << 20;

/// An MCAP file without a name, under construction.
pub(super) struct Copy {
    path: PathBuf,
    writer: mcap::Writer<BufWriter<File>>,
    faults: Faults,
    notes: Vec<String>,
    /// Messages that could not be inflated, and why the first of them.
    broken: Option<(u64, String)>,
}

impl Copy {
    /// Of the recording at `path`, as its profile and library are to be called.
    pub fn create(path: &Path, [profile, library]: [&str; 2]) -> Result<Copy, RecordingError> {
        let file = tempfile::tempfile().map_err(no_room(path))?;
        // Nothing is gained by compressing or summing up what is read at once and then gone.
        let options = mcap::WriteOptions::new()
            .profile(profile)
            .library(library)
            .compression(None)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .calculate_chunk_crcs(false)
            .calculate_data_section_crc(false);
        let writer = options.create(BufWriter::new(file)).map_err(|e| copy_error(path, e))?;
        Ok(Copy { path: path.to_owned(), writer, faults: Faults::default(), notes: Vec::new(), broken: None })
    }

    /// The recording.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Notes what of the recording cannot be used, or disagrees with the rest.
    pub fn lost(&mut self, why: String) {
        self.lost_at(0, why);
    }

    /// The same of a place in it [byte].
    pub fn lost_at(&mut self, offset: usize, why: String) {
        self.faults.lost(offset, || why);
    }

    /// Notes what is worth knowing of the reading.
    pub fn notes(&mut self, all: Vec<String>) {
        self.notes.extend(all);
    }

    /// Adds a channel with its schema as (name, encoding, data), if it has one.
    pub fn add_channel(
        &mut self,
        topic: &str,
        schema: Option<(&str, &str, &[u8])>,
        encoding: &str,
    ) -> Result<u16, RecordingError> {
        let schema = match schema {
            Some((name, encoding, data)) => self.writer.add_schema(name, encoding, data),
            None => Ok(0),
        };
        let id = schema.and_then(|schema| self.writer.add_channel(schema, topic, encoding, &BTreeMap::new()));
        id.map_err(|e| copy_error(&self.path, e))
    }

    /// Adds a message, inflated if it is compressed by itself.
    pub fn put(
        &mut self,
        channel_id: u16,
        sequence: u32,
        time_ns: u64,
        data: &[u8],
        allowance: &Allowance,
    ) -> Result<(), RecordingError> {
        match inflate_message(data, allowance) {
            Ok(data) => self.put_plain(channel_id, sequence, time_ns, &data),
            Err(_) if allowance.is_exceeded() => Err(allowance.exceeded(&self.path)),
            Err(why) => {
                self.broken.get_or_insert((0, why)).0 += 1;
                Ok(())
            }
        }
    }

    /// Adds a message as it is.
    pub fn put_plain(
        &mut self,
        channel_id: u16,
        sequence: u32,
        time_ns: u64,
        data: &[u8],
    ) -> Result<(), RecordingError> {
        let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
        self.writer.write_to_known_channel(&header, data).map_err(|e| copy_error(&self.path, e))
    }

    /// The finished file, mapped.
    pub fn finish(mut self, log: String, origin: Origin) -> Result<Converted, RecordingError> {
        if let Some((messages, why)) = self.broken.take() {
            self.lost(format!("{messages} compressed messages cannot be used, the first because {why}"));
        }
        let Copy { path, mut writer, faults, notes, .. } = self;
        writer.finish().map_err(|e| copy_error(&path, e))?;
        let file = writer.into_inner().into_inner().map_err(|e| no_room(&path)(e.into_error()))?;
        let mut map = Map::of(&file).map_err(no_room(&path))?;
        // The identity is that of the original.
        map.hashed = None;
        let damage: Vec<Damage> = faults.in_words();
        Ok(Converted { map, damage, notes, log, origin })
    }
}

fn copy_error(path: &Path, error: mcap::McapError) -> RecordingError {
    match error {
        mcap::McapError::Io(source) => RecordingError::Copy { path: path.to_owned(), source },
        // What the system refuses is this to the library, with its reason behind it.
        mcap::McapError::Parse(refused) => no_room(path)(io::Error::other(refused.to_string())),
        other => RecordingError::Foreign { path: path.to_owned(), why: other.to_string() },
    }
}
