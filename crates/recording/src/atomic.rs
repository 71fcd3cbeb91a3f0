//! Files that appear whole or not at all.

use crate::RecordingError;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file under construction: written under a temporary name in the folder of its target, synced and renamed by
/// [`AtomicFile::commit`]. Dropped without that, it disappears and the target stays as it was.
#[derive(Debug)]
pub struct AtomicFile {
    temporary: NamedTempFile,
    target: PathBuf,
}

impl AtomicFile {
    /// Starts the file that will be at `target`. Its folder must exist.
    pub fn create(target: &Path) -> Result<AtomicFile, RecordingError> {
        let refused = |why: String| RecordingError::Write { path: target.to_owned(), why };
        let Some(name) = target.file_name().filter(|_| !target.is_dir()) else {
            return Err(refused("it is a folder, not a file name".into()));
        };
        let mut builder = tempfile::Builder::new();
        let prefix = format!(".{}.", name.to_string_lossy());
        builder.prefix(&prefix).suffix(".part");
        // Like any newly created file: readable by all, as far as the umask lets it.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let temporary = builder.tempfile_in(folder(target)).map_err(|e| refused(e.to_string()))?;
        Ok(AtomicFile { temporary, target: target.to_owned() })
    }

    /// Where the file will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Syncs the file to disk and gives it its name, replacing whatever was there.
    pub fn commit(self) -> Result<(), RecordingError> {
        let target = self.target;
        let refused = |e: io::Error| RecordingError::Write { path: target.clone(), why: e.to_string() };
        self.temporary.as_file().sync_all().map_err(refused)?;
        self.temporary.persist(&target).map_err(|e| refused(e.error))?;
        // The rename itself must survive a power cut too; not every file system can sync a folder.
        if let Ok(folder) = File::open(folder(&target)) {
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

/// Writes a whole file atomically.
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), RecordingError> {
    let mut file = AtomicFile::create(target)?;
    let refused = |e: io::Error| RecordingError::Write { path: target.to_owned(), why: e.to_string() };
    file.write_all(bytes).map_err(refused)?;
    file.commit()
}

fn folder(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("the folder is there");
        entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_dropped_file_leaves_the_old_one_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let target = folder.path().join("out.bin");
        write(&target, b"old").expect("writable");
        let mut file = AtomicFile::create(&target).expect("writable");
        file.write_all(b"half of the n").expect("written");
        assert_eq!(names(folder.path()).len(), 2);
        drop(file);
        assert_eq!(names(folder.path()), ["out.bin"]);
        assert_eq!(std::fs::read(&target).expect("readable"), b"old");
        write(&target, b"new").expect("writable");
        assert_eq!(std::fs::read(&target).expect("readable"), b"new");
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let error = write(&folder.path().join("no/such/out.bin"), b"x").expect_err("no such folder");
        assert!(error.to_string().contains("no/such/out.bin"), "{error}");
        assert!(write(folder.path(), b"x").expect_err("a folder").to_string().contains("folder"));
    }
}
