//! Messages of the wanted streams, decoded block by block in parallel and put together in file order.

use crate::bytes::budget::Allowance;
use crate::decode::{Plan, Rows};
use crate::error::nearest_name;
use crate::foreign::inflate_message;
use crate::recording::file::RecordingFile;
use crate::recording::sweep::{blocks_for_channels, sweep};
use crate::streams::clock::Stamps;
use crate::streams::columns::concat_parts;
use crate::streams::edges::{Edge, Edges};
use crate::streams::joints::JointTable;
use crate::streams::occlusion::Seen;
use crate::streams::poses::PoseTable;
use crate::streams::request::{Kind, Request};
use crate::structure::channels::DEFINITION_FROM;
use crate::structure::raw::RawChannel;
use crate::structure::records::Message;
use crate::structure::records::saturating_ns;
use crate::structure::survey::At;
use crate::{LengthUnit, Recording, RecordingError};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Row-less messages of a filtered stream looked into for the names of the bodies they hold.
const BODIES_SAMPLED: u64 = 20;
/// Room is made for at most a message in so many bytes of a file.
const LEAST_BYTES: u64 = 16;

/// What came out of the messages of one stream.
#[derive(Debug, Default)]
pub(crate) struct Gathered {
    pub messages: u64,
    pub undecodable: u64,
    /// Why the first undecodable message was.
    pub first_error: Option<String>,
    /// Bodies seen in messages that do not hold the wanted one.
    pub other_bodies: BTreeSet<String>,
    /// Channels of the topic that cannot be read in this role, and why.
    pub unreadable: BTreeSet<String>,
    /// What is said of channels that are read by another definition than their own.
    pub substituted: BTreeSet<String>,
    pub stamps: Stamps,
    pub joints: JointTable,
    pub poses: PoseTable,
    /// Of transforms, what they join.
    pub edges: Edges,
    /// One number a row.
    pub scalars: Vec<f64>,
}

impl Gathered {
    /// Puts together what stretch after stretch gave.
    fn of(mut stretches: Vec<Gathered>) -> Gathered {
        let mut whole = Gathered::default();
        for part in &mut stretches {
            whole.messages += part.messages;
            whole.undecodable += part.undecodable;
            whole.first_error = whole.first_error.take().or(part.first_error.take());
            whole.other_bodies.append(&mut part.other_bodies);
            for (ends, edge) in std::mem::take(&mut part.edges) {
                whole.edges.entry(ends).and_modify(|known| known.add(&edge)).or_insert(edge);
            }
        }
        let each = stretches.into_iter().map(|part| ((part.stamps, part.scalars), (part.joints, part.poses)));
        let ((stamps, scalars), (joints, poses)): ((Vec<_>, Vec<_>), (Vec<_>, Vec<_>)) = each.unzip();
        let (stamps, (joints, poses)) = rayon::join(
            || Stamps::of(stamps),
            || rayon::join(|| JointTable::of(joints), || PoseTable::of(poses)),
        );
        Gathered { stamps, joints, poses, scalars: concat_parts(scalars), ..whole }
    }
}

/// Whether a topic is there that can be read like this.
pub(crate) fn can_read(recording: &Recording, request: &Request<'_>) -> bool {
    let mut channels = recording.files.iter().flat_map(RecordingFile::channels);
    channels.any(|(_, c)| c.topic == request.topic && compile_channel(c, request).is_ok())
}

/// A channel's plan for one request.
struct Target {
    request: usize,
    plan: Plan,
    to_m: f64,
    /// Whether its messages may be compressed one by one, which no CDR message looks like.
    cdr: bool,
}

/// Decodes the wanted channels in one pass. The surveys of the pass are remembered by the recording.
pub(crate) fn gather_streams(
    recording: &Recording,
    requests: &[Request<'_>],
) -> Result<Vec<Gathered>, RecordingError> {
    let mut wanted: Vec<BTreeMap<u16, Vec<Target>>> = Vec::new();
    wanted.resize_with(recording.files.len(), BTreeMap::new);
    let mut notes = Vec::new();
    for (index, request) in requests.iter().enumerate() {
        notes.push(compile_targets(recording, index, request, &mut wanted)?);
    }
    let channels: Vec<BTreeSet<u16>> = wanted.iter().map(|w| w.keys().copied().collect()).collect();
    let allowance = recording.allowance();
    let rows: Vec<f64> =
        (0..requests.len()).map(|request| declared_message_count(recording, &wanted, request)).collect();
    let (surveys, stretches) = sweep(
        recording,
        &blocks_for_channels(&recording.files, &channels),
        |share| {
            requests.iter().zip(&rows).map(|(r, rows)| Stretch::new(r.kind, share * rows)).collect::<Vec<_>>()
        },
        |streams, at, message| {
            for target in wanted[at.file].get(&message.channel_id).into_iter().flatten() {
                streams[target.request].take(at, target, message, &allowance);
            }
        },
    )?;
    recording.remember(surveys);
    recording.within(&allowance)?;
    let mut parts: Vec<Vec<Gathered>> =
        requests.iter().map(|_| Vec::with_capacity(stretches.len())).collect();
    for stretch in stretches {
        parts.iter_mut().zip(stretch).for_each(|(parts, part)| parts.push(part.gathered));
    }
    let whole = parts.into_par_iter().zip(notes);
    let whole = whole.map(|(parts, [unreadable, substituted])| Gathered {
        unreadable,
        substituted,
        ..Gathered::of(parts)
    });
    Ok(whole.collect())
}

/// How many messages the files say that there are for a request: what room is made for, believed no further than that.
fn declared_message_count(
    recording: &Recording,
    wanted: &[BTreeMap<u16, Vec<Target>>],
    request: usize,
) -> f64 {
    let of_file = |(file, wanted): (&RecordingFile, &BTreeMap<u16, Vec<Target>>)| {
        let counts = file.layout.statistics.as_ref().map(|s| &s.channel_message_counts);
        let of_request = wanted.iter().filter(|(_, targets)| targets.iter().any(|t| t.request == request));
        let declared =
            of_request.filter_map(|(id, _)| counts?.get(id)).fold(0, |sum: u64, n| sum.saturating_add(*n));
        declared.min(file.bytes.len() / LEAST_BYTES) as f64
    };
    recording.files.iter().zip(wanted).map(of_file).sum()
}

/// Compiles a plan for every channel of the topic that can be read, and returns why the others cannot, and which are not read by
/// their own definition.
fn compile_targets(
    recording: &Recording,
    index: usize,
    request: &Request<'_>,
    wanted: &mut [BTreeMap<u16, Vec<Target>>],
) -> Result<[BTreeSet<String>; 2], RecordingError> {
    let [mut unreadable, mut substituted] = [BTreeSet::new(), BTreeSet::new()];
    let mut readable = 0;
    for (file, wanted) in recording.files.iter().zip(wanted) {
        for (id, channel) in file.channels().filter(|(_, c)| c.topic == request.topic) {
            match compile_channel(channel, request) {
                Ok((plan, to_m)) => {
                    readable += 1;
                    substituted.extend(channel.substitution());
                    let cdr = *channel.message_encoding == *"cdr";
                    wanted.entry(id).or_default().push(Target { request: index, plan, to_m, cdr });
                }
                Err(why) => {
                    unreadable.insert(why);
                }
            }
        }
    }
    if readable > 0 {
        return Ok([unreadable, substituted]);
    }
    let (role, topic) = (request.role, request.topic.to_owned());
    if unreadable.is_empty() {
        let channels = recording.files.iter().flat_map(RecordingFile::channels);
        let present: BTreeSet<String> = channels.map(|(_, c)| c.topic.clone()).collect();
        let nearest = nearest_name(&topic, &present);
        return Err(RecordingError::TopicMissing {
            role,
            topic,
            nearest,
            present: present.into_iter().collect(),
        });
    }
    let why = unreadable.into_iter().collect::<Vec<_>>().join("; ");
    Err(RecordingError::NotDecodable { role, topic, why })
}

fn compile_channel(channel: &Arc<RawChannel>, request: &Request<'_>) -> Result<(Plan, f64), String> {
    let Some(schema) = channel.definition() else {
        return Err("a channel without a schema cannot be decoded".to_owned());
    };
    let (kind, fields) = (request.kind, request.fields.as_slice());
    let body = match kind {
        Kind::Pose { body, .. } => body,
        // Only messages that name their bodies.
        Kind::Transforms { .. } => Some(""),
        _ => None,
    };
    let (name, data, encoding) = (&schema.name, &schema.data, &channel.message_encoding);
    let plan = match fields {
        [] => Plan::compile(kind.role(), name, &schema.encoding, data, encoding, body),
        _ => Plan::at(kind.role(), name, &schema.encoding, data, encoding, (body, fields)),
    };
    let plan = plan.map_err(|e| e.to_string())?;
    let plan = if let Kind::Transforms { .. } = kind { plan.every_body() } else { plan };
    let not_its_own =
        channel.read_by.is_some() || channel.metadata.iter().any(|(key, _)| key == DEFINITION_FROM);
    let plan = if not_its_own { plan.exact() } else { plan };
    // Types that are millimetres by definition are so whatever the configuration says.
    let to_m = match kind {
        Kind::Pose { .. } | Kind::Transforms { .. } if plan.in_millimetres() => LengthUnit::Mm.to_m(),
        Kind::Pose { unit, .. } | Kind::Transforms { unit } => unit.to_m(),
        _ => 1.0,
    };
    Ok((plan, to_m))
}

/// One stream's rows of a stretch of blocks.
struct Stretch<'a> {
    kind: Kind<'a>,
    /// Those of one message, on their way to where they stay.
    rows: Rows,
    gathered: Gathered,
    /// Row-less messages that were looked into, of a block.
    sampled: (Option<At>, u64),
}

impl<'a> Stretch<'a> {
    /// With room for about so many rows. Whatever cannot be had in advance is had when there are rows.
    fn new(kind: Kind<'a>, rows: f64) -> Stretch<'a> {
        let mut gathered = Gathered::default();
        // Stretches are not quite alike.
        let room = (1.05 * rows).ceil() as usize;
        gathered.stamps.make_room(room);
        match kind {
            Kind::Joints { wanted } => gathered.joints.make_room(room, wanted.len()),
            Kind::Pose { .. } => _ = gathered.poses.seen.try_reserve_exact(room),
            Kind::Scalar => _ = gathered.scalars.try_reserve_exact(room),
            Kind::Transforms { .. } => {}
        }
        Stretch { kind, rows: Rows::new(kind.role()), gathered, sampled: (None, 0) }
    }

    fn take(&mut self, at: At, target: &Target, message: &Message<'_>, allowance: &Allowance) {
        let Stretch { rows, gathered, .. } = self;
        gathered.messages += 1;
        rows.clear();
        let decode = |data: Cow<'_, [u8]>| target.plan.decode(&data, rows).map_err(|e| e.to_string());
        let data =
            if target.cdr { inflate_message(message.data, allowance) } else { Ok(message.data.into()) };
        if let Err(why) = data.and_then(decode) {
            gathered.undecodable += 1;
            gathered.first_error.get_or_insert(why);
        }
        let Gathered { stamps, joints, poses, scalars, edges, .. } = gathered;
        let mut stamp = |header_ns| {
            stamps.push(header_ns, saturating_ns(message.publish_ns), saturating_ns(message.log_ns))
        };
        match (&*rows, self.kind) {
            (Rows::Joints(rows), Kind::Joints { wanted }) => {
                let kept = rows.rows().filter(|row| joints.take(row, wanted));
                kept.for_each(|row| stamp(row.stamp_ns));
            }
            (Rows::Pose(rows), Kind::Transforms { .. }) => rows.rows().for_each(|row| {
                let ends = (row.frame_id.to_owned(), row.body.to_owned());
                let edge = Edge::new(Seen::of(&row, target.to_m));
                edges.entry(ends).and_modify(|known| known.add(&edge)).or_insert(edge);
            }),
            (Rows::Pose(rows), kind) => rows.rows().for_each(|row| {
                if let Kind::Pose { frame: Some(frame), .. } = kind
                    && frame != row.frame_id
                {
                    poses.other_frames.insert(row.frame_id.to_owned());
                    return;
                }
                poses.take(&row, target.to_m);
                stamp(row.stamp_ns);
            }),
            (Rows::Scalar(rows), _) => {
                scalars.extend_from_slice(&rows.value);
                rows.stamp_ns.iter().for_each(|header_ns| stamp(*header_ns));
            }
            (Rows::Joints(_), _) => {}
        }
        if self.rows.is_empty() {
            self.look_for_bodies(at, target, message);
        }
    }

    /// Remembers which bodies a message without a row holds, of the first of them in each block.
    fn look_for_bodies(&mut self, at: At, target: &Target, message: &Message<'_>) {
        if self.sampled.0 != Some(at) {
            self.sampled = (Some(at), 0);
        }
        if self.sampled.1 < BODIES_SAMPLED {
            self.sampled.1 += 1;
            self.gathered.other_bodies.extend(target.plan.bodies(message.data).unwrap_or_default());
        }
    }
}
