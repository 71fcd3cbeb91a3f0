//! Messages of the wanted streams, decoded block by block in parallel and put together in file order.

use crate::clock::Stamps;
use crate::decode::{Plan, Role, Rows};
use crate::error::nearest;
use crate::joints::JointTable;
use crate::open::ns;
use crate::poses::PoseTable;
use crate::raw::RawChannel;
use crate::records::Message;
use crate::sweep::{blocks, sweep};
use crate::{LengthUnit, Recording, RecordingError};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Row-less messages of a filtered stream looked into for the names of the bodies they hold.
const BODIES_SAMPLED: u64 = 20;

/// One stream asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Request<'a> {
    pub role: &'static str,
    /// Which of several of this role.
    pub name: Option<&'a str>,
    pub topic: &'a str,
    pub kind: Kind<'a>,
}

/// What to read out of the messages.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Kind<'a> {
    Joints { wanted: &'a [String] },
    Pose { body: Option<&'a str>, unit: LengthUnit },
    Scalar,
}

impl Kind<'_> {
    fn role(&self) -> Role {
        match self {
            Kind::Joints { .. } => Role::Joints,
            Kind::Pose { .. } => Role::Pose,
            Kind::Scalar => Role::Scalar,
        }
    }
}

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
    pub stamps: Stamps,
    pub joints: JointTable,
    pub poses: PoseTable,
    /// One number a row.
    pub scalars: Vec<f64>,
}

impl Gathered {
    /// Makes room for the rows of all parts at once, so that millions of rows are copied once.
    fn reserve<'a>(&mut self, parts: impl Iterator<Item = &'a Gathered> + Clone) {
        let sum = |length: fn(&Gathered) -> usize| parts.clone().map(length).sum::<usize>();
        self.stamps.reserve(sum(|part| part.stamps.log_ns.len()));
        self.joints.position.reserve(sum(|part| part.joints.position.len()));
        self.joints.effort.reserve(sum(|part| part.joints.effort.len()));
        self.poses.seen.reserve(sum(|part| part.poses.seen.len()));
        self.scalars.reserve(sum(|part| part.scalars.len()));
    }

    fn append(&mut self, mut later: Gathered) {
        self.messages += later.messages;
        self.undecodable += later.undecodable;
        self.first_error = self.first_error.take().or(later.first_error);
        self.other_bodies.append(&mut later.other_bodies);
        self.stamps.append(&mut later.stamps);
        self.joints.append(later.joints);
        self.poses.append(later.poses);
        self.scalars.append(&mut later.scalars);
    }
}

/// A channel's plan for one request.
struct Target {
    request: usize,
    plan: Plan,
    to_m: f64,
}

/// Decodes the wanted channels in one pass. The surveys of the pass are remembered by the recording.
pub(crate) fn gather(
    recording: &Recording,
    requests: &[Request<'_>],
) -> Result<Vec<Gathered>, RecordingError> {
    let mut wanted: Vec<BTreeMap<u16, Vec<Target>>> = Vec::new();
    wanted.resize_with(recording.files.len(), BTreeMap::new);
    let mut gathered: Vec<Gathered> = Vec::new();
    for (index, request) in requests.iter().enumerate() {
        let unreadable = target(recording, index, request, &mut wanted)?;
        gathered.push(Gathered { unreadable, ..Gathered::default() });
    }
    let channels: Vec<BTreeSet<u16>> = wanted.iter().map(|w| w.keys().copied().collect()).collect();
    // Blocks of a recording are alike: one makes room for as many rows as the fullest so far had.
    let most_rows: Vec<AtomicUsize> = requests.iter().map(|_| AtomicUsize::new(0)).collect();
    let start = |r: (&Request<'_>, _)| Batch::new(r.0.kind.role(), r.1);
    let (surveys, blocks) = sweep(
        &recording.files,
        &blocks(&recording.files, &channels),
        |file| (file, requests.iter().zip(&most_rows).map(start).collect::<Vec<_>>()),
        |(file, batches), message| {
            for target in wanted[*file].get(&message.channel_id).into_iter().flatten() {
                batches[target.request].take(target, message);
            }
        },
        |(_, batches)| batches.into_iter().zip(requests).map(|(b, r)| b.finish(r)).collect::<Vec<_>>(),
    )?;
    recording.remember(surveys);
    for (index, whole) in gathered.iter_mut().enumerate() {
        whole.reserve(blocks.iter().filter_map(|block| block.get(index)));
    }
    for block in blocks {
        for (whole, part) in gathered.iter_mut().zip(block) {
            whole.append(part);
        }
    }
    Ok(gathered)
}

/// Compiles a plan for every channel of the topic that can be read, and returns why the others cannot.
fn target(
    recording: &Recording,
    index: usize,
    request: &Request<'_>,
    wanted: &mut [BTreeMap<u16, Vec<Target>>],
) -> Result<BTreeSet<String>, RecordingError> {
    let mut unreadable = BTreeSet::new();
    let mut readable = 0;
    for (file, wanted) in recording.files.iter().zip(wanted) {
        for (id, channel) in file.channels.iter().filter(|(_, c)| c.topic == request.topic) {
            match compile(channel, request.kind) {
                Ok((plan, to_m)) => {
                    readable += 1;
                    wanted.entry(*id).or_default().push(Target { request: index, plan, to_m });
                }
                Err(why) => {
                    unreadable.insert(why);
                }
            }
        }
    }
    if readable > 0 {
        return Ok(unreadable);
    }
    let (role, topic) = (request.role, request.topic.to_owned());
    if unreadable.is_empty() {
        let channels = recording.files.iter().flat_map(|f| f.channels.values());
        let present: BTreeSet<String> = channels.map(|c| c.topic.clone()).collect();
        let nearest = nearest(&topic, &present);
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

fn compile(channel: &Arc<RawChannel>, kind: Kind<'_>) -> Result<(Plan, f64), String> {
    let Some(schema) = &channel.schema else {
        return Err("a channel without a schema cannot be decoded".to_owned());
    };
    let body = match kind {
        Kind::Pose { body, .. } => body,
        _ => None,
    };
    let encoding = &channel.message_encoding;
    let plan = Plan::compile(kind.role(), &schema.name, &schema.encoding, &schema.data, encoding, body)
        .map_err(|e| e.to_string())?;
    // Types that are millimetres by definition are so whatever the configuration says.
    let to_m = match kind {
        Kind::Pose { .. } if plan.in_millimetres() => LengthUnit::Mm.to_m(),
        Kind::Pose { unit, .. } => unit.to_m(),
        _ => 1.0,
    };
    Ok((plan, to_m))
}

/// One stream's rows of one block.
struct Batch<'a> {
    rows: Rows,
    /// Rows that room is made for as soon as there is one.
    most_rows: &'a AtomicUsize,
    log_ns: Vec<i64>,
    publish_ns: Vec<i64>,
    to_m: Vec<f64>,
    counted: Gathered,
    sampled: u64,
}

impl<'a> Batch<'a> {
    fn new(role: Role, most_rows: &'a AtomicUsize) -> Batch<'a> {
        Batch {
            rows: Rows::new(role),
            most_rows,
            log_ns: Vec::new(),
            publish_ns: Vec::new(),
            to_m: Vec::new(),
            counted: Gathered::default(),
            sampled: 0,
        }
    }

    fn take(&mut self, target: &Target, message: &Message<'_>) {
        self.counted.messages += 1;
        let before = self.rows.len();
        if let Err(e) = target.plan.decode(message.data, &mut self.rows) {
            self.counted.undecodable += 1;
            self.counted.first_error.get_or_insert_with(|| e.to_string());
        }
        let added = self.rows.len();
        if before == 0 && added > 0 {
            self.reserve();
        }
        self.log_ns.resize(added, ns(message.log_ns));
        self.publish_ns.resize(added, ns(message.publish_ns));
        self.to_m.resize(added, target.to_m);
        if added == before && self.sampled < BODIES_SAMPLED {
            self.sampled += 1;
            self.counted.other_bodies.extend(target.plan.bodies(message.data).unwrap_or_default());
        }
    }

    /// Makes room for the rows to be expected, once it is known what a row is like.
    fn reserve(&mut self) {
        let more = self.most_rows.load(Ordering::Relaxed);
        self.rows.reserve(more);
        self.log_ns.reserve(more);
        self.publish_ns.reserve(more);
        self.to_m.reserve(more);
    }

    /// Keeps of the rows what the stream wants.
    fn finish(self, request: &Request<'_>) -> Gathered {
        let Batch { rows, most_rows, log_ns, publish_ns, to_m, mut counted, .. } = self;
        most_rows.fetch_max(rows.len(), Ordering::Relaxed);
        match (rows, request.kind) {
            (Rows::Joints(rows), Kind::Joints { wanted }) => {
                let (joints, kept) = JointTable::select(&rows, wanted);
                counted.joints = joints;
                counted.stamps = Stamps { header_ns: rows.stamp_ns, publish_ns, log_ns };
                counted.stamps.keep(&kept);
            }
            (Rows::Pose(rows), _) => {
                counted.poses = PoseTable::of(&rows, &to_m);
                counted.stamps = Stamps { header_ns: rows.stamp_ns, publish_ns, log_ns };
            }
            (Rows::Scalar(rows), _) => {
                counted.scalars = rows.value;
                counted.stamps = Stamps { header_ns: rows.stamp_ns, publish_ns, log_ns };
            }
            (Rows::Joints(_), _) => {}
        }
        counted
    }
}
