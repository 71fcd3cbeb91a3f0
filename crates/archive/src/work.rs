//! One recording: its result, unless it is there.

use super::key::Keys;
use super::store::Store;
use crate::error::ArchiveError;
use armcal_config::{Pipeline, RecordingEntry};
use armcal_report::{campaign_row, write_all, write_brief};
use armcal_result::FailedRecording;
use armcal_stages::Silent;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Makes the result of one recording. Returns its folder, and whether it was there already.
///
/// # Errors
/// Whatever stops `armcal run` on this recording alone; a panic too, so that it does not stop the others.
pub(super) fn ensure_result(
    pipeline: &Pipeline,
    entry: &RecordingEntry,
    keys: &Keys,
    store: &Store,
    full: bool,
) -> Result<(String, bool), ArchiveError> {
    let folder = Store::name(&entry.name(), &keys.of_recording(entry)?);
    if store.has(&folder) {
        return Ok((folder, true));
    }
    let made = catch_unwind(AssertUnwindSafe(|| {
        compute_result(&pipeline.of_recording(entry), entry, store, &folder, full)
    }));
    match made {
        Ok(result) => result.map(|()| (folder, false)),
        Err(panic) => {
            let why = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
            let why = why.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default();
            Err(ArchiveError::Internal { recording: entry.name(), why })
        }
    }
}

fn compute_result(
    pipeline: &Pipeline,
    entry: &RecordingEntry,
    store: &Store,
    folder: &str,
    full: bool,
) -> Result<(), ArchiveError> {
    let (mut run, recordings) = armcal_pipeline::settle(pipeline, &Silent)?.diagnosed(pipeline, &Silent);
    let made = store.begin()?;
    if full {
        armcal_pipeline::add_refits(&mut run, pipeline, &Silent)?;
        write_all(&run, &recordings, made.path(), &pipeline.output)?;
    } else {
        write_brief(&run, made.path())?;
    }
    let Some(row) = campaign_row(&run, entry.tilt, entry.load_kg) else {
        return Err(ArchiveError::Internal {
            recording: entry.name(),
            why: "its run has no recording".into(),
        });
    };
    store.finish(made, &row, folder)
}

/// What a failure is about.
pub(super) fn failed_recording(entry: &RecordingEntry) -> FailedRecording {
    FailedRecording {
        recording: entry.name(),
        paths: entry.paths.iter().map(|p| p.to_string_lossy().into_owned()).collect(),
        why: String::new(),
    }
}
