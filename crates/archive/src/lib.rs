//! A lab's whole archive: every recording calibrated by itself, and what they say together.
//!
//! `Manifest -> Key of each recording -> Store (skip what is there) -> Work -> Row -> Campaign`
//!
//! Results are named by what they were made from, and appear whole or not at all: a batch that is killed goes on where it
//! was. [`map`] does a share of a manifest, on any machine that sees the folder, [`reduce`] puts the shares together; a
//! batch is one share and its reduction, so all three ways give the same bytes.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod counter;
mod error;
mod key;
mod memory;
mod once;
mod shard;
mod store;
mod work;
mod workers;

pub use counter::Counter;
pub use error::ArchiveError;
pub use shard::{CompletionMarker, Shard};

use armcal_config::{Manifest, Pipeline};
use armcal_report::write_campaign;
use armcal_result::{Campaign, FailedRecording};
use key::Keys;
use shard::Done;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use store::Store;

/// What to work on, and how.
pub struct Request<'a> {
    /// The recordings.
    pub manifest: &'a Manifest,
    /// What is done to each; its own recordings do not count.
    pub pipeline: &'a Pipeline,
    /// Folder of the campaign.
    pub out: &'a Path,
    /// Whether each recording gets everything that `armcal run` writes.
    pub full: bool,
    /// Recordings worked on at a time; all cores when absent.
    pub jobs: Option<usize>,
}

/// Works on every recording and puts them together. Returns what they say, the written files, and how many results were
/// there already.
pub fn batch(
    request: &Request<'_>,
    counter: &dyn Counter,
) -> Result<(Campaign, Vec<PathBuf>, usize), ArchiveError> {
    let completion_marker = work_on(request, Shard::WHOLE, counter)?;
    let skipped = completion_marker.skipped;
    let (campaign, written) = put_together(vec![completion_marker], request.out)?;
    Ok((campaign, written, skipped))
}

/// Works on one share of the manifest, and leaves a completion marker for [`reduce`].
pub fn map(
    request: &Request<'_>,
    shard: Shard,
    counter: &dyn Counter,
) -> Result<CompletionMarker, ArchiveError> {
    let completion_marker = work_on(request, shard, counter)?;
    completion_marker.write(request.out)?;
    Ok(completion_marker)
}

/// The completion marker that [`map`] leaves of a share.
pub fn completion_marker_file(shard: Shard, out: &Path) -> PathBuf {
    CompletionMarker::file(shard, out)
}

/// Puts the shares of a folder together.
///
/// # Errors
/// Shares that are missing, doubled, or not of one manifest and pipeline; each by its name.
pub fn reduce(out: &Path) -> Result<(Campaign, Vec<PathBuf>), ArchiveError> {
    put_together(shard::completion_markers(out)?, out)
}

fn work_on(
    request: &Request<'_>,
    shard: Shard,
    counter: &dyn Counter,
) -> Result<CompletionMarker, ArchiveError> {
    let Request { manifest, pipeline, out, .. } = request;
    memory::keep_little();
    let store = Store::open(out)?;
    let keys = Keys::new(pipeline, request.full, out)?;
    let own: Vec<usize> = (0..manifest.entries.len()).filter(|i| shard.has(*i)).collect();
    counter.count(own.len());
    let jobs = request.jobs.unwrap_or_else(workers::cores);
    let done = workers::parallel_map(own.len(), jobs, |i| {
        let index = own[i];
        let entry = &manifest.entries[index];
        let (done, skipped) = match work::ensure_result(pipeline, entry, &keys, &store, request.full) {
            Ok((folder, skipped)) => (Done::Calibrated { index, folder }, skipped),
            Err(e) => {
                let failed = FailedRecording { why: e.to_string(), ..work::failed_recording(entry) };
                counter.say(&format!("failed: {}: {}", failed.recording, failed.why));
                (Done::Failed { index, failed }, false)
            }
        };
        counter.advance(&entry.name());
        if (i + 1) % memory::EVERY == 0 {
            memory::give_back();
        }
        (done, skipped)
    });
    let skipped = done.iter().filter(|(_, skipped)| *skipped).count();
    let done = done.into_iter().map(|(done, _)| done).collect();
    let campaign = keys.of_campaign(manifest);
    Ok(CompletionMarker::new(shard, campaign, &pipeline.name, manifest.entries.len(), done, skipped))
}

fn put_together(
    completion_markers: Vec<CompletionMarker>,
    out: &Path,
) -> Result<(Campaign, Vec<PathBuf>), ArchiveError> {
    let (pipeline, done) = shard::merge_shards(completion_markers, out)?;
    let store = Store::open(out)?;
    let (mut rows, mut folders, mut failed) = (Vec::new(), Vec::new(), Vec::new());
    let mut names = BTreeSet::new();
    for one in done {
        match one {
            Done::Calibrated { folder, .. } => {
                let mut row = store.row(&folder)?;
                row.share_names(&mut names);
                rows.push(row);
                folders.push(folder);
            }
            Done::Failed { failed: one, .. } => failed.push(one),
        }
    }
    let repeats = once::find_repeats(&store, &rows, &folders)?;
    let results = rows.into_iter().zip(folders.iter().map(|folder| store::result_path(folder))).collect();
    let campaign = Campaign::of(&pipeline, results, failed, repeats);
    let written = write_campaign(&campaign, out)?;
    Ok((campaign, written))
}
