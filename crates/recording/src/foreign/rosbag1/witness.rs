//! What a ROS 1 bag says of its messages beside the messages: the index behind a chunk, the list of chunks at the end, the
//! numbers in its head.

use super::records::{Record, time_ns};
use crate::foreign::copy::Copy;
use std::collections::{BTreeMap, BTreeSet};

/// Messages of a chunk, and its index: of each connection the times and places.
pub(super) struct Indexed {
    chunk_at: usize,
    /// Nothing of the chunk could be read.
    pub unused: bool,
    seen: BTreeMap<u32, Vec<(u64, u32)>>,
    listed: BTreeMap<u32, Vec<(u64, u32)>>,
    broken: bool,
}

impl Indexed {
    pub fn of_chunk_at(chunk_at: usize) -> Indexed {
        let none = BTreeMap::new;
        Indexed { chunk_at, unused: false, seen: none(), listed: none(), broken: false }
    }

    pub fn message(&mut self, connection: u32, time_ns: u64, place: usize) {
        self.seen.entry(connection).or_default().push((time_ns, place as u32));
    }

    /// Takes in an index of one connection.
    pub fn index(&mut self, record: &Record<'_>) {
        let (entries, rest) = record.data.as_chunks::<12>();
        let told = record.u32("conn").zip(record.u32("count"));
        let Some((connection, count)) = told.filter(|_| rest.is_empty() && record.u32("ver") == Some(1))
        else {
            self.broken = true;
            return;
        };
        let entry = |entry: &[u8; 12]| {
            let place = entry.last_chunk::<4>().map(|place| u32::from_le_bytes(*place));
            time_ns(&entry[..8]).zip(place)
        };
        let all: Option<Vec<(u64, u32)>> = entries.iter().map(entry).collect();
        match all.filter(|all| all.len() == count as usize) {
            Some(all) => self.listed.entry(connection).or_default().extend(all),
            None => self.broken = true,
        }
    }

    /// Holds both against each other. A chunk without any index is the last of a recorder that died.
    pub fn judge(mut self, copy: &mut Copy) {
        let all =
            |of: &mut BTreeMap<u32, Vec<(u64, u32)>>| of.values_mut().for_each(|all| all.sort_unstable());
        all(&mut self.seen);
        all(&mut self.listed);
        let unindexed = self.listed.is_empty() && !self.broken;
        if self.unused || self.seen == self.listed && !self.broken {
            return;
        }
        let count = |of: &BTreeMap<u32, Vec<(u64, u32)>>| of.values().map(Vec::len).sum::<usize>();
        let why = match unindexed {
            true => "no index follows the chunk".to_owned(),
            false => format!(
                "the index of the chunk lists {} messages, {} are in it, or at other times or places",
                count(&self.listed),
                count(&self.seen)
            ),
        };
        copy.lost_at(self.chunk_at, why);
    }
}

/// What the head and the end of a bag list.
#[derive(Default)]
pub(super) struct Listed {
    head: Option<[u64; 3]>,
    /// Messages of each connection in each chunk, by where it is.
    listed: BTreeMap<u64, BTreeMap<u32, u32>>,
    seen: BTreeMap<u64, BTreeMap<u32, u32>>,
    /// Chunks that could not be read: already told.
    unused: BTreeSet<u64>,
    broken: bool,
}

impl Listed {
    pub fn head(&mut self, record: &Record<'_>) {
        let numbers = record.u64("index_pos").zip(record.u32("conn_count")).zip(record.u32("chunk_count"));
        self.head = numbers.map(|((index, connections), chunks)| [index, connections.into(), chunks.into()]);
    }

    pub fn chunk(&mut self, at: usize, seen: &Indexed) {
        if seen.unused {
            self.unused.insert(at as u64);
        }
        let counts = seen.seen.iter().map(|(connection, all)| (*connection, all.len() as u32)).collect();
        self.seen.insert(at as u64, counts);
    }

    /// Takes in what the end says of a chunk.
    pub fn chunk_info(&mut self, record: &Record<'_>) {
        let (entries, rest) = record.data.as_chunks::<8>();
        let (at, count) = (record.u64("chunk_pos"), record.u32("count"));
        let Some(at) = at.filter(|_| rest.is_empty() && count == Some(entries.len() as u32)) else {
            self.broken = true;
            return;
        };
        let number = |bytes: &[u8]| bytes.try_into().map_or(0, u32::from_le_bytes);
        let counts = entries.iter().map(|entry| (number(&entry[..4]), number(&entry[4..])));
        self.listed.insert(at, counts.filter(|(_, messages)| *messages > 0).collect());
    }

    /// Holds what is listed against what was seen.
    pub fn judge(self, connections: usize, copy: &mut Copy) {
        let Some([index_at, known, chunks]) = self.head else {
            return copy.lost("the bag has no readable head".to_owned());
        };
        if index_at == 0 {
            return copy.lost("the bag was never finished: its recorder died".to_owned());
        }
        if known != connections as u64 || chunks != self.seen.len() as u64 {
            copy.lost(format!(
                "its head counts {known} connections and {chunks} chunks, {connections} and {} are there",
                self.seen.len()
            ));
        }
        let seen = self.seen.into_iter().filter(|(at, _)| !self.unused.contains(at));
        let seen: BTreeMap<u64, BTreeMap<u32, u32>> = seen.collect();
        let mut listed = self.listed;
        listed.retain(|at, _| !self.unused.contains(at));
        if self.broken || listed != seen {
            copy.lost("the list of chunks at its end counts other messages than are there".to_owned());
        }
    }
}
