//! Channel and schema definitions of one file.

use crate::bytes::budget::most_definition_bytes;
use crate::structure::raw::{RawChannel, RawSchema, ReadBy};
use crate::structure::records::{Cursor, RawRecord};
use mcap::records::op;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;

/// Metadata of a channel whose definition did not come with the file's messages: says where it is from.
pub(crate) const DEFINITION_FROM: &str = "armcal.definition";

/// What an entry of the metadata of a channel takes besides its text [bytes].
const ENTRY_BYTES: usize = 112;
/// Longer metadata of a channel is none [bytes].
const MOST_METADATA_BYTES: usize = 1 << 20;

/// Why a definition is not kept.
const TOO_MANY: &str =
    "its schemas and channels take more than they may (32 MiB, or ARMCAL_INFLATE_MIB); this one is not used";
/// Why two definitions cannot both be right.
const OTHER: &str = "another definition of the same number than the one before";

/// Schemas and channels by id. The first definition of an id wins; MCAP forbids a second that differs.
#[derive(Debug, Default, Clone)]
pub(crate) struct Definitions {
    schemas: BTreeMap<u16, Arc<RawSchema>>,
    channels: BTreeMap<u16, Channel>,
    /// What their texts take [bytes].
    bytes: usize,
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
        // Where a definition is from is noted here, and not in the record that this may be compared with.
        let metadata = |channel: &RawChannel| {
            channel.metadata.iter().filter(|(key, _)| key != DEFINITION_FROM).cloned().collect::<Vec<_>>()
        };
        self.schema_id == other.schema_id
            && own.topic == others.topic
            && own.message_encoding == others.message_encoding
            && metadata(own) == metadata(others)
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
                if let Some((id, schema)) = SchemaRecord::parse(record.body)
                    && !self.schemas.contains_key(&id)
                {
                    self.bytes = add_within_limit(self.bytes, record.body.len())?;
                    let before = self.schemas.last_key_value().map(|(_, schema)| &schema.encoding);
                    self.schemas.insert(id, Arc::new(schema.owned(before)));
                }
            }
            op::CHANNEL => {
                if let Some((id, mut channel)) = parse_channel(record.body)
                    && !self.channels.contains_key(&id)
                {
                    self.bytes = add_within_limit(self.bytes, channel.bytes())?;
                    // Most channels are encoded alike, and say so in one text.
                    if let Some((_, before)) = self.channels.last_key_value()
                        && before.raw.message_encoding == channel.raw.message_encoding
                    {
                        Arc::make_mut(&mut channel.raw).message_encoding =
                            before.raw.message_encoding.clone();
                    }
                    self.channels.insert(id, channel);
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
                let (id, channel) = parse_channel(record.body).ok_or("a channel that cannot be read")?;
                self.channels.get(&id).is_none_or(|known| *known == channel)
            }
            _ => true,
        };
        if agrees { Ok(()) } else { Err(OTHER) }
    }

    /// None, with as much room left as there is beside these.
    pub fn beside(&self) -> Definitions {
        Definitions { bytes: self.bytes, ..Definitions::default() }
    }

    /// Whether there is a definition of its kind and number.
    pub fn has(&self, record: &RawRecord<'_>) -> bool {
        let number = Cursor::new(record.body).u16();
        number.is_some_and(|id| match record.op {
            op::SCHEMA => self.schemas.contains_key(&id),
            _ => self.channels.contains_key(&id),
        })
    }

    /// Adds what `other` has and `self` has not.
    ///
    /// # Errors
    /// Why not all of it could be, or what both have is not the same.
    pub fn merge(&mut self, other: Definitions) -> Result<(), &'static str> {
        let mut said = Ok(());
        for (id, schema) in other.schemas {
            said = said.and(match self.schemas.entry(id) {
                Entry::Occupied(known) if *known.get() != schema => Err(OTHER),
                Entry::Occupied(_) => Ok(()),
                Entry::Vacant(free) => add_within_limit(self.bytes, schema.bytes()).map(|bytes| {
                    self.bytes = bytes;
                    free.insert(schema);
                }),
            });
        }
        for (id, channel) in other.channels {
            said = said.and(match self.channels.entry(id) {
                Entry::Occupied(known) if *known.get() != channel => Err(OTHER),
                Entry::Occupied(_) => Ok(()),
                Entry::Vacant(free) => add_within_limit(self.bytes, channel.bytes()).map(|bytes| {
                    self.bytes = bytes;
                    free.insert(channel);
                }),
            });
        }
        said
    }

    /// The channel of this id.
    pub fn channel(&self, id: u16) -> Option<&Arc<RawChannel>> {
        self.channels.get(&id).map(|channel| &channel.raw)
    }

    /// Every channel, by id.
    pub fn channels(&self) -> impl Iterator<Item = (u16, &Arc<RawChannel>)> {
        self.channels.iter().map(|(id, channel)| (*id, &channel.raw))
    }

    /// Gives every channel its schema, once all are known.
    pub fn resolve(&mut self) {
        for channel in self.channels.values_mut() {
            let schema = self.schemas.get(&channel.schema_id);
            if channel.raw.schema.as_ref() != schema {
                Arc::make_mut(&mut channel.raw).schema = schema.cloned();
            }
        }
    }

    /// Says what resolved channels are read by, where it is not their own schema.
    pub fn substitute(&mut self, mut read_by: impl FnMut(u16, &RawChannel) -> Option<Arc<ReadBy>>) {
        for (id, channel) in &mut self.channels {
            if let Some(found) = read_by(*id, &channel.raw) {
                Arc::make_mut(&mut channel.raw).read_by = Some(found);
            }
        }
    }

    /// Adds an entry to the metadata of resolved channels.
    pub fn annotate(&mut self, entry: impl Fn(&RawChannel) -> Option<(String, String)>) {
        for channel in self.channels.values_mut() {
            if let Some(entry) = entry(&channel.raw) {
                Arc::make_mut(&mut channel.raw).metadata.push(entry);
            }
        }
    }
}

/// What is taken with so many bytes more.
fn add_within_limit(taken: usize, more: usize) -> Result<usize, &'static str> {
    Some(taken + more).filter(|bytes| *bytes <= most_definition_bytes()).ok_or(TOO_MANY)
}

impl RawSchema {
    fn bytes(&self) -> usize {
        self.name.len() + self.encoding.len() + self.data.len()
    }
}

impl Channel {
    fn bytes(&self) -> usize {
        let RawChannel { topic, message_encoding, metadata, .. } = &*self.raw;
        let entries = metadata.iter().map(|(key, value)| key.len() + value.len() + ENTRY_BYTES);
        topic.len() + message_encoding.len() + entries.sum::<usize>()
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
        *self.name == *known.name && *self.encoding == *known.encoding && self.data == known.data
    }

    /// The same to keep; `before` is the encoding of another one, which most have in common.
    fn owned(&self, before: Option<&Arc<str>>) -> RawSchema {
        let shared = before.filter(|before| ***before == *self.encoding).cloned();
        let encoding = shared.unwrap_or_else(|| self.encoding.into());
        RawSchema { name: self.name.into(), encoding, data: self.data.to_vec() }
    }
}

fn parse_channel(body: &[u8]) -> Option<(u16, Channel)> {
    let mut fields = Cursor::new(body);
    let (id, schema_id) = (fields.u16()?, fields.u16()?);
    let (topic, message_encoding) = (fields.string()?, fields.text()?.into());
    if fields.rest().len() > 4 + MOST_METADATA_BYTES {
        return None;
    }
    let metadata = fields.map(Cursor::string, Cursor::string)?.into_iter().collect();
    let raw = RawChannel { topic, schema: None, message_encoding, metadata, read_by: None };
    Some((id, Channel { schema_id, raw: Arc::new(raw) }))
}
