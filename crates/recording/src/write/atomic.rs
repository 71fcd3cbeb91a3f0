//! Files that appear whole or not at all.
//!
//! A file is written under a hidden name beside its own, `.NAME.xxxxxx.part`, and renamed when it is complete. Its writer
//! holds a lock on it, which the system lets go when the process ends, however it ends: whoever writes the same file
//! next removes the parts that nobody holds any more.
//!
//! This is the one place that gives a file its name, and it asks the `guard` first: no input is written over, and nothing
//! else that armcal did not make.

#![allow(clippy::disallowed_methods, reason = "this is where outputs are written")]

use crate::RecordingError;
use crate::bytes::input;
use crate::write::guard::{self, Over};
use crate::write::seal::sealed_bytes;
use std::fs::{File, TryLockError};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

const SUFFIX: &str = ".part";
/// Random characters in the name of a part.
const RANDOM_BYTES: usize = 6;
/// Between making a part and locking it, another process may take it for abandoned; then another one is made.
const TRIES: usize = 10;

/// A file under construction: written under a temporary name in the folder of its target, synced and renamed by
/// [`AtomicFile::commit`]. Dropped without that, it disappears and the target stays as it was.
#[derive(Debug)]
pub struct AtomicFile {
    temporary: NamedTempFile,
    target: PathBuf,
    over: Over,
}

impl AtomicFile {
    /// Starts the file that will be at `target`. Its folder must exist.
    ///
    /// # Errors
    /// As [`crate::may_write`], and a folder that cannot be written.
    pub fn create(target: &Path) -> Result<AtomicFile, RecordingError> {
        AtomicFile::create_over(target, Over::Unchanged)
    }

    fn create_over(target: &Path, over: Over) -> Result<AtomicFile, RecordingError> {
        let refused = |why: String| RecordingError::Write { path: target.to_owned(), why };
        guard::may_write_over(target, over)?;
        let Some(name) = target.file_name() else {
            return Err(refused("it is a folder, not a file name".into()));
        };
        let mut builder = tempfile::Builder::new();
        let prefix = format!(".{}.", name.to_string_lossy());
        builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM_BYTES);
        // Like any newly created file: readable by all, as far as the umask lets it.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        remove_abandoned(parent_folder(target), &prefix);
        for _ in 0..TRIES {
            let temporary = builder.tempfile_in(parent_folder(target)).map_err(|e| refused(e.to_string()))?;
            // Where a file system knows no locks, no part is ever removed by another process.
            let locked = temporary.as_file().try_lock();
            let held = !matches!(locked, Err(TryLockError::WouldBlock)) && temporary.path().exists();
            if held {
                return Ok(AtomicFile { temporary, target: target.to_owned(), over });
            }
        }
        Err(refused("another process keeps removing its unfinished file".into()))
    }

    /// Where the file will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Whether the finished file may take its place; [`AtomicFile::commit`] asks again.
    ///
    /// # Errors
    /// As [`crate::may_write`], and a result of another kind at the target.
    pub fn may_commit(&self) -> Result<(), RecordingError> {
        guard::may_replace(&self.target, self.temporary.path(), self.over).map(drop)
    }

    /// Syncs the file to disk and gives it its name, replacing an earlier result of the same kind.
    ///
    /// # Errors
    /// As [`AtomicFile::may_commit`], and what the system refuses.
    pub fn commit(self) -> Result<(), RecordingError> {
        let AtomicFile { target, mut temporary, over } = self;
        let refused = |e: io::Error| RecordingError::Write { path: target.clone(), why: e.to_string() };
        temporary.as_file().sync_all().map_err(refused)?;
        let mut tries = 0..TRIES;
        loop {
            if guard::may_replace(&target, temporary.path(), over)? {
                temporary.persist(&target).map_err(|e| refused(e.error))?;
                break;
            }
            // What somebody else puts there meanwhile is looked at as well.
            match temporary.persist_noclobber(&target) {
                Ok(_) => break,
                Err(e) if e.error.kind() == io::ErrorKind::AlreadyExists && tries.next().is_some() => {
                    temporary = e.file;
                }
                // Not every file system can rename only where nothing is.
                Err(e) => {
                    e.file.persist(&target).map_err(|e| refused(e.error))?;
                    break;
                }
            }
        }
        // The rename itself must survive a power cut too; not every file system can sync a folder.
        if let Ok(folder) = File::open(parent_folder(&target)) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.temporary.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.temporary.flush()
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.temporary.seek(to)
    }
}

/// Writes a whole file atomically; the mark of a text gets its hash. A file that has just this content already is left as it is.
///
/// # Errors
/// As [`AtomicFile::create`] and [`AtomicFile::commit`].
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), RecordingError> {
    write_over(target, bytes, Over::Unchanged)
}

/// The same where it is said what may be lost.
///
/// # Errors
/// As [`write`].
pub fn write_over(target: &Path, bytes: &[u8], over: Over) -> Result<(), RecordingError> {
    let bytes = &sealed_bytes(bytes);
    if guard::is_there(target, bytes)? {
        return Ok(());
    }
    let mut file = AtomicFile::create_over(target, over)?;
    let refused = |e: io::Error| RecordingError::Write { path: target.to_owned(), why: e.to_string() };
    file.write_all(bytes).map_err(refused)?;
    file.commit()
}

/// Removes what writers of the same file left when they were killed. What cannot be looked at is left alone: the file
/// itself can be written all the same.
fn remove_abandoned(folder: &Path, prefix: &str) {
    for entry in folder.read_dir().into_iter().flatten().flatten() {
        let name = entry.file_name();
        let random = name.to_str().and_then(|n| n.strip_prefix(prefix)?.strip_suffix(SUFFIX));
        let is_part =
            random.is_some_and(|r| r.len() == RANDOM_BYTES && r.bytes().all(|b| b.is_ascii_alphanumeric()));
        let may_be_ours = is_part && entry.file_type().is_ok_and(|t| t.is_file());
        if !may_be_ours || input::registered_path(&entry.path()).is_some() {
            continue;
        }
        if let Ok(file) = File::open(entry.path())
            && file.try_lock().is_ok()
        {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

fn parent_folder(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file that says that it is of the same kind as the others.
    fn marked(text: &str) -> Vec<u8> {
        sealed_bytes(format!("# armcal.test/1\n{text}").as_bytes()).into_owned()
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("the folder is there");
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_dropped_file_leaves_the_old_one_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("out.bin");
        write(&target, &marked("old")).expect("writable");
        let mut file = AtomicFile::create(&target).expect("writable");
        file.write_all(b"half of the n").expect("written");
        assert_eq!(names(folder.path()).len(), 2);
        drop(file);
        assert_eq!(names(folder.path()), ["out.bin"]);
        assert_eq!(std::fs::read(&target).expect("readable"), marked("old"));
        write(&target, &marked("new")).expect("writable");
        assert_eq!(std::fs::read(&target).expect("readable"), marked("new"));
    }

    #[test]
    fn parts_of_the_dead_are_removed_and_those_of_the_living_are_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let mut alive = AtomicFile::create(&path("out.bin")).expect("writable");
        alive.write_all(&marked("living")).expect("written");
        // A part that nobody holds, and files that only look like one: another target's, a user's, a folder.
        for name in [".out.bin.abc123.part", ".other.bin.abc123.part", ".out.bin.notes.part", ".out.bin.part"]
        {
            std::fs::write(path(name), b"half").expect("writable");
        }
        std::fs::create_dir(path(".out.bin.folder.part")).expect("writable");
        write(&path("out.bin"), &marked("whole")).expect("writable");
        let mut left = names(folder.path());
        left.retain(|name| !alive.temporary.path().ends_with(name));
        left.sort();
        let kept = [".other.bin.abc123.part", ".out.bin.folder.part", ".out.bin.notes.part", ".out.bin.part"];
        assert_eq!(left, [&kept[..], &["out.bin"]].concat());
        assert!(alive.temporary.path().exists());
        alive.commit().expect("the living one is still whole");
        assert_eq!(std::fs::read(path("out.bin")).expect("readable"), marked("living"));
    }

    #[test]
    fn many_writers_of_one_file_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("out.bin");
        std::thread::scope(|scope| {
            for writer in 0..8_u8 {
                let target = &target;
                let text = marked(&char::from(b'a' + writer).to_string().repeat(999));
                scope.spawn(move || (0..50).for_each(|_| write(target, &text).expect("written")));
            }
        });
        let bytes = std::fs::read(&target).expect("readable");
        let text = &bytes[marked("").len()..];
        assert!(text.len() == 999 && text.iter().all(|b| *b == text[0]));
        assert_eq!(names(folder.path()), ["out.bin"]);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = write(&folder.path().join("no/such/out.bin"), b"x").expect_err("no such folder");
        assert!(error.to_string().contains("no/such/out.bin"), "{error}");
        assert!(write(folder.path(), b"x").expect_err("a folder").to_string().contains("folder"));
    }
}
