//! Messages, attachments and metadata as they are in the file, for pass-through.

use crate::records::{Cursor, Message};
use crate::sweep::{Step, blocks, inflate};
use crate::{Recording, RecordingError};
use mcap::records::op;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A schema as the file has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawSchema {
    /// Name, such as `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Encoding (`ros2msg`, `protobuf`, ...).
    pub encoding: String,
    /// The schema itself.
    pub data: Vec<u8>,
}

/// A channel as the file has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawChannel {
    /// Topic.
    pub topic: String,
    /// Schema; a channel may have none.
    pub schema: Option<Arc<RawSchema>>,
    /// Message encoding (`cdr`, `protobuf`, ...).
    pub message_encoding: String,
    /// Free-form metadata, such as QoS.
    pub metadata: BTreeMap<String, String>,
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

impl Recording {
    /// Hands every sound message to `f`, file by file in time order, in file order within each. Messages whose
    /// channel definition is lost are not handed out. The first error stops the pass.
    pub fn for_each_raw(
        &self,
        f: &mut dyn FnMut(RawMessage<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        // A few chunks ahead in parallel, so that memory stays at a few chunks whatever the file's size.
        let ahead = 2 * rayon::current_num_threads();
        for batch in blocks(&self.files).chunks(ahead) {
            let inflated: Vec<Step> = batch.par_iter().map(|at| inflate(&self.files, *at)).collect();
            for (at, step) in batch.iter().zip(&inflated) {
                let file = &self.files[at.file];
                for record in step.records(&file.map) {
                    let Some(message) =
                        (record.op == op::MESSAGE).then(|| Message::parse(record.body)).flatten()
                    else {
                        continue;
                    };
                    if let Some(channel) = file.channels.get(&message.channel_id) {
                        f(RawMessage {
                            channel,
                            sequence: message.sequence,
                            log_ns: message.log_ns,
                            publish_ns: message.publish_ns,
                            data: message.data,
                        })?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Every sound attachment, in file order.
    pub fn attachments(&self) -> Vec<Attachment<'_>> {
        let bodies = self.files.iter().flat_map(|f| f.layout.attachments.iter().map(|r| &f.map[r.clone()]));
        bodies.filter_map(Attachment::parse).collect()
    }

    /// Every metadata record that can be read, as (name, entries), in file order.
    pub fn metadata(&self) -> Vec<(String, BTreeMap<String, String>)> {
        let bodies = self.files.iter().flat_map(|f| f.layout.metadata.iter().map(|r| &f.map[r.clone()]));
        bodies.filter_map(parse_metadata).collect()
    }
}

/// Name and entries of a metadata record; `None` when it is malformed.
pub(crate) fn parse_metadata(body: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut fields = Cursor::new(body);
    Some((fields.string()?, fields.map(Cursor::string, Cursor::string)?))
}
