//! Decoded messages as flat columns: no allocation per message once the buffers have grown.

use super::Role;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Rows decoded so far, of the role the plan was compiled for.
#[derive(Debug, Clone)]
pub enum Rows {
    /// Joint readings.
    Joints(JointRows),
    /// Positions or poses of a tracked body.
    Pose(PoseRows),
    /// One number a message.
    Scalar(ScalarRows),
}

impl Rows {
    /// No rows yet.
    pub fn new(role: Role) -> Rows {
        match role {
            Role::Joints => Rows::Joints(JointRows::default()),
            Role::Pose => Rows::Pose(PoseRows::default()),
            Role::Scalar => Rows::Scalar(ScalarRows::default()),
        }
    }

    /// What the rows hold.
    pub fn role(&self) -> Role {
        match self {
            Rows::Joints(_) => Role::Joints,
            Rows::Pose(_) => Role::Pose,
            Rows::Scalar(_) => Role::Scalar,
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Rows::Joints(rows) => rows.len(),
            Rows::Pose(rows) => rows.len(),
            Rows::Scalar(rows) => rows.value.len(),
        }
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Takes all rows away. Room for as many stays, and texts that repeat are still known.
    pub(crate) fn clear(&mut self) {
        match self {
            Rows::Joints(rows) => rows.clear(),
            Rows::Pose(rows) => rows.truncate(0),
            Rows::Scalar(rows) => {
                rows.stamp_ns.clear();
                rows.value.clear();
            }
        }
    }
}

/// Joint readings of one channel, one row a message; the rows may differ in length and in joint names.
///
/// `position` and `effort` hold all rows behind one another; a row's slice ends where
/// `position_end[i]` says and starts where the row before ended. Units are the message's own.
#[derive(Debug, Clone, Default)]
pub struct JointRows {
    /// Header stamp of each row [ns]; `None` where the message has none.
    pub stamp_ns: Vec<Option<i64>>,
    pub(super) position: Vec<f64>,
    position_end: Vec<usize>,
    pub(super) effort: Vec<f64>,
    effort_end: Vec<usize>,
    names_of_row: Vec<u32>,
    /// The names of the last row that there was.
    last_names: Option<u32>,
    name_lists: Vec<Arc<[String]>>,
    name_keys: Interner,
    /// Joint names of the message being decoded, each as its length (u32) and its bytes.
    pub(super) name_scratch: Vec<u8>,
    /// The list of names of the last row as its message has it, if that is one list of bytes.
    last_names_list: Vec<u8>,
    /// Named values of the joint being decoded.
    pub(super) value_scratch: Vec<f64>,
}

/// One row of [`JointRows`].
#[derive(Debug, Clone, Copy)]
pub struct JointRow<'a> {
    /// Header stamp [ns]; `None` where the message has none.
    pub stamp_ns: Option<i64>,
    /// Joint names in the order of `position`; shared by all rows with the same names (compare with
    /// [`Arc::ptr_eq`]), empty when the message names no joints.
    pub names: &'a Arc<[String]>,
    /// Positions, in the message's unit. NaN for a joint without one.
    pub position: &'a [f64],
    /// Efforts, as long as `position`, or empty when the message has none.
    pub effort: &'a [f64],
}

impl JointRows {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.stamp_ns.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.stamp_ns.is_empty()
    }

    /// Row `i`. Panics beyond [`len`](Self::len), like a slice.
    pub fn row(&self, i: usize) -> JointRow<'_> {
        let start = |ends: &[usize]| if i == 0 { 0 } else { ends[i - 1] };
        JointRow {
            stamp_ns: self.stamp_ns[i],
            names: &self.name_lists[self.names_of_row[i] as usize],
            position: &self.position[start(&self.position_end)..self.position_end[i]],
            effort: &self.effort[start(&self.effort_end)..self.effort_end[i]],
        }
    }

    /// All rows in order.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = JointRow<'_>> {
        (0..self.len()).map(|i| self.row(i))
    }

    /// The different lists of joint names seen, in order of appearance.
    pub fn name_lists(&self) -> &[Arc<[String]>] {
        &self.name_lists
    }

    fn clear(&mut self) {
        self.stamp_ns.clear();
        self.position.clear();
        self.position_end.clear();
        self.effort.clear();
        self.effort_end.clear();
        self.names_of_row.clear();
    }

    /// The bytes of the list of names of the last row, and how many names it has.
    pub(super) fn last_names(&self) -> Option<(&[u8], usize)> {
        let names = &self.name_lists[self.last_names? as usize];
        (!self.last_names_list.is_empty()).then_some((&self.last_names_list, names.len()))
    }

    /// Makes a row of what was appended to `position`, `effort` and `name_scratch` since the last row. `names_list`:
    /// the names as the message has them, or nothing if they are scattered.
    pub(super) fn push_gathered(&mut self, stamp_ns: Option<i64>, names_list: &[u8]) {
        let (id, new) = self.name_keys.id(&self.name_scratch);
        if new {
            self.name_lists.push(split_names(&self.name_scratch));
        }
        self.last_names_list.clear();
        self.last_names_list.extend_from_slice(names_list);
        self.push(stamp_ns, id);
    }

    /// Makes a row with the names of the last row.
    pub(super) fn push_same_names(&mut self, stamp_ns: Option<i64>) {
        if let Some(id) = self.last_names {
            self.push(stamp_ns, id);
        }
    }

    fn push(&mut self, stamp_ns: Option<i64>, names: u32) {
        self.stamp_ns.push(stamp_ns);
        self.position_end.push(self.position.len());
        self.effort_end.push(self.effort.len());
        self.names_of_row.push(names);
        self.last_names = Some(names);
    }
}

/// The names behind one another in `name_scratch`.
fn split_names(mut key: &[u8]) -> Arc<[String]> {
    let mut names = Vec::new();
    while let Some((length, rest)) = key.split_first_chunk() {
        let (name, after) = rest.split_at(u32::from_le_bytes(*length) as usize);
        names.push(String::from_utf8_lossy(name).into_owned());
        key = after;
    }
    names.into()
}

/// Positions or poses of one tracked body, one row per message (or per matching transform).
#[derive(Debug, Clone, Default)]
pub struct PoseRows {
    /// Header stamp of each row [ns]; `None` where the message has none.
    pub stamp_ns: Vec<Option<i64>>,
    /// Position x, y, z of each row, in the message's unit (see [`Plan::in_millimetres`](super::Plan::in_millimetres)).
    pub position: Vec<[f64; 3]>,
    /// Orientation x, y, z, w of each row exactly as in the message, where it has one.
    pub quaternion_xyzw: Vec<Option<[f64; 4]>>,
    /// Whether the message itself flags the body as occluded.
    pub occluded: Vec<bool>,
    pub(super) frame_of_row: Vec<u32>,
    pub(super) body_of_row: Vec<u32>,
    pub(super) frames: Texts,
    pub(super) bodies: Texts,
    /// Full name of the body being decoded.
    pub(super) body_scratch: Vec<u8>,
}

/// One row of [`PoseRows`].
#[derive(Debug, Clone, Copy)]
pub struct PoseRow<'a> {
    /// Header stamp [ns]; `None` where the message has none.
    pub stamp_ns: Option<i64>,
    /// Frame the pose is expressed in; empty where the message does not say.
    pub frame_id: &'a str,
    /// The tracked body; empty where the message does not name one.
    pub body: &'a str,
    /// Position x, y, z, in the message's unit.
    pub position: [f64; 3],
    /// Orientation x, y, z, w exactly as in the message, where it has one.
    pub quaternion_xyzw: Option<[f64; 4]>,
    /// Whether the message itself flags the body as occluded.
    pub occluded: bool,
}

impl PoseRows {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.stamp_ns.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.stamp_ns.is_empty()
    }

    /// Row `i`. Panics beyond [`len`](Self::len), like a slice.
    pub fn row(&self, i: usize) -> PoseRow<'_> {
        PoseRow {
            stamp_ns: self.stamp_ns[i],
            frame_id: self.frames.text(self.frame_of_row[i]),
            body: self.bodies.text(self.body_of_row[i]),
            position: self.position[i],
            quaternion_xyzw: self.quaternion_xyzw[i],
            occluded: self.occluded[i],
        }
    }

    /// All rows in order.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = PoseRow<'_>> {
        (0..self.len()).map(|i| self.row(i))
    }

    /// The different bodies of the rows, in order of appearance. More than one means that a channel
    /// without a `body` filter carries several (one per message): ask the user to choose.
    pub fn bodies(&self) -> Vec<&str> {
        self.bodies.used(&self.body_of_row)
    }

    /// The different frames of the rows, in order of appearance.
    pub fn frames(&self) -> Vec<&str> {
        self.frames.used(&self.frame_of_row)
    }

    pub(super) fn truncate(&mut self, len: usize) {
        self.stamp_ns.truncate(len);
        self.position.truncate(len);
        self.quaternion_xyzw.truncate(len);
        self.occluded.truncate(len);
        self.frame_of_row.truncate(len);
        self.body_of_row.truncate(len);
    }
}

/// One number a message.
#[derive(Debug, Clone, Default)]
pub struct ScalarRows {
    /// Header stamp of each row [ns]; `None` where the message has none.
    pub stamp_ns: Vec<Option<i64>>,
    /// The number, in the message's unit.
    pub value: Vec<f64>,
}

/// Numbers byte strings in order of appearance; the one seen last is found without a search.
#[derive(Debug, Clone, Default)]
pub(super) struct Interner {
    ids: BTreeMap<Box<[u8]>, u32>,
    /// The key seen last and its number, once there is one.
    last: (Vec<u8>, Option<u32>),
}

impl Interner {
    /// The number of `key`, and whether it is new.
    pub(super) fn id(&mut self, key: &[u8]) -> (u32, bool) {
        // Comparing nothing with nothing by `memcmp` reads, masked, from a dangling address: 100 ns on AVX-512.
        if let (last, Some(id)) = &self.last
            && (key.is_empty() && last.is_empty() || last == key)
        {
            return (*id, false);
        }
        let next = self.ids.len() as u32;
        let (id, new) = match self.ids.get(key) {
            Some(&id) => (id, false),
            None => {
                self.ids.insert(key.into(), next);
                (next, true)
            }
        };
        self.last.0.clear();
        self.last.0.extend_from_slice(key);
        self.last.1 = Some(id);
        (id, new)
    }
}

/// Interned texts. Bytes that are not UTF-8 are shown with replacement characters.
#[derive(Debug, Clone, Default)]
pub(super) struct Texts {
    ids: Interner,
    texts: Vec<Arc<str>>,
}

impl Texts {
    /// The number of `text` in this list, added if it is new.
    pub(super) fn id(&mut self, text: &[u8]) -> u32 {
        let (id, new) = self.ids.id(text);
        if new {
            self.texts.push(String::from_utf8_lossy(text).into());
        }
        id
    }

    pub(super) fn text(&self, id: u32) -> &str {
        &self.texts[id as usize]
    }

    /// The texts that rows use; a message that failed may have left others.
    fn used(&self, ids: &[u32]) -> Vec<&str> {
        let mut seen = vec![false; self.texts.len()];
        ids.iter()
            .filter(|&&id| !std::mem::replace(&mut seen[id as usize], true))
            .map(|&id| self.text(id))
            .collect()
    }
}
