//! What is read of a recording, against what was written into it: see [`structured`](super::structured).

use super::inflated::records;
use super::limits::{Size, held};
use super::recordings::{on_disk, recording};
use super::structured::{MAGIC, Made, mcap};
use armcal_core::Severity;
use armcal_recording::Recording;
use std::collections::BTreeMap;

/// Messages, and how often each is there: sequence, times and data, as the record of a message has them behind its channel.
type Messages = BTreeMap<Vec<u8>, usize>;

/// A recording made of records by the bytes, most of them sound.
pub fn records_of(orders: &[u8]) {
    let made = mcap(orders);
    let inflated = made.packed.values().map(Vec::len);
    let bytes = made.bytes.len() + inflated.clone().sum::<usize>();
    held(Size { bytes, chunk: inflated.max().unwrap_or(0) }, || recording(&made.bytes));
    let (read, lost) = on_disk(&made.bytes, |path| {
        let mut read = Messages::new();
        let Ok(recording) = Recording::open(&[path.to_owned()]) else { return (read, true) };
        let pass = recording.for_each_raw(&mut |m| {
            let head = [m.sequence.to_le_bytes().to_vec(), m.log_ns.to_le_bytes().to_vec()].concat();
            *read.entry([&head[..], &m.publish_ns.to_le_bytes(), m.data].concat()).or_default() += 1;
            Ok(())
        });
        let lost = |w: &armcal_core::Warning| w.severity == Severity::DataLost;
        (read, pass.is_err() || recording.report().warnings.iter().any(lost))
    });
    let there = anywhere(&made);
    for (message, times) in &read {
        let there = there.get(&message[..]).copied().unwrap_or(0);
        assert!(*times <= there, "{message:02x?} was read {times} times, and is there {there} times");
    }
    if !lost {
        let written = written(&made).expect("records that are not whole, and nothing is said to be lost");
        assert!(read == written, "{} messages written, {} read, nothing said", written.len(), read.len());
    }
}

/// Every run of bytes that could be the record of a message.
fn anywhere(made: &Made) -> BTreeMap<&[u8], usize> {
    let mut all = runs(&made.sound);
    for (message, times) in runs(&made.bytes) {
        let there = all.entry(message).or_default();
        *there = times.max(*there);
    }
    for (message, times) in made.packed.values().flat_map(|chunk| runs(chunk)) {
        *all.entry(message).or_default() += times;
    }
    all
}

fn runs(bytes: &[u8]) -> BTreeMap<&[u8], usize> {
    let mut found = BTreeMap::new();
    for (at, _) in bytes.iter().enumerate().filter(|(_, byte)| **byte == 0x05) {
        if let Some((_, body)) = records(&bytes[at..]).next()
            && let Some(message) = body.get(2..)
        {
            *found.entry(message).or_default() += 1;
        }
    }
    found
}

/// The messages to which one record after the other leads; `None` where they do not lead to the end.
fn written(made: &Made) -> Option<Messages> {
    let mut messages = Messages::new();
    let data = &made.sound[..made.sound.len() - MAGIC.len()];
    let mut at = MAGIC.len();
    while at < data.len() {
        let (op, body) = records(&data[at..]).next()?;
        match op {
            0x05 => note(body, &mut messages),
            0x06 => within(made.packed.get(&at).map_or(plain(body), Vec::as_slice), &mut messages)?,
            _ => {}
        }
        at += 9 + body.len();
    }
    Some(messages)
}

/// The records in a chunk that is not compressed.
fn plain(chunk: &[u8]) -> &[u8] {
    let behind = chunk.get(28..).and_then(|rest| rest.strip_prefix(&[0; 4]));
    behind.and_then(|rest| rest.get(8..)).unwrap_or_default()
}

fn within(chunk: &[u8], messages: &mut Messages) -> Option<()> {
    let mut at = 0;
    while at < chunk.len() {
        let (op, body) = records(&chunk[at..]).next()?;
        if op == 0x05 {
            note(body, messages);
        }
        at += 9 + body.len();
    }
    Some(())
}

fn note(body: &[u8], messages: &mut Messages) {
    *messages.entry(body.get(2..).unwrap_or_default().to_vec()).or_default() += 1;
}
