//! Channel and schema definitions of one file.

use crate::raw::{RawChannel, RawSchema};
use crate::records::RawRecord;
use mcap::records::{Channel, Record, op};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Schemas and channels by id. The first definition of an id wins; MCAP forbids a second that differs.
#[derive(Debug, Default, Clone)]
pub(crate) struct Definitions {
    schemas: BTreeMap<u16, Arc<RawSchema>>,
    channels: BTreeMap<u16, Channel>,
}

impl Definitions {
    /// Takes a schema or channel record in; any other, and one that does not parse, is left alone.
    pub fn absorb(&mut self, record: &RawRecord<'_>) {
        if !matches!(record.op, op::SCHEMA | op::CHANNEL) {
            return;
        }
        match mcap::parse_record(record.op, record.body) {
            Ok(Record::Schema { header, data }) if header.id != 0 => {
                let schema =
                    RawSchema { name: header.name, encoding: header.encoding, data: data.into_owned() };
                self.schemas.entry(header.id).or_insert_with(|| Arc::new(schema));
            }
            Ok(Record::Channel(channel)) => {
                self.channels.entry(channel.id).or_insert(channel);
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
