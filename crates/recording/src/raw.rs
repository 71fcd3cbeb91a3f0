//! Messages, attachments and metadata as they are in the file, for pass-through.

use crate::open::RecordingFile;
use crate::records::{Cursor, Message};
use crate::sweep::{
    Batch, BlockSurvey, block_records, blocks_for_channels, blocks_within_budget, for_each_batch,
    inflate_block,
};
use crate::{Recording, RecordingError};
use mcap::records::op;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::Arc;

/// A schema as the file has it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct RawSchema {
    /// Name, such as `sensor_msgs/msg/JointState`.
    pub name: Arc<str>,
    /// Encoding (`ros2msg`, `protobuf`, ...).
    pub encoding: Arc<str>,
    /// The schema itself.
    pub data: Vec<u8>,
}

/// A channel as the file has it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct RawChannel {
    /// Topic.
    pub topic: String,
    /// Schema; a channel may have none.
    pub schema: Option<Arc<RawSchema>>,
    /// Message encoding (`cdr`, `protobuf`, ...).
    pub message_encoding: Arc<str>,
    /// Free-form metadata, such as QoS.
    pub metadata: Vec<(String, String)>,
}

/// One message, its bytes borrowed.
#[derive(Debug, Clone, Copy)]
pub struct RawMessage<'a> {
    /// Its channel.
    pub channel: &'a RawChannel,
    /// Sequence number, 0 where the writer keeps none.
    pub sequence: u32,
    /// Log time [ns].
    pub log_ns: u64,
    /// Publish time [ns].
    pub publish_ns: u64,
    /// The encoded message.
    pub data: &'a [u8],
}

/// One attachment, its bytes borrowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Attachment<'a> {
    /// File name.
    pub name: &'a str,
    /// Media type.
    pub media_type: &'a str,
    /// Log time [ns].
    pub log_ns: u64,
    /// Creation time [ns].
    pub create_ns: u64,
    /// The attached bytes.
    pub data: &'a [u8],
}

impl<'a> Attachment<'a> {
    /// `None` when the record is malformed or its CRC is wrong.
    pub(crate) fn parse(body: &'a [u8]) -> Option<Attachment<'a>> {
        let mut c = Cursor::new(body);
        let (log_ns, create_ns) = (c.u64()?, c.u64()?);
        let (name, media_type) = (c.text()?, c.text()?);
        let length = c.u64()?;
        let data = c.take(length)?;
        let covered = body.len() - c.rest().len();
        let crc = c.u32()?;
        (crc == 0 || crc32fast::hash(&body[..covered]) == crc).then_some(Attachment {
            name,
            media_type,
            log_ns,
            create_ns,
            data,
        })
    }
}

/// Name and entries of a metadata record.
pub type RawMetadata = (String, BTreeMap<String, String>);

/// Takes messages in order; an error stops the pass.
pub type RawVisitor<'a> = dyn FnMut(RawMessage<'_>) -> Result<(), RecordingError> + Send + 'a;

/// Takes metadata records in order, by name and entries; an error stops the pass.
pub type MetadataVisitor<'a> = dyn FnMut(&str, &BTreeMap<String, String>) -> Result<(), RecordingError> + 'a;

impl Recording {
    /// Hands every sound message to `f`, file by file in time order, in file order within each. Messages whose
    /// channel definition is lost are not handed out. The first error stops the pass.
    pub fn for_each_raw(&self, f: &mut RawVisitor<'_>) -> Result<(), RecordingError> {
        self.for_each_raw_of(&|_| true, f)
    }

    /// The same for the messages of wanted channels. Of files read by ranges only the chunks with such are read.
    pub fn for_each_raw_of(
        &self,
        wanted: &dyn Fn(&RawChannel) -> bool,
        f: &mut RawVisitor<'_>,
    ) -> Result<(), RecordingError> {
        let ids = |file: &RecordingFile| -> BTreeSet<u16> {
            file.channels().filter(|(_, channel)| wanted(channel)).map(|(id, _)| id).collect()
        };
        let ids: Vec<BTreeSet<u16>> = self.files.iter().map(ids).collect();
        let blocks = blocks_for_channels(&self.files, &ids);
        self.pays(&blocks)?;
        let done = for_each_batch(&self.files, &blocks, |batch| self.hand_out(&batch, &ids, f));
        self.files.iter().try_for_each(RecordingFile::unshortened)?;
        done
    }

    fn hand_out(
        &self,
        batch: &Batch<'_>,
        ids: &[BTreeSet<u16>],
        f: &mut RawVisitor<'_>,
    ) -> Result<(), RecordingError> {
        // A few blocks ahead in parallel, so that memory stays at a few of them whatever the file's size.
        let ahead = 2 * rayon::current_num_threads();
        let (mut blocks_left, mut fetched_left) = (batch.blocks, &batch.fetched[..]);
        while !blocks_left.is_empty() {
            let count = blocks_within_budget(&self.files, blocks_left, ahead);
            let (blocks, fetched);
            (blocks, blocks_left) = blocks_left.split_at(count);
            (fetched, fetched_left) = fetched_left.split_at(count);
            let work = blocks.par_iter().zip(fetched);
            let inflated: Vec<(Vec<u8>, BlockSurvey)> =
                work.map(|(at, fetched)| inflate_block(&self.files, *at, fetched.as_ref())).collect();
            let mut surveys = Vec::with_capacity(inflated.len());
            for (bytes, (at, survey)) in inflated {
                let file = &self.files[at.file];
                let messages = block_records(&bytes).filter(|r| r.op == op::MESSAGE);
                for message in messages.filter_map(|r| Message::parse(r.body)) {
                    if !ids[at.file].contains(&message.channel_id) {
                        continue;
                    }
                    if let Some(channel) = file.layout.definitions.channel(message.channel_id) {
                        f(RawMessage {
                            channel,
                            sequence: message.sequence,
                            log_ns: message.log_ns,
                            publish_ns: message.publish_ns,
                            data: message.data,
                        })?;
                    }
                }
                file.bytes.passed(file.layout.blocks[at.block].range());
                surveys.push((at, survey));
            }
            self.remember(surveys);
        }
        Ok(())
    }

    /// Hands every sound attachment to `f`, one at a time in memory, in file order. The first error stops the pass.
    pub fn for_each_attachment(
        &self,
        f: &mut dyn FnMut(Attachment<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        for file in &self.files {
            for range in &file.layout.attachments {
                let body = file.bytes.read(range.clone())?;
                Attachment::parse(&body).map_or(Ok(()), &mut *f)?;
                file.bytes.passed(range.clone());
            }
        }
        Ok(())
    }

    /// Hands every metadata record that can be read to `f`, one at a time in memory, in file order. The first error stops
    /// the pass.
    pub fn for_each_metadata(&self, f: &mut MetadataVisitor<'_>) -> Result<(), RecordingError> {
        for file in &self.files {
            for range in &file.layout.metadata {
                let body = file.bytes.read(range.clone())?;
                parse_metadata(&body).map_or(Ok(()), |(name, entries)| f(&name, &entries))?;
                file.bytes.passed(range.clone());
            }
        }
        Ok(())
    }

    /// All of them, as (name, entries).
    pub fn metadata(&self) -> Result<Vec<RawMetadata>, RecordingError> {
        let mut all = Vec::new();
        self.for_each_metadata(&mut |name, entries| {
            all.push((name.to_owned(), entries.clone()));
            Ok(())
        })?;
        Ok(all)
    }

    /// Every channel of the recording, in file order, each once.
    pub fn channels(&self) -> Vec<Arc<RawChannel>> {
        let mut known: HashSet<&RawChannel> = HashSet::new();
        let all = self.files.iter().flat_map(|file| file.channels().map(|(_, channel)| channel));
        all.filter(|channel| known.insert(channel)).cloned().collect()
    }
}

/// Name and entries of a metadata record; `None` when it is malformed.
pub(crate) fn parse_metadata(body: &[u8]) -> Option<RawMetadata> {
    let mut fields = Cursor::new(body);
    Some((fields.string()?, fields.map(Cursor::string, Cursor::string)?))
}
