//! What is on the channels of all recordings: joint names, tracked bodies, a thermometer, the robot's description.

use super::fields::Fields;
use super::files::Opened;
use super::topics::{BodyTopic, JointTopic};
use crate::error::InitError;
use armcal_recording::decode::{DecodeError, Plan, Role, Rows, readable_as};
use armcal_recording::{RawChannel, RawSchema, RecordingError, inflate_message};
use armcal_stages::RunError;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// Messages of a channel that are looked into for names: the first so many, then every so-manieth.
const FIRST: u64 = 100;
const EVERY: u64 = 50;
/// More names of joints or bodies than this are no arm in a laboratory.
const MOST_NAMES: usize = 64;
/// More types of messages than this that could hold joints, bodies or a temperature are no laboratory's.
const MOST_TYPES: usize = 1000;

/// What all the recordings have in common, and what is left over.
#[derive(Default)]
pub struct Channels {
    /// Joint readings.
    pub joints: Vec<JointTopic>,
    /// Tracked bodies.
    pub bodies: Vec<BodyTopic>,
    /// Thermometers.
    pub temperatures: Vec<String>,
    /// Numbers called temperatures in messages that armcal does not know: topic and path.
    pub warm: Vec<(String, String)>,
    /// Texts that are a robot's description.
    pub urdfs: BTreeSet<String>,
    /// What is not used, and why.
    pub left: Vec<(String, String)>,
    /// Messages of unknown types in every recording, in which fields may be called as the joints are.
    pub unknown: Vec<Unknown>,
    /// Whether a topic may hold joints for all that is known: its messages cannot be read, or not in every recording.
    pub unread: bool,
    /// What is said of topics that are read by another definition than the file's.
    pub substituted: BTreeMap<String, String>,
}

/// Messages of a type that armcal does not know.
pub struct Unknown {
    /// Their topic.
    pub topic: String,
    /// Messages in all recordings.
    pub messages: u64,
    /// What they hold.
    pub fields: Fields,
}

/// What one topic holds.
#[derive(Default)]
struct Found {
    recordings: usize,
    messages: u64,
    role: Option<Role>,
    thermometer: bool,
    describes: bool,
    names: Vec<String>,
    why_not: Option<Refused>,
}

/// Why messages are of no role.
#[derive(Debug, Clone)]
struct Refused {
    why: String,
    /// Whether nobody knows what they hold.
    unread: bool,
}

/// Looks into every recording.
pub fn scan_recordings(opened: &[Opened]) -> Result<Channels, InitError> {
    let mut found: BTreeMap<String, Found> = BTreeMap::new();
    let mut fields: BTreeMap<String, Fields> = BTreeMap::new();
    let mut channels = Channels::default();
    for Opened { entry, recording } in opened {
        let mut own: BTreeMap<String, Found> = BTreeMap::new();
        let mut plans = Plans::default();
        for channel in recording.channels() {
            let topic = own.entry(channel.topic.clone()).or_default();
            channels.substituted.extend(channel.substitution().map(|said| (channel.topic.clone(), said)));
            let Some(schema) = channel.definition() else {
                let why = format!("its messages ({}) come without a schema", channel.message_encoding);
                topic.why_not = Some(Refused { why, unread: true });
                continue;
            };
            match plans.add(schema, &channel) {
                Ok(role) => {
                    topic.role = topic.role.or(Some(role));
                    topic.thermometer |= role == Role::Scalar && is_thermometer(&channel);
                }
                Err(why) => {
                    topic.why_not = Some(why);
                    if let Some(known) = fields.get_mut(&channel.topic) {
                        known.next_recording();
                    } else if fields.len() < MOST_TYPES {
                        let mut found = Fields::of(schema, &channel.message_encoding);
                        found.next_recording();
                        fields.extend((!found.is_empty()).then(|| (channel.topic.clone(), found)));
                    }
                }
            }
        }
        let promising: BTreeSet<String> = fields.keys().cloned().collect();
        let wanted = |c: &RawChannel| is_text(c) || promising.contains(&c.topic) || plans.of(c).is_some();
        let (urdfs, allowance) = (&mut channels.urdfs, recording.allowance());
        recording
            .for_each_raw_of(&wanted, &mut |message| {
                let Some(topic) = own.get_mut(&message.channel.topic) else { return Ok(()) };
                topic.messages += 1;
                // Two that follow each other, so that what changes is seen too.
                if topic.messages > FIRST && topic.messages % EVERY > 1 {
                    return Ok(());
                }
                let Ok(data) = inflate_message(message.data, &allowance) else { return Ok(()) };
                if let Some(fields) = fields.get_mut(&message.channel.topic) {
                    fields.add(topic.messages, message.log_ns as i64, &data);
                }
                if is_text(message.channel) {
                    let found = text_in(&data).filter(|text| text.contains("<robot")).map(str::to_owned);
                    let before = urdfs.len();
                    urdfs.extend(found);
                    topic.describes |= urdfs.len() > before;
                }
                if let Some(plan) = plans.of(message.channel) {
                    topic.add(names_in(plan, &data));
                }
                Ok(())
            })
            .and_then(|()| recording.within(&allowance))
            // What the pass found to be lost is noted, whatever becomes of the proposal.
            .and_then(|()| recording.whole_report().map(drop))
            .map_err(|source: RecordingError| RunError::Recording { recording: entry.name(), source })?;
        for (topic, own) in own {
            let all = found.entry(topic).or_default();
            let Found { messages, role, thermometer, describes, names, why_not, .. } = own;
            all.recordings += usize::from(messages > 0);
            all.messages += messages;
            all.role = all.role.or(role);
            all.thermometer |= thermometer;
            all.describes |= describes;
            all.add(names);
            all.why_not = why_not;
        }
    }
    for (topic, found) in found {
        let all = found.recordings == opened.len() && found.role.is_none();
        if let Some(fields) = fields.remove(&topic).filter(|_| all) {
            channels.joints.extend(fields.joints(&topic, found.messages));
            channels.bodies.extend(fields.bodies(&topic));
            channels.warm.extend(fields.thermometers.iter().map(|path| (topic.clone(), path.clone())));
            channels.unknown.push(Unknown { topic: topic.clone(), messages: found.messages, fields });
        }
        channels.sort(topic, found, opened.len());
    }
    // The surest field first; what is known by its type before any.
    channels.joints.sort_by_key(|j| j.field.as_ref().map(|f| Reverse(f.surety)));
    Ok(channels)
}

/// How the messages of channels are read; thousands of channels may share one schema, which is compiled once.
#[derive(Default)]
struct Plans {
    plans: Vec<Plan>,
    /// Place of the plan of a schema with a message encoding, or why there is none.
    schemas: HashMap<(Arc<RawSchema>, Arc<str>), Result<usize, Refused>>,
    channels: HashMap<Arc<RawChannel>, usize>,
}

impl Plans {
    /// The role of a channel of this schema.
    ///
    /// # Errors
    /// Why it has none.
    fn add(&mut self, schema: &Arc<RawSchema>, channel: &Arc<RawChannel>) -> Result<Role, Refused> {
        let encoding = &channel.message_encoding;
        let plans = &mut self.plans;
        let compile = || {
            let (name, language, data) = (&schema.name, &schema.encoding, &schema.data);
            let refused = |error: DecodeError| {
                let unread = !matches!(error, DecodeError::Unknown { .. });
                Refused { why: error.to_string(), unread }
            };
            let role = readable_as(name, language, data, encoding).map_err(refused)?;
            if plans.len() == MOST_TYPES {
                let why = format!("one of more than {MOST_TYPES} types of messages that could be read");
                return Err(Refused { why, unread: true });
            }
            let plan = Plan::compile(role, name, language, data, encoding, None);
            plans.push(plan.map_err(refused)?);
            Ok(plans.len() - 1)
        };
        let place = self.schemas.entry((schema.clone(), encoding.clone())).or_insert_with(compile).clone()?;
        self.channels.insert(channel.clone(), place);
        Ok(self.plans[place].role())
    }

    fn of(&self, channel: &RawChannel) -> Option<&Plan> {
        self.channels.get(channel).map(|place| &self.plans[*place])
    }
}

impl Found {
    fn add(&mut self, names: Vec<String>) {
        for name in names {
            if !self.names.contains(&name) && self.names.len() < MOST_NAMES {
                self.names.push(name);
            }
        }
    }
}

impl Channels {
    fn sort(&mut self, topic: String, found: Found, recordings: usize) {
        let Found { names, messages, .. } = found;
        // Messages that nobody can read were not counted.
        self.unread |= match found.role {
            Some(Role::Joints) => messages > 0 && found.recordings < recordings,
            Some(_) => false,
            None => !found.describes && found.why_not.as_ref().is_some_and(|refused| refused.unread),
        };
        let mut leave = |why: String| self.left.push((topic.clone(), why));
        match found.role {
            _ if messages == 0 && found.role.is_some() => leave("no message".to_owned()),
            // What it describes is told with the arm.
            None if found.describes => {}
            None => {
                leave(found.why_not.map_or_else(
                    || "not of a kind that a calibration reads".to_owned(),
                    |refused| refused.why,
                ))
            }
            Some(_) if found.recordings < recordings => {
                leave(format!("only in {} of {recordings} recordings", found.recordings));
            }
            Some(Role::Joints) => self.joints.push(JointTopic { topic, names, messages, field: None }),
            Some(Role::Scalar) if found.thermometer => self.temperatures.push(topic),
            Some(Role::Scalar) => {
                leave("one number: if it is an instrument, see docs/measures.md".to_owned())
            }
            Some(Role::Pose) if names.len() < 2 => {
                self.bodies.push(BodyTopic { topic, ..BodyTopic::default() })
            }
            Some(Role::Pose) => {
                self.bodies.extend(names.into_iter().map(|name| BodyTopic {
                    topic: topic.clone(),
                    body: Some(name),
                    ..BodyTopic::default()
                }));
            }
        }
    }
}

/// The message type says it, or the topic does: a plain number may be anything.
fn is_thermometer(channel: &RawChannel) -> bool {
    let schema = channel.schema.as_ref().map_or("", |s| &*s.name);
    [schema, channel.topic.as_str()].iter().any(|name| name.to_lowercase().contains("temperature"))
}

fn names_in(plan: &Plan, data: &[u8]) -> Vec<String> {
    match plan.role() {
        Role::Pose => plan.bodies(data).unwrap_or_default(),
        Role::Scalar => Vec::new(),
        Role::Joints => {
            let mut rows = Rows::new(Role::Joints);
            match (plan.decode(data, &mut rows), &rows) {
                (Ok(()), Rows::Joints(rows)) => rows.rows().flat_map(|row| row.names.to_vec()).collect(),
                _ => Vec::new(),
            }
        }
    }
}

/// `std_msgs/String`.
fn is_text(channel: &RawChannel) -> bool {
    let schema = channel.schema.as_ref();
    *channel.message_encoding == *"cdr"
        && schema.is_some_and(|s| s.name.starts_with("std_msgs/") && s.name.ends_with("/String"))
}

/// The text of a string message: behind the encapsulation header its length, its bytes, a zero.
fn text_in(data: &[u8]) -> impl Iterator<Item = &str> {
    let text = || {
        let (head, rest) = data.split_at_checked(4)?;
        let (length, text) = rest.split_first_chunk::<4>()?;
        let little = head[1] & 1 == 1;
        let length = if little { u32::from_le_bytes(*length) } else { u32::from_be_bytes(*length) };
        let bytes = text.get(..usize::try_from(length).ok()?)?;
        std::str::from_utf8(bytes.strip_suffix(&[0]).unwrap_or(bytes)).ok()
    };
    text().into_iter()
}
