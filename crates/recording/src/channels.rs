//! Channel and schema definitions of one file.

use crate::raw::{RawChannel, RawSchema};
use crate::records::{Cursor, RawRecord};
use mcap::records::op;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

/// Schemas and channels by id. The first definition of an id wins; MCAP forbids a second that differs.
#[derive(Debug, Default, Clone)]
pub(crate) struct Definitions {
    schemas: BTreeMap<u16, Arc<RawSchema>>,
    channels: BTreeMap<u16, Channel>,
}

/// A channel that names its schema by id; 0 for none. What it is called is shared with whoever resolves it.
#[derive(Debug, Clone)]
struct Channel {
    schema_id: u16,
    raw: Arc<RawChannel>,
}

impl PartialEq for Channel {
    fn eq(&self, other: &Channel) -> bool {
        let (own, others) = (&self.raw, &other.raw);
        self.schema_id == other.schema_id
            && own.topic == others.topic
            && own.message_encoding == others.message_encoding
            && own.metadata == others.metadata
    }
}

impl Definitions {
    /// Takes a schema or channel record in, and leaves any other alone.
    ///
    /// # Errors
    /// Why it is no definition, or none that agrees with the ones before.
    pub fn absorb(&mut self, record: &RawRecord<'_>) -> Result<(), &'static str> {
        self.check(record)?;
        match record.op {
            op::SCHEMA => {
                if let Some((id, schema)) = SchemaRecord::parse(record.body) {
                    self.schemas.entry(id).or_insert_with(|| Arc::new(schema.owned()));
                }
            }
            op::CHANNEL => {
                if let Some((id, channel)) = channel(record.body) {
                    self.channels.entry(id).or_insert(channel);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Whether a record is a definition as it should be, where it is one.
    ///
    /// # Errors
    /// Why not.
    pub fn check(&self, record: &RawRecord<'_>) -> Result<(), &'static str> {
        let agrees = match record.op {
            op::SCHEMA => {
                let (id, schema) = SchemaRecord::parse(record.body).ok_or("a schema that cannot be read")?;
                self.schemas.get(&id).is_none_or(|known| schema.is(known))
            }
            op::CHANNEL => {
                let (id, channel) = channel(record.body).ok_or("a channel that cannot be read")?;
                self.channels.get(&id).is_none_or(|known| *known == channel)
            }
            _ => true,
        };
        if agrees { Ok(()) } else { Err("another definition of the same number than the one before") }
    }

    /// Adds what `other` has and `self` has not; says whether what both have is the same.
    pub fn merge(&mut self, other: Definitions) -> bool {
        let mut same = true;
        for (id, schema) in other.schemas {
            same &= *self.schemas.entry(id).or_insert_with(|| schema.clone()) == schema;
        }
        for (id, channel) in other.channels {
            match self.channels.entry(id) {
                Entry::Occupied(known) => same &= *known.get() == channel,
                Entry::Vacant(free) => _ = free.insert(channel),
            }
        }
        same
    }

    /// Whether a channel has this id.
    pub fn contains(&self, id: u16) -> bool {
        self.channels.contains_key(&id)
    }

    /// Every channel with its schema, by id.
    pub fn resolve(&self) -> BTreeMap<u16, Arc<RawChannel>> {
        self.clone().shared()
    }

    /// The same, where they are kept: nothing is there twice.
    pub fn shared(&mut self) -> BTreeMap<u16, Arc<RawChannel>> {
        let schemas = &self.schemas;
        let with_schema = |(id, channel): (&u16, &mut Channel)| {
            let schema = schemas.get(&channel.schema_id).cloned();
            if channel.raw.schema != schema {
                Arc::make_mut(&mut channel.raw).schema = schema;
            }
            (*id, channel.raw.clone())
        };
        self.channels.iter_mut().map(with_schema).collect()
    }
}

/// A schema record, its parts borrowed.
struct SchemaRecord<'a> {
    name: &'a str,
    encoding: &'a str,
    data: &'a [u8],
}

impl<'a> SchemaRecord<'a> {
    /// Its number, which is not 0, and the rest.
    fn parse(body: &'a [u8]) -> Option<(u16, SchemaRecord<'a>)> {
        let mut fields = Cursor::new(body);
        let id = fields.u16().filter(|id| *id != 0)?;
        Some((id, SchemaRecord { name: fields.text()?, encoding: fields.text()?, data: fields.bytes()? }))
    }

    fn is(&self, known: &RawSchema) -> bool {
        self.name == known.name && self.encoding == known.encoding && self.data == known.data
    }

    fn owned(&self) -> RawSchema {
        let (name, encoding) = (self.name.to_owned(), self.encoding.to_owned());
        RawSchema { name, encoding, data: self.data.to_vec() }
    }
}

fn channel(body: &[u8]) -> Option<(u16, Channel)> {
    let mut fields = Cursor::new(body);
    let (id, schema_id) = (fields.u16()?, fields.u16()?);
    let (topic, message_encoding) = (fields.string()?, fields.string()?);
    let metadata = fields.map(Cursor::string, Cursor::string)?;
    Some((
        id,
        Channel { schema_id, raw: Arc::new(RawChannel { topic, schema: None, message_encoding, metadata }) },
    ))
}
