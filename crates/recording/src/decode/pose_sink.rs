//! Gathers the pose of one body out of a message that may hold many.

use super::sink::{Sink, Stamp};
use super::slot::Slot;
use super::{DecodeError, PoseRows};
use std::collections::BTreeSet;
use std::io::Write as _;

/// Stands for the frame of the message until it is known.
const FRAME_OF_MESSAGE: u32 = u32::MAX;

/// Gathers the rows of one message; all of them are of one body.
pub(super) struct PoseSink<'r, 'm> {
    rows: &'r mut PoseRows,
    /// Number of rows before this message.
    start: usize,
    filter: Option<&'m [u8]>,
    /// Whether each body that comes through the filter makes a row of its own.
    every: bool,
    /// Whether items have no names but their places.
    by_place: bool,
    items: u32,
    by_item: bool,
    in_item: bool,
    message: Gathered<'m>,
    item: Gathered<'m>,
    /// All bodies that came through the filter, by number, in the order of the message, once there are several.
    several: Vec<u32>,
    /// The same, to look up.
    known: BTreeSet<u32>,
    missing: Option<&'static str>,
}

/// Values of the message, or of one item in it.
#[derive(Debug, Clone, Copy, Default)]
struct Gathered<'m> {
    stamp: Stamp,
    frame: Option<&'m [u8]>,
    body: &'m [u8],
    subject: &'m [u8],
    index: Option<f64>,
    position: [f64; 3],
    quaternion: [f64; 4],
    occluded: bool,
    /// [`Slot::bit`] of every slot filled.
    seen: u32,
}

impl<'r, 'm> PoseSink<'r, 'm> {
    /// `filter` is the body wanted: its name, `subject/name`, or, `by_place`, its place in the list; of others `every` one may be
    /// wanted.
    pub(super) fn new(
        rows: &'r mut PoseRows,
        (filter, every): (Option<&'m [u8]>, bool),
        by_place: bool,
    ) -> Self {
        PoseSink {
            start: rows.len(),
            rows,
            filter,
            every,
            by_place,
            items: 0,
            by_item: false,
            in_item: false,
            message: Gathered::default(),
            item: Gathered::default(),
            several: Vec::new(),
            known: BTreeSet::new(),
            missing: None,
        }
    }

    /// Completes the rows of the message; on an error the rows are as before.
    pub(super) fn finish(mut self, decoded: Result<(), DecodeError>) -> Result<(), DecodeError> {
        if !self.by_item && decoded.is_ok() {
            let message = self.message;
            self.push(&message);
        }
        let checked = decoded.and_then(|()| match self.missing {
            Some(field) => Err(DecodeError::Missing { field: field.to_owned() }),
            None if !self.several.is_empty() => {
                let name = |body: &u32| self.rows.bodies.text(*body).to_owned();
                Err(DecodeError::SeveralBodies { bodies: self.several.iter().map(name).collect() })
            }
            None => Ok(()),
        });
        if checked.is_err() {
            self.rows.truncate(self.start);
            return checked;
        }
        let stamp_ns = self.message.stamp.ns();
        for i in self.start..self.rows.len() {
            self.rows.stamp_ns[i] = self.rows.stamp_ns[i].or(stamp_ns);
            if self.rows.frame_of_row[i] == FRAME_OF_MESSAGE {
                self.rows.frame_of_row[i] = self.rows.frames.id(self.message.frame.unwrap_or_default());
            }
        }
        Ok(())
    }

    /// Appends a row, if this is the body wanted.
    fn push(&mut self, gathered: &Gathered<'m>) {
        let Some(body) = self.wanted_body(gathered) else { return };
        if !self.every && self.rows.len() > self.start && self.rows.body_of_row[self.start] != body {
            for body in [self.rows.body_of_row[self.start], body] {
                if self.known.insert(body) {
                    self.several.push(body);
                }
            }
            return;
        }
        let all = |slots: &[Slot]| slots.iter().all(|slot| gathered.seen & slot.bit() != 0);
        if !all(&[Slot::X, Slot::Y, Slot::Z]) {
            self.missing = Some("complete position");
        }
        let orientation = [Slot::Qx, Slot::Qy, Slot::Qz, Slot::Qw];
        let has_orientation = all(&orientation);
        if !has_orientation && orientation.iter().any(|slot| gathered.seen & slot.bit() != 0) {
            self.missing = Some("complete orientation");
        }
        let frame = match gathered.frame {
            Some(frame) => self.rows.frames.id(frame),
            None => FRAME_OF_MESSAGE,
        };
        self.rows.stamp_ns.push(gathered.stamp.ns());
        self.rows.position.push(gathered.position);
        self.rows.quaternion_xyzw.push(has_orientation.then_some(gathered.quaternion));
        self.rows.occluded.push(gathered.occluded);
        self.rows.frame_of_row.push(frame);
        self.rows.body_of_row.push(body);
    }

    /// The interned full name of the body, if it is the one wanted.
    fn wanted_body(&mut self, gathered: &Gathered<'m>) -> Option<u32> {
        let name = &mut self.rows.body_scratch;
        name.clear();
        if !gathered.subject.is_empty() {
            name.extend_from_slice(gathered.subject);
            name.push(b'/');
        }
        let own_name = name.len();
        match gathered.index {
            // Writing to memory cannot fail.
            Some(index) if gathered.body.is_empty() => _ = write!(name, "{index}"),
            _ => name.extend_from_slice(gathered.body),
        }
        if self.filter.is_some_and(|wanted| wanted != &name[..] && wanted != &name[own_name..]) {
            return None;
        }
        if self.by_item && name.is_empty() {
            // Vicon's unlabelled markers: nobody knows which is which from one frame to the next.
            return None;
        }
        Some(self.rows.bodies.id(name))
    }

    fn current(&mut self) -> &mut Gathered<'m> {
        if self.in_item { &mut self.item } else { &mut self.message }
    }
}

impl<'m> Sink<'m> for PoseSink<'_, 'm> {
    fn number(&mut self, slot: Slot, value: f64) {
        let gathered = self.current();
        gathered.seen |= slot.bit();
        match slot {
            Slot::X => gathered.position[0] = value,
            Slot::Y => gathered.position[1] = value,
            Slot::Z => gathered.position[2] = value,
            Slot::Qx => gathered.quaternion[0] = value,
            Slot::Qy => gathered.quaternion[1] = value,
            Slot::Qz => gathered.quaternion[2] = value,
            Slot::Qw => gathered.quaternion[3] = value,
            Slot::Occluded => gathered.occluded = value != 0.0,
            Slot::BodyIndex => gathered.index = Some(value),
            _ => gathered.stamp.set(slot, value),
        }
    }

    fn text(&mut self, slot: Slot, text: &'m [u8]) {
        let gathered = self.current();
        match slot {
            Slot::Frame => gathered.frame = Some(text),
            Slot::Body => gathered.body = text,
            Slot::Subject => gathered.subject = text,
            _ => {}
        }
    }

    fn absent(&mut self, slot: Slot, default: f64) {
        if self.current().seen & slot.bit() == 0 {
            self.number(slot, default);
        }
    }

    fn begin_item(&mut self) {
        (self.by_item, self.in_item) = (true, true);
        let index = self.by_place.then_some(f64::from(self.items));
        self.item = Gathered { index, ..Gathered::default() };
        self.items += 1;
    }

    fn end_item(&mut self) {
        self.in_item = false;
        let item = self.item;
        self.push(&item);
    }
}
