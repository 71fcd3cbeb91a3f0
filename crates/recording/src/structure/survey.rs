//! What passes find in the blocks of files.

use crate::structure::channels::Definitions;
use crate::structure::damage::Faults;
use std::collections::{BTreeMap, BTreeSet};

/// Names a block: file, then block in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct At {
    pub file: usize,
    pub block: usize,
}

/// Messages of one channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tally {
    pub messages: u64,
    pub first_ns: u64,
    pub last_ns: u64,
}

impl Tally {
    pub fn add(&mut self, other: Tally) {
        self.messages += other.messages;
        self.first_ns = self.first_ns.min(other.first_ns);
        self.last_ns = self.last_ns.max(other.last_ns);
    }
}

/// What a pass found in one file besides what it collected.
#[derive(Debug, Default, Clone)]
pub(crate) struct FileSurvey {
    pub tallies: BTreeMap<u16, Tally>,
    pub definitions: Definitions,
    pub faults: Faults,
    /// Blocks that were passed over.
    pub passed: BTreeSet<usize>,
    /// Blocks whose messages are in `tallies`: these, and those of a pass that goes on.
    pub counted: BTreeSet<usize>,
}

impl FileSurvey {
    /// Takes in what a block showed, unless an earlier pass has.
    pub fn add(&mut self, block: usize, mut found: FileSurvey) {
        self.count_block(block, std::mem::take(&mut found.tallies));
        if self.passed.insert(block) {
            self.merge(found);
        }
    }

    /// Takes in the messages of a block, unless that was done.
    pub fn count_block(&mut self, block: usize, tallies: BTreeMap<u16, Tally>) {
        if self.counted.insert(block) {
            tallies.into_iter().for_each(|(channel, tally)| self.count(channel, tally));
        }
    }

    /// Takes in messages of a channel.
    pub fn count(&mut self, channel: u16, found: Tally) {
        self.tallies.entry(channel).and_modify(|t| t.add(found)).or_insert(found);
    }

    fn merge(&mut self, other: FileSurvey) {
        if let Err(why) = self.definitions.merge(other.definitions) {
            self.faults.lost(0, || format!("in its chunks: {why}"));
        }
        self.faults.merge(other.faults);
    }
}

/// What a block showed besides what was collected.
pub(crate) type BlockSurvey = (At, FileSurvey);
