//! Shares of a manifest, and the completion markers that say what became of them.

use super::store;
use crate::error::ArchiveError;
use armcal_recording::{input, make_folder_in};
use armcal_result::FailedRecording;
use armcal_result::VERSION;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where completion markers are, below the campaign's folder.
const MARKERS: &str = "shards";
const SCHEMA: &str = "armcal.shard/1";

/// Share `number` of `of`, from 1: every `of`-th recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Shard {
    number: usize,
    of: usize,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Shard = Shard { number: 1, of: 1 };

    /// Whether a recording of the manifest belongs to it.
    pub fn has(self, index: usize) -> bool {
        index % self.of == self.number - 1
    }

    /// The share of this task of a Slurm job array, if this is one.
    ///
    /// # Errors
    /// An array whose ids are not evenly spaced.
    pub fn of_slurm() -> Option<Result<Shard, String>> {
        let number = |name: &str| std::env::var(name).ok()?.parse::<usize>().ok();
        let (id, count) = (number("SLURM_ARRAY_TASK_ID")?, number("SLURM_ARRAY_TASK_COUNT")?);
        let (first, step) = (number("SLURM_ARRAY_TASK_MIN")?, number("SLURM_ARRAY_TASK_STEP").unwrap_or(1));
        let place =
            id.checked_sub(first).filter(|after| step > 0 && after % step == 0).map(|after| after / step);
        Some(match place {
            Some(place) if place < count => Ok(Shard { number: place + 1, of: count }),
            _ => Err("the ids of this Slurm job array have gaps; give --shard".to_owned()),
        })
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let wrong = || format!("`{text}` is no share: write 1/3, 2/3 or 3/3 for three shares");
        let (number, of) = text.split_once('/').ok_or_else(wrong)?;
        let number: usize = number.trim().parse().map_err(|_| wrong())?;
        let of: usize = of.trim().parse().map_err(|_| wrong())?;
        if number == 0 || number > of { Err(wrong()) } else { Ok(Shard { number, of }) }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// What became of one recording; `index` is its place in the manifest.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Done {
    /// Its result is in this folder.
    Calibrated {
        /// Place in the manifest.
        index: usize,
        /// Folder.
        folder: String,
    },
    /// It has none.
    Failed {
        /// Place in the manifest.
        index: usize,
        /// Why.
        failed: FailedRecording,
    },
}

impl Done {
    fn index(&self) -> usize {
        match self {
            Done::Calibrated { index, .. } | Done::Failed { index, .. } => *index,
        }
    }
}

/// What became of a share.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct CompletionMarker {
    schema: String,
    version: String,
    shard: Shard,
    /// Key of manifest and settings.
    campaign: String,
    pipeline: String,
    /// Recordings of the whole manifest.
    recordings: usize,
    /// What became of each of this share.
    pub done: Vec<Done>,
    /// Results that were there already; not kept, it says nothing about the result.
    #[serde(skip)]
    pub skipped: usize,
}

impl CompletionMarker {
    pub(super) fn new(
        shard: Shard,
        campaign: String,
        pipeline: &str,
        recordings: usize,
        done: Vec<Done>,
        skipped: usize,
    ) -> CompletionMarker {
        let (schema, version) = (SCHEMA.to_owned(), VERSION.to_owned());
        CompletionMarker {
            schema,
            version,
            shard,
            campaign,
            pipeline: pipeline.to_owned(),
            recordings,
            done,
            skipped,
        }
    }

    /// Recordings of the share without a result.
    pub fn failed(&self) -> usize {
        self.done.iter().filter(|d| matches!(d, Done::Failed { .. })).count()
    }

    /// The completion marker of a share in a campaign's folder.
    pub(super) fn file(shard: Shard, out: &Path) -> PathBuf {
        out.join(MARKERS).join(format!("{}-of-{}.json", shard.number, shard.of))
    }

    pub(super) fn write(&self, out: &Path) -> Result<(), ArchiveError> {
        make_folder_in(out, MARKERS).map_err(ArchiveError::Output)?;
        let text = serde_json::to_vec_pretty(self).map_err(ArchiveError::Json)?;
        store::write_one(&CompletionMarker::file(self.shard, out), &text)
    }
}

/// The completion markers in a campaign's folder.
pub(super) fn completion_markers(out: &Path) -> Result<Vec<CompletionMarker>, ArchiveError> {
    let folder = out.join(MARKERS);
    let entries = std::fs::read_dir(&folder).map_err(|e| ArchiveError::Campaign {
        path: folder.clone(),
        why: format!("{e}; `armcal map` leaves a receipt of every share there"),
    })?;
    let mut paths: Vec<_> = entries.flatten().map(|e| e.path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "json"));
    paths.sort();
    let read = |path: &std::path::PathBuf| {
        let bad = |why: String| ArchiveError::Campaign { path: path.clone(), why };
        let text = input::read_to_string(path, input::Kind::Data).map_err(|e| bad(e.to_string()))?;
        let completion_marker: CompletionMarker =
            serde_json::from_str(&text).map_err(|e| bad(format!("{e}; map it again")))?;
        Ok(completion_marker)
    };
    paths.iter().map(read).collect()
}

/// Everything in the order of the manifest, with the pipeline's name.
///
/// # Errors
/// Shares of different campaigns or partitions, missing ones, a recording in two of them or in none.
pub(super) fn merge_shards(
    completion_markers: Vec<CompletionMarker>,
    out: &Path,
) -> Result<(String, Vec<Done>), ArchiveError> {
    let bad = |why: String| ArchiveError::Campaign { path: out.to_owned(), why };
    let Some(first) = completion_markers.first().cloned() else {
        return Err(bad("holds no share; run `armcal map` first".into()));
    };
    for other in &completion_markers {
        let (a, b) = (first.shard, other.shard);
        if a.of != b.of {
            return Err(bad(format!(
                "holds shares of two partitions, {a} and {b}: remove those of one from `{MARKERS}`"
            )));
        }
        if other.campaign != first.campaign || other.version != first.version {
            return Err(bad(format!(
                "shares {a} and {b} are not of one manifest, pipeline and version: map the older one again"
            )));
        }
    }
    let mut by_shard: BTreeMap<Shard, CompletionMarker> = BTreeMap::new();
    let (of, recordings, pipeline) = (first.shard.of, first.recordings, first.pipeline);
    for completion_marker in completion_markers {
        if let Some(twice) = by_shard.insert(completion_marker.shard, completion_marker) {
            return Err(bad(format!("share {} is there twice", twice.shard)));
        }
    }
    let wanted = (1..=of).map(|number| Shard { number, of });
    let missing: Vec<String> = wanted.filter(|s| !by_shard.contains_key(s)).map(|s| s.to_string()).collect();
    if !missing.is_empty() {
        return Err(bad(format!("share {} is missing: map it, then reduce again", missing.join(", "))));
    }
    let mut done: Vec<Done> = by_shard.into_values().flat_map(|r| r.done).collect();
    done.sort_by_key(Done::index);
    match (0..recordings.max(done.len())).find(|i| done.get(*i).map(Done::index) != Some(*i)) {
        Some(i) => {
            Err(bad(format!("recording {} of the manifest is in no share or in two: map again", i + 1)))
        }
        None => Ok((pipeline, done)),
    }
}

#[cfg(test)]
#[path = "shard_tests.rs"]
mod tests;
