//! The logs that stand beside a database.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Such files have the name of their database with these endings.
const ENDINGS: [&str; 2] = ["-wal", "-journal"];

/// Those of a database that are there and hold anything, with their endings.
pub(crate) fn logs_of(database: &Path) -> Vec<(&'static str, PathBuf)> {
    let beside = |ending: &'static str| (ending, path_beside(database, ending));
    let all = ENDINGS.into_iter().map(beside);
    all.filter(|(_, path)| std::fs::metadata(path).is_ok_and(|about| about.len() > 0)).collect()
}

pub(crate) fn path_beside(file: &Path, ending: &str) -> PathBuf {
    let mut name = OsString::from(file);
    name.push(ending);
    PathBuf::from(name)
}
