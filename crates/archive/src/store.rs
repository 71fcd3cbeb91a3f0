//! The folder of a campaign: one folder a result, which is there whole or not at all.

use crate::error::ArchiveError;
use armcal_campaign::Row;
use armcal_recording::{atomic, input, make_folder_in};
use armcal_report::ReportError;
use armcal_result::{DwellMark, OBSERVATIONS_FILE, StoredObservations};
use std::fs::File;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Where results are, below the campaign's folder.
const RESULTS: &str = "recordings";
const ROW: &str = "row.json";
/// Marks a folder under construction; locked by whoever works on it.
const LOCK: &str = ".lock";
/// Held while a folder under construction is made or taken away.
const GATE: &str = ".gate";
const UNFINISHED: &str = ".part";
/// Random characters in the name of a folder under construction.
const RANDOM_BYTES: usize = 6;

/// The results of a campaign.
pub(super) struct Store {
    results: PathBuf,
}

/// A result under construction: dropped, it disappears.
pub(super) struct Unfinished {
    folder: TempDir,
    _lock: File,
}

impl Store {
    /// Opens the folder, made if need be, and takes away what killed processes left unfinished.
    ///
    /// # Errors
    /// A folder that cannot be made.
    pub fn open(out: &Path) -> Result<Store, ArchiveError> {
        let results = make_folder_in(out, RESULTS).map_err(ArchiveError::Output)?;
        let store = Store { results };
        store.sweep();
        Ok(store)
    }

    /// Name of a result's folder: readable, and unique by its key.
    pub fn name(recording: &str, key: &str) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
        let readable: String = recording.chars().map(plain).take(80).collect();
        format!("{}-{}", readable.trim_start_matches('.'), &key[..16])
    }

    /// Whether a result is there.
    pub fn has(&self, folder: &str) -> bool {
        self.results.join(folder).join(ROW).is_file()
    }

    /// The row of a result.
    ///
    /// # Errors
    /// A row that is missing or not readable.
    pub fn row(&self, folder: &str) -> Result<Row, ArchiveError> {
        let path = self.results.join(folder).join(ROW);
        let bad = |why: String| ArchiveError::Campaign { path: path.clone(), why };
        let text = input::read_to_string(&path, input::Kind::Data)
            .map_err(|e| bad(format!("{e}; map its shard again")))?;
        serde_json::from_str(&text).map_err(|e| bad(e.to_string()))
    }

    /// What the dwells of a result are recognised by.
    ///
    /// # Errors
    /// Observations that are missing or not readable.
    pub fn marks(&self, folder: &str) -> Result<Vec<DwellMark>, ArchiveError> {
        let past = StoredObservations::open(&self.results.join(folder).join(OBSERVATIONS_FILE))?;
        Ok(past.recordings.iter().flat_map(|r| r.marks()).collect())
    }

    /// A place to make a result in.
    ///
    /// # Errors
    /// A folder that cannot be made or locked.
    pub fn begin(&self) -> Result<Unfinished, ArchiveError> {
        let at = |source| ArchiveError::Folder { path: self.results.clone(), source };
        let _gate = self.gate().map_err(at)?;
        let mut folder = tempfile::Builder::new();
        let folder = folder
            .prefix(".")
            .suffix(UNFINISHED)
            .rand_bytes(RANDOM_BYTES)
            .tempdir_in(&self.results)
            .map_err(at)?;
        let lock = lock_file(&folder.path().join(LOCK)).map_err(at)?;
        lock.lock().map_err(at)?;
        Ok(Unfinished { folder, _lock: lock })
    }

    /// Finishes a result: its files are on disk, now it gets its name. Where another process was faster its result, made
    /// from the same, stays.
    ///
    /// # Errors
    /// A row that cannot be written, a folder that cannot be renamed.
    pub fn finish(&self, made: Unfinished, row: &Row, folder: &str) -> Result<(), ArchiveError> {
        let target = self.results.join(folder);
        let at = |source| ArchiveError::Folder { path: target.clone(), source };
        write_one(&made.path().join(ROW), &serde_json::to_vec_pretty(row).map_err(ArchiveError::Json)?)?;
        readable_by_all(made.path()).map_err(at)?;
        match publish_folder(made.path(), &target) {
            Ok(()) => {
                // It has another name now, under which it stays.
                let _ = made.folder.keep();
                Ok(())
            }
            Err(_) if self.has(folder) => Ok(()),
            Err(e) => Err(at(e)),
        }
    }

    /// Nobody sees a folder before its lock is held.
    fn gate(&self) -> std::io::Result<File> {
        let gate = lock_file(&self.results.join(GATE))?;
        gate.lock()?;
        Ok(gate)
    }

    /// Takes away unfinished results whose makers are gone: a living one holds its lock.
    fn sweep(&self) {
        let Ok(_gate) = self.gate() else { return };
        for entry in std::fs::read_dir(&self.results).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let random = name.strip_prefix('.').and_then(|rest| rest.strip_suffix(UNFINISHED));
            if random.is_some_and(|r| r.len() == RANDOM_BYTES && r.bytes().all(|b| b.is_ascii_alphanumeric()))
            {
                remove_abandoned(&entry.path());
            }
        }
    }
}

impl Unfinished {
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// A result's folder as seen from the campaign's.
pub(super) fn result_path(folder: &str) -> String {
    format!("{RESULTS}/{folder}")
}

/// Writes a file whole or not at all.
pub(super) fn write_one(path: &Path, bytes: &[u8]) -> Result<(), ArchiveError> {
    let failed = |source| ReportError::Write { path: path.to_owned(), source: Box::new(source) };
    Ok(atomic::write(path, bytes).map_err(failed)?)
}

/// A file to be locked, made if need be; what is in it stays. A link is not followed, and nothing else waited for.
#[allow(clippy::disallowed_methods, reason = "nothing is written to it")]
fn lock_file(path: &Path) -> std::io::Result<File> {
    let made = File::options().create_new(true).write(true).open(path);
    match made {
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists && !path.is_symlink() => {
            input::open_regular(path)
        }
        made => made,
    }
}

/// Gives a finished folder its name. A folder with anything in it is never replaced: the system refuses that.
#[allow(clippy::disallowed_methods, reason = "the lock is armcal's own, and so is the folder")]
fn publish_folder(made: &Path, target: &Path) -> std::io::Result<()> {
    std::fs::remove_file(made.join(LOCK))?;
    std::fs::rename(made, target)?;
    // The rename itself must survive a power cut too; not every file system can sync a folder.
    if let Some(Ok(results)) = target.parent().map(File::open) {
        let _ = results.sync_all();
    }
    Ok(())
}

/// Removes a folder under construction whose maker is gone. It is known by its lock or, in the moment when that is removed
/// already, by its row.
#[allow(clippy::disallowed_methods, reason = "the folder is armcal's own")]
fn remove_abandoned(folder: &Path) {
    let free = match input::open_regular(&folder.join(LOCK)) {
        Ok(lock) => lock.try_lock().is_ok(),
        // Between removing the lock and renaming.
        Err(_) => folder.join(ROW).is_file() && is_stale(folder),
    };
    if free {
        let _ = std::fs::remove_dir_all(folder);
    } else if is_stale(folder) {
        // Killed before there was a lock: empty, or not ours.
        let _ = std::fs::remove_dir(folder);
    }
}

/// Older than any such moment takes.
fn is_stale(path: &Path) -> bool {
    let modified = std::fs::metadata(path).and_then(|about| about.modified());
    modified.is_ok_and(|t| t.elapsed().is_ok_and(|age| age.as_secs() > 600))
}

/// Temporary folders are for their maker alone; results are for everybody the umask lets in.
#[cfg(unix)]
fn readable_by_all(folder: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt as _;
    let like = folder.parent().map(std::fs::metadata).transpose()?;
    let mode = like.map_or(0o755, |about| about.permissions().mode());
    std::fs::set_permissions(folder, std::fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn readable_by_all(_: &Path) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
#[path = "store_tests.rs"]
mod tests;
