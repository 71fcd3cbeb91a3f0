//! Definitions for channels whose own is missing, cut off or in a language that is not read.
//!
//! A known type is read by the definition known here; JSON by the fields of the messages themselves.

use crate::RecordingError;
use crate::decode::{InferredTypes, json_problem, ros_problem};
use crate::foreign::{definition_of, ros1_definition_of};
use crate::recording::Recording;
use crate::recording::sweep::{block_records, for_each_batch, inflate_block};
use crate::structure::index::candidate_blocks;
use crate::structure::raw::{RawChannel, RawSchema, ReadBy};
use crate::structure::records::Message;
use crate::structure::survey::At;
use mcap::records::op;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// Blocks that JSON messages are looked for in, and messages of a channel in each: what is nowhere among them is not read.
const BLOCKS: usize = 16;
const MESSAGES: usize = 64;
/// Channels whose messages are looked into.
const MOST_CHANNELS: usize = 1000;

impl Recording {
    /// Gives channels that cannot be read by their own schema another definition, where there is one.
    ///
    /// # Errors
    /// Bytes that cannot be fetched, more passes than what they inflate to allows for.
    pub(crate) fn substitute_definitions(&mut self) -> Result<(), RecordingError> {
        for file in 0..self.files.len() {
            let inferred = self.infer_json_types(file)?;
            // Thousands of channels may share one schema.
            let mut known: HashMap<(*const RawSchema, Arc<str>), Option<Arc<ReadBy>>> = HashMap::new();
            self.files[file].layout.definitions.substitute(|id, channel| {
                if let Some(types) = inferred.get(&id) {
                    return read_by_fields(channel, types);
                }
                let schema = channel.schema.as_ref()?;
                let key = (Arc::as_ptr(schema), channel.message_encoding.clone());
                known.entry(key).or_insert_with(|| known_type(schema, &channel.message_encoding)).clone()
            });
        }
        Ok(())
    }

    /// The types of JSON messages that no schema describes, by their channels, from some of them throughout the file.
    fn infer_json_types(&self, file: usize) -> Result<BTreeMap<u16, InferredTypes>, RecordingError> {
        let mut known: HashMap<*const RawSchema, bool> = HashMap::new();
        let mut is_wanted = |channel: &RawChannel| match &channel.schema {
            Some(schema) if *channel.message_encoding == *"json" => {
                *known.entry(Arc::as_ptr(schema)).or_insert_with(|| json_why(channel).is_some())
            }
            _ => json_why(channel).is_some(),
        };
        let channels = self.files[file].channels().filter(|(_, channel)| is_wanted(channel));
        let wanted: BTreeSet<u16> = channels.map(|(id, _)| id).take(MOST_CHANNELS).collect();
        let holding = candidate_blocks(&self.files[file].layout.blocks, &wanted);
        let every = holding.len().div_ceil(BLOCKS).max(1);
        let blocks: Vec<At> = holding.into_iter().step_by(every).map(|block| At { file, block }).collect();
        let mut found: BTreeMap<u16, InferredTypes> = BTreeMap::new();
        self.pays(&blocks)?;
        for_each_batch(&self.files, &blocks, |batch| {
            for (at, fetched) in batch.blocks.iter().zip(&batch.fetched) {
                let (bytes, _) = inflate_block(&self.files, *at, fetched.as_ref());
                let mut left: BTreeMap<u16, usize> = wanted.iter().map(|id| (*id, MESSAGES)).collect();
                let messages = block_records(&bytes).filter(|record| record.op == op::MESSAGE);
                for message in messages.filter_map(|record| Message::parse(record.body)) {
                    let Some(left) = left.get_mut(&message.channel_id).filter(|left| **left > 0) else {
                        continue;
                    };
                    *left -= 1;
                    found.entry(message.channel_id).or_default().add(message.data);
                }
                let file = &self.files[at.file];
                file.bytes.passed(file.layout.blocks[at.block].range());
            }
            Ok(())
        })?;
        Ok(found)
    }
}

/// Why the schema of a channel says nothing of its JSON messages, if it does not.
fn json_why(channel: &RawChannel) -> Option<String> {
    if *channel.message_encoding != *"json" {
        return None;
    }
    match &channel.schema {
        None => Some("their channel has no schema".to_owned()),
        Some(schema) => json_problem(&schema.encoding, &schema.data)
            .map(|why| format!("the schema in the file cannot be used: {why}")),
    }
}

fn read_by_fields(channel: &RawChannel, types: &InferredTypes) -> Option<Arc<ReadBy>> {
    let why = json_why(channel)?;
    let own = channel.schema.as_ref().map(|schema| &schema.name).filter(|name| !name.is_empty());
    let name = own.cloned().unwrap_or_else(|| channel.topic.as_str().into());
    let schema = Arc::new(RawSchema { name, encoding: "jsonschema".into(), data: types.schema() });
    Some(Arc::new(ReadBy { schema, why }))
}

fn known_type(schema: &RawSchema, message_encoding: &str) -> Option<Arc<ReadBy>> {
    let (language, text) = match message_encoding {
        "cdr" => ("ros2msg", definition_of(&schema.name)?),
        "ros1" => ("ros1msg", ros1_definition_of(&schema.name)?),
        _ => return None,
    };
    let problem = ros_problem(&schema.name, [&schema.encoding, language], &schema.data, &text)?;
    let name = schema.name.replace("::", "/").into();
    let why = format!("the definition of {} in the file cannot be used: {problem}", schema.name);
    let schema = Arc::new(RawSchema { name, encoding: language.into(), data: text.into_bytes() });
    Some(Arc::new(ReadBy { schema, why }))
}
