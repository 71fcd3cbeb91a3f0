//! Messages, attachments and metadata as they are in the file, for pass-through.

use crate::RecordingError;
use crate::structure::records::Cursor;
use std::collections::BTreeMap;
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

/// A definition in the place of a channel's own.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ReadBy {
    /// The definition.
    pub schema: Arc<RawSchema>,
    /// Why the channel's own is not used.
    pub why: String,
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
    /// What its messages are read by where its schema says nothing of them.
    pub read_by: Option<Arc<ReadBy>>,
}

impl RawChannel {
    /// What its messages are read by: its schema, or what stands in its place.
    pub fn definition(&self) -> Option<&Arc<RawSchema>> {
        self.read_by.as_ref().map(|read_by| &read_by.schema).or(self.schema.as_ref())
    }

    /// What is to be said where that is not its schema.
    pub fn substitution(&self) -> Option<String> {
        let ReadBy { schema, why } = &**self.read_by.as_ref()?;
        let by = match &*schema.encoding {
            "jsonschema" => "the fields that they have themselves",
            _ => "the definition that armcal knows of this type, and those of another length are refused",
        };
        Some(format!("messages of {} are read by {by}: {why}", self.topic))
    }
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

/// Name and entries of a metadata record; `None` when it is malformed.
pub(crate) fn parse_metadata(body: &[u8]) -> Option<RawMetadata> {
    let mut fields = Cursor::new(body);
    Some((fields.string()?, fields.map(Cursor::string, Cursor::string)?))
}
