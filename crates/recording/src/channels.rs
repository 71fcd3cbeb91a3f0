//! Channel and schema definitions of one file.

use crate::raw::{RawChannel, RawSchema};
use crate::records::{Cursor, RawRecord};
use mcap::records::op;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Schemas and channels by id. The first definition of an id wins; MCAP forbids a second that differs.
#[derive(Debug, Default, Clone)]
pub(crate) struct Definitions {
    schemas: BTreeMap<u16, Arc<RawSchema>>,
    channels: BTreeMap<u16, Channel>,
}

/// A channel that names its schema by id; 0 for none.
#[derive(Debug, Clone)]
struct Channel {
    schema_id: u16,
    topic: String,
    message_encoding: String,
    metadata: BTreeMap<String, String>,
}

impl Definitions {
    /// Takes a schema or channel record in; any other, and one that does not parse, is left alone.
    pub fn absorb(&mut self, record: &RawRecord<'_>) {
        let fields = Cursor::new(record.body);
        match record.op {
            op::SCHEMA => {
                if let Some((id, schema)) = schema(fields).filter(|(id, _)| *id != 0) {
                    self.schemas.entry(id).or_insert_with(|| Arc::new(schema));
                }
            }
            op::CHANNEL => {
                if let Some((id, channel)) = channel(fields) {
                    self.channels.entry(id).or_insert(channel);
                }
            }
            _ => {}
        }
    }

    /// Adds what `other` has and `self` has not.
    pub fn merge(&mut self, other: Definitions) {
        for (id, schema) in other.schemas {
            self.schemas.entry(id).or_insert(schema);
        }
        for (id, channel) in other.channels {
            self.channels.entry(id).or_insert(channel);
        }
    }

    /// Whether a channel has this id.
    pub fn contains(&self, id: u16) -> bool {
        self.channels.contains_key(&id)
    }

    /// Every channel with its schema, by id.
    pub fn resolve(&self) -> BTreeMap<u16, Arc<RawChannel>> {
        let with_schema = |c: &Channel| RawChannel {
            topic: c.topic.clone(),
            schema: self.schemas.get(&c.schema_id).cloned(),
            message_encoding: c.message_encoding.clone(),
            metadata: c.metadata.clone(),
        };
        self.channels.iter().map(|(id, c)| (*id, Arc::new(with_schema(c)))).collect()
    }
}

fn schema(mut fields: Cursor<'_>) -> Option<(u16, RawSchema)> {
    let id = fields.u16()?;
    let (name, encoding) = (fields.string()?, fields.string()?);
    Some((id, RawSchema { name, encoding, data: fields.bytes()?.to_vec() }))
}

fn channel(mut fields: Cursor<'_>) -> Option<(u16, Channel)> {
    let (id, schema_id) = (fields.u16()?, fields.u16()?);
    let (topic, message_encoding) = (fields.string()?, fields.string()?);
    let metadata = fields.map(Cursor::string, Cursor::string)?;
    Some((id, Channel { schema_id, topic, message_encoding, metadata }))
}
