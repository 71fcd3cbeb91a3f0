//! One pass over blocks, in parallel, with results in file order.
//!
//! Of a mapped file every block is passed over, so that all of it is judged. Of a file read by ranges only those blocks
//! are that may hold a wanted channel: some at a time, the next ones on their way while these are worked on.

use crate::RecordingError;
use crate::bytes::FileBytes;
use crate::bytes::budget::BUDGET_BYTES;
use crate::recording::Recording;
use crate::recording::file::RecordingFile;
use crate::recording::judge::{Judged, judge_block};
use crate::structure::chunk::Inflater;
use crate::structure::index::candidate_blocks;
use crate::structure::records::{Message, RawRecord, Records};
use crate::structure::survey::{At, BlockSurvey};
use bytes::Bytes;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Blocks of a file read by ranges are fetched up to this at a time.
const BATCH_BYTES: usize = 16 << 20;
/// Stretches that several threads get each, so that none waits long for the last of another.
const STRETCHES: usize = 16;

/// The blocks to pass over for these channels of each file, in file order.
pub(crate) fn blocks_for_channels(files: &[RecordingFile], wanted: &[BTreeSet<u16>]) -> Vec<At> {
    let of_file = |((file, f), wanted): ((usize, &RecordingFile), &BTreeSet<u16>)| {
        let blocks = match f.bytes {
            FileBytes::Mapped(_) => (0..f.layout.blocks.len()).collect(),
            FileBytes::Ranged(_) => candidate_blocks(&f.layout.blocks, wanted),
        };
        blocks.into_iter().map(move |block| At { file, block }).collect::<Vec<_>>()
    };
    files.iter().enumerate().zip(wanted).flat_map(of_file).collect()
}

/// Passes over blocks. `start` makes the collector of a stretch of consecutive blocks, given which share of all blocks that
/// is; `each` sees every sound message of them in order. Returns a survey of each block, and the collectors, both in file
/// order; the messages in it are counted as it goes, for a survey holds each of its channels. How long stretches are depends on the threads: what is collected must be the same once it is put together.
///
/// # Errors
/// Bytes that cannot be fetched, of which mapped files have none; more passes than what they inflate to allows for.
pub(crate) fn sweep<C: Send>(
    recording: &Recording,
    blocks: &[At],
    start: impl Fn(f64) -> C + Sync,
    each: impl Fn(&mut C, At, &Message<'_>) + Sync,
) -> Result<(Vec<BlockSurvey>, Vec<C>), RecordingError> {
    recording.pays(blocks)?;
    let files = &recording.files;
    let one = |inflater: &mut Inflater, collector: &mut C, at: At, fetched: Option<&Bytes>| {
        let file = &files[at.file];
        let range = file.layout.blocks[at.block].range();
        // Hashing streams through the bytes, and leaves them in the cache for inflating, which does not.
        file.bytes.hash(&range);
        let judged = judge_block(file, at, fetched, inflater, &mut |message| each(collector, at, message));
        let mut survey = judged.survey;
        recording.count(at, std::mem::take(&mut survey.tallies));
        inflater.done();
        file.bytes.passed(range);
        (at, survey)
    };
    let stretch = |inflater: &mut Inflater, (stretch, fetched): (&[At], &[Option<Bytes>])| {
        let mut collector = start(stretch.len() as f64 / blocks.len() as f64);
        let work = stretch.iter().zip(fetched);
        let surveys: Vec<BlockSurvey> =
            work.map(|(at, fetched)| one(inflater, &mut collector, *at, fetched.as_ref())).collect();
        (surveys, collector)
    };
    let (mut surveys, mut collected) = (Vec::with_capacity(blocks.len()), Vec::new());
    for_each_batch(files, blocks, |batch| {
        let stretches = match rayon::current_num_threads() {
            1 => 1,
            threads => threads * STRETCHES,
        };
        let length = batch.blocks.len().div_ceil(stretches).max(1);
        let work = batch.blocks.par_chunks(length).zip(batch.fetched.par_chunks(length));
        for (found, collector) in work.map_init(Inflater::default, stretch).collect::<Vec<_>>() {
            surveys.extend(found);
            collected.push(collector);
        }
        Ok(())
    })?;
    Ok((surveys, collected))
}

/// Blocks that are worked on together, and what was fetched of them.
pub(crate) struct Batch<'a> {
    pub blocks: &'a [At],
    /// `None` for blocks of mapped files.
    pub fetched: Vec<Option<Bytes>>,
}

/// Hands blocks to `work` batch by batch, in order, while the next batch is fetched.
pub(crate) fn for_each_batch(
    files: &[RecordingFile],
    blocks: &[At],
    mut work: impl FnMut(Batch<'_>) -> Result<(), RecordingError> + Send,
) -> Result<(), RecordingError> {
    let mut batches = split_batches(files, blocks).into_iter();
    let mut ready = batches.next().map(|batch| fetch_batch(files, batch)).transpose()?;
    while let Some(batch) = ready {
        let next = batches.next();
        let (done, fetched) =
            rayon::join(|| work(batch), || next.map(|batch| fetch_batch(files, batch)).transpose());
        done?;
        ready = fetched?;
    }
    Ok(())
}

/// Splits blocks: those of mapped files all at once, those of files read by ranges by size.
fn split_batches<'a>(files: &[RecordingFile], blocks: &'a [At]) -> Vec<&'a [At]> {
    let ranged = |at: &At| matches!(files[at.file].bytes, FileBytes::Ranged(_));
    let mut batches = Vec::new();
    let (mut from, mut bytes) = (0, 0);
    for (i, at) in blocks.iter().enumerate() {
        let size = if ranged(at) { files[at.file].layout.blocks[at.block].range().len() } else { 0 };
        let other_file = i > from && blocks[i - 1].file != at.file && (ranged(at) || ranged(&blocks[i - 1]));
        if i > from && (other_file || bytes + size > BATCH_BYTES) {
            batches.push(&blocks[from..i]);
            (from, bytes) = (i, 0);
        }
        bytes += size;
    }
    if from < blocks.len() {
        batches.push(&blocks[from..]);
    }
    batches
}

fn fetch_batch<'a>(files: &[RecordingFile], blocks: &'a [At]) -> Result<Batch<'a>, RecordingError> {
    let file = blocks.first().map(|at| &files[at.file]);
    let fetched = match file {
        Some(RecordingFile { bytes: FileBytes::Ranged(ranged), layout, .. }) => {
            let ranges: Vec<_> = blocks.iter().map(|at| layout.blocks[at.block].range()).collect();
            ranged.read(&ranges)?.into_iter().map(Some).collect()
        }
        _ => vec![None; blocks.len()],
    };
    Ok(Batch { blocks, fetched })
}

/// How many blocks from the first on are held together: at most `most`, and within the budget.
pub(crate) fn blocks_within_budget(files: &[RecordingFile], blocks: &[At], most: usize) -> usize {
    let sums = blocks.iter().scan(0_u64, |sum, at| {
        *sum = sum.saturating_add(files[at.file].layout.blocks[at.block].held());
        Some(*sum)
    });
    sums.take(most).take_while(|sum| *sum <= BUDGET_BYTES as u64).count().max(1)
}

/// The records of a block, held for passes that hand messages out in order, and the survey of it. A bad one is empty.
pub(crate) fn inflate_block(
    files: &[RecordingFile],
    at: At,
    fetched: Option<&Bytes>,
) -> (Vec<u8>, BlockSurvey) {
    let mut inflater = Inflater::default();
    let mut kept = Vec::new();
    let file = &files[at.file];
    let alone = file.layout.blocks[at.block].is_alone();
    let Judged { survey, inflated } = judge_block(file, at, fetched, &mut inflater, &mut |message| {
        // A large chunk is kept as it was inflated, and not copied.
        if !alone {
            message.write_to(&mut kept);
        }
    });
    if alone {
        kept = inflated.unwrap_or_else(|| inflater.take());
    }
    (kept, (at, survey))
}

/// The records of a block's bytes.
pub(crate) fn block_records(bytes: &[u8]) -> impl Iterator<Item = RawRecord<'_>> {
    Records::new(bytes, 0, bytes.len()).map_while(Result::ok)
}
