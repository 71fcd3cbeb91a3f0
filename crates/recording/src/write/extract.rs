//! Thin recordings: only the wanted channels, for work that reads the same recordings again and again.
//!
//! Topics share chunks in most files, so that even with an index nearly all of a file must be read to get at the joints.
//! Written once without camera images, the rest is small.

use crate::write::mark::EXTRACT_METADATA;
use crate::write::output::McapOutput;
use crate::{RawChannel, Recording, RecordingError, Source, error, may_write};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::Arc;

/// What goes into a thin recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extract<'a> {
    /// Topics, where `*` stands for any characters, `?` for one and `[ab]` for one of these. Each must match a channel.
    pub topics: &'a [String],
    /// Whether attachments are kept.
    pub attachments: bool,
}

/// What went into a thin recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extracted {
    /// Topics and their messages, in the order of the channels.
    pub topics: Vec<(String, u64)>,
    /// Attachments kept.
    pub attachments: u64,
}

/// Writes the wanted channels of a recording to `out`: messages with their bytes, times, sequence numbers and order
/// untouched, schemas, channels (also those without a message) and metadata; zstd chunks of 1 MiB with an index. A
/// metadata record [`EXTRACT_METADATA`] names the files it was taken from, their identities and the topics. The same
/// input gives the same bytes. Memory holds a few chunks and, with attachments, the largest of these.
///
/// # Errors
/// A topic that matches no channel, an output that is one of the inputs, is not armcal's or cannot be written, an input that cannot be
/// read on. Damage is no error; it is in [`Recording::report`] afterwards.
pub fn extract(recording: &Recording, wanted: &Extract<'_>, out: &Path) -> Result<Extracted, RecordingError> {
    may_write(out)?;
    let channels = matching_channels(recording.channels(), wanted.topics)?;
    let mut output = McapOutput::create(out, common_profile(recording))?;
    let mut kept = Kept::of(&channels, &mut output)?;
    let topics: HashSet<&str> = channels.iter().map(|c| c.topic.as_str()).collect();
    let by_topic = |channel: &RawChannel| topics.contains(channel.topic.as_str());
    recording.for_each_raw_of(&by_topic, &mut |message| {
        let id = kept.count(message.channel, &mut output)?;
        output.put(id, message.sequence, message.log_ns, message.publish_ns, message.data)
    })?;
    let mut attachments = 0;
    if wanted.attachments {
        recording.for_each_attachment(&mut |a| {
            attachments += 1;
            output.attach(a.name, a.media_type, a.log_ns, a.create_ns, a.data)
        })?;
    }
    recording.for_each_metadata(&mut |name, entries| output.metadata(name, entries))?;
    output.metadata(EXTRACT_METADATA, &source_metadata(recording, &kept)?)?;
    output.finish()?;
    Ok(Extracted { topics: kept.topics, attachments })
}

/// The channels of the output, and how many messages went into each topic.
struct Kept {
    topics: Vec<(String, u64)>,
    /// Place of each topic in `topics`.
    places: BTreeMap<String, usize>,
    /// Id in the output and place in `topics`, by the address of the definition: comparing schemas with every message
    /// would take longer than writing it.
    known: BTreeMap<usize, (u16, usize)>,
}

impl Kept {
    /// Defines all channels first, so that those without messages are there too.
    fn of(channels: &[Arc<RawChannel>], output: &mut McapOutput) -> Result<Kept, RecordingError> {
        let mut kept = Kept { topics: Vec::new(), places: BTreeMap::new(), known: BTreeMap::new() };
        channels.iter().try_for_each(|channel| kept.place(channel, output).map(drop))?;
        Ok(kept)
    }

    /// Id of a message's channel in the output.
    fn count(&mut self, channel: &RawChannel, output: &mut McapOutput) -> Result<u16, RecordingError> {
        let (id, place) = match self.known.get(&std::ptr::from_ref(channel).addr()) {
            Some(known) => *known,
            None => self.place(channel, output)?,
        };
        self.topics[place].1 += 1;
        Ok(id)
    }

    fn place(
        &mut self,
        channel: &RawChannel,
        output: &mut McapOutput,
    ) -> Result<(u16, usize), RecordingError> {
        let schema = channel.schema.as_ref().map(|s| (&*s.name, &*s.encoding, s.data.as_slice()));
        let metadata = channel.metadata.iter().cloned().collect();
        let id = output.add_channel(&channel.topic, schema, &channel.message_encoding, &metadata)?;
        let place = *self.places.entry(channel.topic.clone()).or_insert_with(|| {
            self.topics.push((channel.topic.clone(), 0));
            self.topics.len() - 1
        });
        self.known.insert(std::ptr::from_ref(channel).addr(), (id, place));
        Ok((id, place))
    }
}

/// The channels whose topics match; a pattern that matches none is an error with the nearest topic.
fn matching_channels(
    channels: Vec<Arc<RawChannel>>,
    patterns: &[String],
) -> Result<Vec<Arc<RawChannel>>, RecordingError> {
    let mut wanted = vec![false; channels.len()];
    for pattern in patterns {
        // A topic with a bracket that is never closed can still be meant as it is.
        let glob = glob::Pattern::new(pattern).ok();
        let matches = |topic: &str| topic == pattern || glob.as_ref().is_some_and(|g| g.matches(topic));
        let mut found = false;
        for (wanted, channel) in wanted.iter_mut().zip(&channels) {
            if matches(&channel.topic) {
                (*wanted, found) = (true, true);
            }
        }
        if !found {
            let mut present: Vec<String> = channels.iter().map(|c| c.topic.clone()).collect();
            present.sort();
            present.dedup();
            let nearest = error::nearest_name(pattern, &present);
            return Err(RecordingError::NoSuchTopic { pattern: pattern.clone(), nearest, present });
        }
    }
    Ok(channels.into_iter().zip(wanted).filter(|(_, wanted)| *wanted).map(|(channel, _)| channel).collect())
}

/// The profile promises how all channels are encoded, so it is kept only where all files agree.
fn common_profile(recording: &Recording) -> &str {
    let mut profiles = recording.files.iter().map(|file| file.layout.profile.as_str());
    let first = profiles.next().unwrap_or_default();
    if profiles.all(|profile| profile == first) { first } else { "" }
}

/// Where the thin recording comes from. Local files by their names only: where they lie is no part of the content.
fn source_metadata(recording: &Recording, kept: &Kept) -> Result<BTreeMap<String, String>, RecordingError> {
    let mut entries = BTreeMap::from([("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned())]);
    for (i, file) in recording.whole_report()?.files.iter().enumerate() {
        let name = match (&file.object, file.path.file_name()) {
            (None, Some(name)) => name.to_string_lossy().into_owned(),
            _ => file.path.to_string_lossy().into_owned(),
        };
        entries.insert(format!("source{i}.name"), name);
        entries.insert(format!("source{i}.identity"), file.identity.clone());
        entries.insert(format!("source{i}.bytes"), file.bytes.to_string());
        entries.insert(format!("source{i}.damaged_parts"), file.damaged.len().to_string());
        let read = if file.source == Source::Index { "index" } else { "scan" };
        entries.insert(format!("source{i}.read_by"), read.to_owned());
    }
    for (i, (topic, _)) in kept.topics.iter().enumerate() {
        entries.insert(format!("topic{i}"), topic.clone());
    }
    Ok(entries)
}
