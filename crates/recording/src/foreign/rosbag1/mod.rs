//! ROS 1 bags, format 2.0: chunks of messages, each with an index behind it, and at the end a list of connections and chunks.
//!
//! What else in a bag says which messages were written: the index behind each chunk, the list of chunks, the numbers of both in
//! the head. A bag has no check sums, so these are held against what is there.

mod records;
mod witness;

use super::copy::Copy;
use crate::RecordingError;
use crate::bytes::budget::{Allowance, most_definition_bytes};
use crate::bytes::map::Map;
use crate::structure::chunk::stream_into;
use records::{Record, field, op};
use std::borrow::Cow;
use std::collections::BTreeMap;
use witness::{Indexed, Listed};

/// How a bag begins.
pub(super) const MAGIC: &[u8] = b"#ROSBAG V";
const VERSION: &[u8] = b"#ROSBAG V2.0\n";

/// Copies the messages of a bag.
pub(super) fn read(map: &Map, copy: &mut Copy, allowance: &Allowance) -> Result<(), RecordingError> {
    if !map.starts_with(VERSION) {
        let why = "it is a ROS 1 bag of a format before 2.0: `rosbag fix` of ROS 1 writes it anew";
        return Err(RecordingError::Foreign { path: copy.path().to_owned(), why: why.to_owned() });
    }
    let mut bag =
        Bag { copy, allowance, channels: BTreeMap::new(), definition_bytes: 0, listed: Listed::default() };
    let mut at = VERSION.len();
    let mut open: Option<Indexed> = None;
    while at < map.len() {
        let Some(record) = Record::at(map, at) else {
            bag.copy.lost_at(at, "what follows is no record, or cut off: it is read no further".to_owned());
            break;
        };
        if record.op() != Some(op::INDEX) {
            open.take().into_iter().for_each(|chunk| chunk.judge(bag.copy));
        }
        match record.op() {
            Some(op::BAG_HEADER) => bag.listed.head(&record),
            Some(op::CONNECTION) => bag.connection(&record, at)?,
            Some(op::CHUNK) => open = Some(bag.chunk(&record)?),
            Some(op::INDEX) => match &mut open {
                Some(chunk) => chunk.index(&record),
                None => bag.copy.lost_at(at, "an index of no chunk".to_owned()),
            },
            Some(op::CHUNK_INFO) => bag.listed.chunk_info(&record),
            _ => bag.copy.lost_at(at, "a record of an unknown kind".to_owned()),
        }
        map.passed(at..record.end);
        at = record.end;
    }
    open.into_iter().for_each(|chunk| chunk.judge(bag.copy));
    let connections = bag.channels.len();
    bag.listed.judge(connections, bag.copy);
    Ok(())
}

/// A bag under copy.
struct Bag<'c> {
    copy: &'c mut Copy,
    allowance: &'c Allowance,
    /// Channel and messages so far, by the number of the connection.
    channels: BTreeMap<u32, (u16, u32)>,
    definition_bytes: usize,
    listed: Listed,
}

impl Bag<'_> {
    /// Adds the channel of a connection, which a bag tells in the chunk of its first message and once more at the end.
    fn connection(&mut self, record: &Record<'_>, at: usize) -> Result<(), RecordingError> {
        let told = record.u32("conn").zip(record.text("topic"));
        let kind = field(record.data, "type").and_then(|kind| std::str::from_utf8(kind).ok());
        let (Some((number, topic)), Some(kind)) = (told, kind) else {
            self.copy.lost_at(at, "a connection without number, topic or type".to_owned());
            return Ok(());
        };
        if self.channels.contains_key(&number) {
            return Ok(());
        }
        let definition = field(record.data, "message_definition").unwrap_or_default();
        self.definition_bytes += definition.len() + topic.len() + kind.len();
        if self.definition_bytes > most_definition_bytes() {
            let why = format!("its definitions take more than {} MiB", most_definition_bytes() >> 20);
            return Err(RecordingError::Foreign { path: self.copy.path().to_owned(), why });
        }
        let channel = self.copy.add_channel(topic, Some((kind, "ros1msg", definition)), "ros1")?;
        self.channels.insert(number, (channel, 0));
        Ok(())
    }

    /// Copies the messages of a chunk; returns what an index can be held against.
    fn chunk(&mut self, record: &Record<'_>) -> Result<Indexed, RecordingError> {
        let mut seen = Indexed::of_chunk_at(record.start);
        let bytes = match inflate_chunk(record, self.allowance) {
            Ok(bytes) => bytes,
            Err(_) if self.allowance.is_exceeded() => return Err(self.allowance.exceeded(self.copy.path())),
            Err(why) => {
                self.copy.lost_at(record.start, format!("a chunk cannot be used: {why}"));
                seen.unused = true;
                self.listed.chunk(record.start, &seen);
                return Ok(seen);
            }
        };
        let mut at = 0;
        while at < bytes.len() {
            let Some(inner) = Record::at(&bytes, at) else {
                let why = format!("the chunk holds no record at its byte {at}; it is read no further");
                self.copy.lost_at(record.start, why);
                break;
            };
            match inner.op() {
                Some(op::CONNECTION) => self.connection(&inner, record.start)?,
                Some(op::MESSAGE) => self.message(&inner, record.start, &mut seen)?,
                _ => self.copy.lost_at(record.start, "a record of an unknown kind in the chunk".to_owned()),
            }
            at = inner.end;
        }
        self.listed.chunk(record.start, &seen);
        Ok(seen)
    }

    fn message(&mut self, record: &Record<'_>, at: usize, seen: &mut Indexed) -> Result<(), RecordingError> {
        let told = record.u32("conn").zip(record.time_ns("time"));
        let known =
            told.and_then(|(number, time_ns)| Some((number, time_ns, self.channels.get_mut(&number)?)));
        let Some((number, time_ns, (channel, messages))) = known else {
            self.copy.lost_at(at, "a message without a time, or of no connection".to_owned());
            return Ok(());
        };
        let sequence = *messages;
        *messages = messages.wrapping_add(1);
        seen.message(number, time_ns, record.start);
        self.copy.put_plain(*channel, sequence, time_ns, record.data)
    }
}

/// The records of a chunk.
fn inflate_chunk<'a>(record: &Record<'a>, allowance: &Allowance) -> Result<Cow<'a, [u8]>, String> {
    let size = record.u32("size").ok_or("it does not say its size")?;
    let failed = |e: std::io::Error| format!("it does not inflate: {e}");
    let reader: Box<dyn std::io::Read + '_> = match record.text("compression") {
        Some("none") => {
            return match record.data.len() == size as usize {
                true => Ok(record.data.into()),
                false => Err(format!("it has {} bytes instead of {size}", record.data.len())),
            };
        }
        Some("bz2") => Box::new(bzip2::read::BzDecoder::new(record.data)),
        Some("lz4") => Box::new(lz4::Decoder::new(record.data).map_err(failed)?),
        Some(other) => return Err(format!("compression {other:?} is not one of none, bz2, lz4")),
        None => return Err("it does not say how it is compressed".to_owned()),
    };
    if !allowance.admits(record.data.len() as u64, u64::from(size)) {
        return Err(allowance.refusal());
    }
    let mut bytes = Vec::new();
    stream_into(&mut bytes, reader, size as usize)?;
    match bytes.len() == size as usize {
        true => Ok(bytes.into()),
        false => Err(format!("it inflates to {} bytes instead of {size}", bytes.len())),
    }
}
