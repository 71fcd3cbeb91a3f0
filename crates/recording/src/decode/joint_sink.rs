//! Gathers joint readings: either lists (names, positions, efforts) or one item a joint.

use super::sink::{Sink, Stamp};
use super::slot::Slot;
use super::{DecodeError, JointRows};

/// Gathers the joints of one message straight into the columns.
pub(super) struct JointSink<'r, 'm> {
    rows: &'r mut JointRows,
    /// Length of the columns before this message.
    position_start: usize,
    effort_start: usize,
    stamp: Stamp,
    names: usize,
    /// Whether the list of names is that of the row before.
    same_names: bool,
    /// The bytes of the list of names, if it is one list.
    names_list: &'m [u8],
    /// Whether each joint is an item of its own.
    by_item: bool,
    position: f64,
    effort: f64,
    any_effort: bool,
    /// Joints read so far that have a path each.
    joints: usize,
    /// Where `position` and `effort` are among the named values of the item.
    interfaces: usize,
    position_at: Option<usize>,
    effort_at: Option<usize>,
}

impl<'r> JointSink<'r, '_> {
    pub(super) fn new(rows: &'r mut JointRows) -> Self {
        rows.name_scratch.clear();
        JointSink {
            position_start: rows.position.len(),
            effort_start: rows.effort.len(),
            rows,
            stamp: Stamp::default(),
            names: 0,
            same_names: false,
            names_list: &[],
            by_item: false,
            position: f64::NAN,
            effort: f64::NAN,
            any_effort: false,
            joints: 0,
            interfaces: 0,
            position_at: None,
            effort_at: None,
        }
    }

    /// One joint of several was read, each by a path of its own.
    pub(super) fn end_joint(&mut self) {
        let from = self.position_start + self.joints;
        // Of a field that a message repeats the last counts; one that it leaves out is what the encoding says, or none.
        let read = self.rows.position.get(from..).and_then(<[f64]>::last).copied();
        self.rows.position.truncate(from);
        self.rows.position.push(read.unwrap_or(self.position));
        (self.joints, self.position) = (self.joints + 1, f64::NAN);
    }

    /// Appends the row, if the message has positions; on an error the rows are as before.
    pub(super) fn finish(self, decoded: Result<(), DecodeError>) -> Result<(), DecodeError> {
        let checked = decoded.and_then(|()| self.check());
        let positions = &self.rows.position[self.position_start..];
        let none = positions.is_empty() || self.joints > 0 && positions.iter().all(|q| q.is_nan());
        if checked.is_err() || none {
            self.rows.position.truncate(self.position_start);
            self.rows.effort.truncate(self.effort_start);
            return checked;
        }
        if self.by_item && !self.any_effort {
            self.rows.effort.truncate(self.effort_start);
        }
        if self.same_names {
            self.rows.push_same_names(self.stamp.ns());
        } else {
            self.rows.push_gathered(self.stamp.ns(), self.names_list);
        }
        Ok(())
    }

    /// Names are either absent or as many as there are positions; efforts may be fewer, of the joints that come first.
    fn check(&self) -> Result<(), DecodeError> {
        let positions = self.rows.position.len() - self.position_start;
        let efforts = self.rows.effort.len() - self.effort_start;
        let lengths = |others, of| Err(DecodeError::Lengths { positions, others, of });
        match positions {
            0 => Ok(()),
            _ if self.names != 0 && self.names != positions => lengths(self.names, "names"),
            _ if efforts > positions => lengths(efforts, "efforts"),
            _ => Ok(()),
        }
    }
}

impl<'m> Sink<'m> for JointSink<'_, 'm> {
    fn number(&mut self, slot: Slot, value: f64) {
        match slot {
            Slot::Position if self.by_item => self.position = value,
            Slot::Effort if self.by_item => self.effort = value,
            Slot::Position => self.rows.position.push(value),
            Slot::Effort => self.rows.effort.push(value),
            Slot::InterfaceValue => self.rows.value_scratch.push(value),
            _ => self.stamp.set(slot, value),
        }
    }

    fn numbers(&mut self, slot: Slot, values: impl Iterator<Item = f64>) {
        match slot {
            Slot::Position => self.rows.position.extend(values),
            Slot::Effort => self.rows.effort.extend(values),
            _ => self.rows.value_scratch.extend(values),
        }
    }

    fn text(&mut self, slot: Slot, text: &'m [u8]) {
        match slot {
            Slot::Joint => {
                self.names += 1;
                self.rows.name_scratch.extend_from_slice(&(text.len() as u32).to_le_bytes());
                self.rows.name_scratch.extend_from_slice(text);
            }
            Slot::Interface => {
                match text {
                    b"position" => self.position_at = Some(self.interfaces),
                    b"effort" => self.effort_at = Some(self.interfaces),
                    _ => {}
                }
                self.interfaces += 1;
            }
            _ => {}
        }
    }

    fn repeated_texts(&mut self, slot: Slot, rest: &[u8]) -> Option<usize> {
        if slot != Slot::Joint {
            return None;
        }
        let (list, names) = self.rows.last_names()?;
        self.same_names = rest.starts_with(list);
        self.same_names.then(|| {
            self.names = names;
            list.len()
        })
    }

    fn remember_texts(&mut self, slot: Slot, list: &'m [u8]) {
        if slot == Slot::Joint {
            self.names_list = list;
        }
    }

    fn absent(&mut self, slot: Slot, default: f64) {
        match slot {
            Slot::Position if self.position.is_nan() => self.position = default,
            Slot::Effort if self.effort.is_nan() => self.effort = default,
            _ => self.stamp.set_absent(slot, default),
        }
    }

    fn begin_item(&mut self) {
        self.by_item = true;
        (self.position, self.effort) = (f64::NAN, f64::NAN);
        (self.interfaces, self.position_at, self.effort_at) = (0, None, None);
        self.rows.value_scratch.clear();
    }

    fn end_item(&mut self) {
        let value = |at: Option<usize>| at.and_then(|at| self.rows.value_scratch.get(at)).copied();
        let position = value(self.position_at).unwrap_or(self.position);
        let effort = value(self.effort_at).unwrap_or(self.effort);
        self.any_effort |= !effort.is_nan();
        self.rows.position.push(position);
        self.rows.effort.push(effort);
    }
}
