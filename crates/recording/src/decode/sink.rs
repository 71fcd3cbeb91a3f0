//! Where the decoders put values: a sink gathers one message and appends its rows.

use super::slot::Slot;
use super::{DecodeError, ScalarRows};

/// Receives the values of one message, in any order.
///
/// A joint or body in a list of messages is an item: its values come between `begin_item` and `end_item`.
pub(super) trait Sink<'m> {
    /// A number, or one of a list of numbers.
    fn number(&mut self, slot: Slot, value: f64);

    /// A list of numbers.
    fn numbers(&mut self, slot: Slot, values: impl Iterator<Item = f64>) {
        for value in values {
            self.number(slot, value);
        }
    }

    /// A text, or one of a list of texts.
    fn text(&mut self, slot: Slot, text: &'m [u8]);

    /// How long the list of texts at the start of `rest` is [bytes], if it is byte for byte the one last remembered:
    /// it need not be read again.
    fn repeated_texts(&mut self, _: Slot, _rest: &[u8]) -> Option<usize> {
        None
    }

    /// The bytes of the list of texts just read.
    fn remember_texts(&mut self, _: Slot, _list: &'m [u8]) {}

    /// A number that the encoding leaves out when it has this default value.
    fn absent(&mut self, slot: Slot, default: f64);

    /// An item begins.
    fn begin_item(&mut self) {}

    /// An item ends.
    fn end_item(&mut self) {}
}

/// The stamp of a message or item while it is gathered.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stamp {
    seconds: Option<f64>,
    nanoseconds: Option<f64>,
}

impl Stamp {
    /// Takes the value if the slot is one of a stamp's.
    pub(super) fn set(&mut self, slot: Slot, value: f64) {
        match slot {
            Slot::Seconds => self.seconds = Some(value),
            Slot::Nanoseconds => self.nanoseconds = Some(value),
            _ => {}
        }
    }

    /// Takes the default value unless there is one already.
    pub(super) fn set_absent(&mut self, slot: Slot, default: f64) {
        match slot {
            Slot::Seconds => _ = self.seconds.get_or_insert(default),
            Slot::Nanoseconds => _ = self.nanoseconds.get_or_insert(default),
            _ => {}
        }
    }

    /// The stamp [ns]; `None` if the message has none, or none that an `i64` of nanoseconds can hold.
    pub(super) fn ns(self) -> Option<i64> {
        if self.seconds.is_none() && self.nanoseconds.is_none() {
            return None;
        }
        // 2^63 ns are 9.2e9 s; whole numbers of that size are exact in f64.
        let whole = |part: Option<f64>| {
            let part = part.unwrap_or(0.0);
            (part.abs() <= 9.2e9 && part as i64 as f64 == part).then_some(part as i64)
        };
        whole(self.seconds)?.checked_mul(1_000_000_000)?.checked_add(whole(self.nanoseconds)?)
    }
}

/// Gathers the one number of a message.
pub(super) struct ScalarSink<'r> {
    rows: &'r mut ScalarRows,
    stamp: Stamp,
    value: Option<f64>,
}

impl<'r> ScalarSink<'r> {
    pub(super) fn new(rows: &'r mut ScalarRows) -> Self {
        ScalarSink { rows, stamp: Stamp::default(), value: None }
    }

    /// Appends the row, if decoding went well.
    pub(super) fn finish(self, decoded: Result<(), DecodeError>) -> Result<(), DecodeError> {
        decoded?;
        let value = self.value.ok_or_else(|| DecodeError::Missing { field: "value".to_owned() })?;
        self.rows.stamp_ns.push(self.stamp.ns());
        self.rows.value.push(value);
        Ok(())
    }
}

impl<'m> Sink<'m> for ScalarSink<'_> {
    fn number(&mut self, slot: Slot, value: f64) {
        match slot {
            Slot::Value => self.value = Some(value),
            _ => self.stamp.set(slot, value),
        }
    }

    fn text(&mut self, _: Slot, _: &'m [u8]) {}

    fn absent(&mut self, slot: Slot, default: f64) {
        match slot {
            Slot::Value => _ = self.value.get_or_insert(default),
            _ => self.stamp.set_absent(slot, default),
        }
    }
}
