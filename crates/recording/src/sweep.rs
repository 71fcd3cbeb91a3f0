//! One pass over every block of every file, in parallel, with results in file order.

use crate::channels::Definitions;
use crate::chunk::Inflater;
use crate::layout::{Content, Damage};
use crate::open::RecordingFile;
use crate::records::{Message, RawRecord, Records};
use mcap::records::op;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Names a block: file, then block in the file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct At {
    pub file: usize,
    pub block: usize,
}

/// Every block of the recording, in file order.
pub(crate) fn blocks(files: &[RecordingFile]) -> Vec<At> {
    let of_file = |(file, f): (usize, &RecordingFile)| {
        (0..f.layout.blocks.len()).map(move |block| At { file, block }).collect::<Vec<_>>()
    };
    files.iter().enumerate().flat_map(of_file).collect()
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
    pub damage: Vec<Damage>,
}

impl FileSurvey {
    fn count(&mut self, message: &Message<'_>) {
        let one = Tally { messages: 1, first_ns: message.log_ns, last_ns: message.log_ns };
        self.tallies.entry(message.channel_id).and_modify(|t| t.add(one)).or_insert(one);
    }

    fn merge(&mut self, other: FileSurvey) {
        for (id, tally) in other.tallies {
            self.tallies.entry(id).and_modify(|t| t.add(tally)).or_insert(tally);
        }
        self.definitions.merge(other.definitions);
        self.damage.extend(other.damage);
    }
}

/// Passes over all blocks. `start` makes the collector of a block, `each` sees every sound message of it in
/// order, `finish` keeps what is worth keeping. Returns one survey a file, and what was kept in file order.
pub(crate) fn sweep<C, D: Send>(
    files: &[RecordingFile],
    start: impl Fn(usize) -> C + Sync,
    each: impl Fn(&mut C, &Message<'_>) + Sync,
    finish: impl Fn(C) -> D + Sync,
) -> (Vec<FileSurvey>, Vec<D>) {
    let results: Vec<(At, FileSurvey, D)> = blocks(files)
        .into_par_iter()
        .map_init(Inflater::default, |inflater, at| {
            let mut collector = start(at.file);
            let mut survey = FileSurvey::default();
            let file = &files[at.file];
            let (records, damage) = open_block(file, at, inflater);
            survey.damage.extend(damage);
            let mut short = 0_u64;
            for record in records {
                if !file.layout.definitions_complete {
                    survey.definitions.absorb(&record);
                }
                if record.op != op::MESSAGE {
                    continue;
                }
                match Message::parse(record.body) {
                    Some(message) => {
                        survey.count(&message);
                        each(&mut collector, &message);
                    }
                    None => short += 1,
                }
            }
            if short > 0 {
                let offset = file.layout.blocks[at.block].offset;
                let why = format!("messages shorter than their header are dropped ({short} here)");
                survey.damage.push(Damage { offset, why, lost: true });
            }
            (at, survey, finish(collector))
        })
        .collect();
    let mut surveys = vec![FileSurvey::default(); files.len()];
    let mut collectors = Vec::with_capacity(results.len());
    for (at, survey, collector) in results {
        surveys[at.file].merge(survey);
        collectors.push(collector);
    }
    (surveys, collectors)
}

/// The records of a block, held: for passes that hand messages out in order.
pub(crate) enum Step {
    /// Inflated records, ending at a whole record.
    Inflated(Vec<u8>),
    /// Records in the file itself.
    InFile(std::ops::Range<usize>),
}

impl Step {
    /// The records.
    pub fn records<'a>(&'a self, file: &'a [u8]) -> impl Iterator<Item = RawRecord<'a>> {
        let records = match self {
            Step::Inflated(bytes) => Records::new(bytes, 0, bytes.len()),
            Step::InFile(range) => Records::new(file, range.start, range.end),
        };
        records.map_while(Result::ok)
    }
}

/// Inflates a block, or points to it where it needs no inflating. A bad one is empty.
pub(crate) fn inflate(files: &[RecordingFile], at: At) -> Step {
    let file = &files[at.file];
    if let Content::Loose(range) = &file.layout.blocks[at.block].content {
        return Step::InFile(range.clone());
    }
    let mut inflater = Inflater::default();
    Step::Inflated(judge(file, at, &mut inflater).0.to_vec())
}

fn open_block<'a>(
    file: &'a RecordingFile,
    at: At,
    inflater: &'a mut Inflater,
) -> (impl Iterator<Item = RawRecord<'a>>, Option<Damage>) {
    let (bytes, damage) = judge(file, at, inflater);
    (Records::new(bytes, 0, bytes.len()).map_while(Result::ok), damage)
}

/// The usable record bytes of a block, and what is wrong with the rest.
fn judge<'a>(file: &'a RecordingFile, at: At, inflater: &'a mut Inflater) -> (&'a [u8], Option<Damage>) {
    let block = &file.layout.blocks[at.block];
    let damage = |why: String| Some(Damage { offset: block.offset, why, lost: true });
    match &block.content {
        Content::Loose(range) => (&file.map[range.clone()], None),
        Content::Chunk(range) => match inflater.whole(&file.map[range.clone()]) {
            Ok(bytes) if well_formed(bytes) => (bytes, None),
            Ok(_) => (&[], damage("chunk dropped: its records do not add up to its size".into())),
            Err(why) => (&[], damage(format!("chunk dropped: {why}"))),
        },
        Content::CutChunk(range) => {
            let body = &file.map[range.clone()];
            let sound = body.iter().rposition(|b| *b != 0).map_or(0, |i| i + 1);
            if inflater.whole(body).is_ok_and(well_formed) {
                return (inflater.whole(body).unwrap_or_default(), None);
            }
            let bytes = inflater.prefix(&body[..sound]).unwrap_or_default();
            (bytes, damage(format!("last chunk cut off: only the first {} bytes of it inflate", bytes.len())))
        }
    }
}

/// Whether the bytes are whole records to the last byte.
fn well_formed(bytes: &[u8]) -> bool {
    Records::new(bytes, 0, bytes.len()).all(|r| r.is_ok())
}
