//! Which files are recordings, by their names.

use super::table;
use std::path::{Path, PathBuf};

/// How the names of recordings end.
const ENDINGS: [&str; 7] = [".mcap", ".mcap.zst", ".mcap.zstd", ".db3", ".db3.zst", ".db3.zstd", ".bag"];

/// Whether a file is a recording, by its name.
pub fn is_recording(path: &Path) -> bool {
    recording_ending(path).is_some()
}

/// Whether a file is a table that is read as a recording where somebody names it; in a folder of recordings it may be anything.
pub fn is_table(path: &Path) -> bool {
    table_format(path).is_some()
}

/// What a table is written in.
pub(crate) fn table_format(path: &Path) -> Option<table::Format> {
    let name = path.file_name()?.to_str()?.to_lowercase();
    table::ENDINGS.into_iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, format)| format)
}

/// A path without the ending that makes it a recording, or without its extension.
pub fn without_ending(path: &Path) -> PathBuf {
    match (path.file_name().and_then(|name| name.to_str()), recording_ending(path)) {
        (Some(name), Some(ending)) => path.with_file_name(&name[..name.len() - ending.len()]),
        _ => path.with_extension(""),
    }
}

/// The recordings in a folder, such as the parts of a split bag, by name; of anything else itself.
pub fn recordings_at(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return vec![path.to_owned()];
    }
    let mut files: Vec<PathBuf> = entries_of(path).filter(|path| is_recording(path)).collect();
    if files.is_empty() && path.join("meta").join("info.json").is_file() {
        // Of a data set of LeRobot, its episodes.
        let chunks = entries_of(&path.join("data")).filter(|path| path.is_dir());
        files = chunks.flat_map(|chunk| entries_of(&chunk)).filter(|path| is_table(path)).collect();
    }
    files.sort();
    files
}

fn entries_of(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// The same, where a folder without any stands for itself, so that whoever opens it is told.
pub fn files_of(paths: &[PathBuf]) -> Vec<PathBuf> {
    let of = |path: &PathBuf| match recordings_at(path) {
        none if none.is_empty() => vec![path.clone()],
        files => files,
    };
    paths.iter().flat_map(of).collect()
}

fn recording_ending(path: &Path) -> Option<&'static str> {
    let name = path.file_name()?.to_str()?;
    ENDINGS.into_iter().find(|ending| name.len() > ending.len() && name.ends_with(ending))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_are_known_by_all_of_their_ending() {
        let stem = |name: &str| without_ending(Path::new(name)).to_string_lossy().into_owned();
        for (name, without) in [
            ("day/a_0.mcap", "day/a_0"),
            ("a_0.db3", "a_0"),
            ("s3://b/a.1.db3.zstd", "s3://b/a.1"),
            ("day/a.bag", "day/a"),
            ("a.mcap.zst", "a"),
        ] {
            assert!(is_recording(Path::new(name)), "{name}");
            assert_eq!(stem(name), without);
        }
        for name in ["a.toml", "a.db3-wal", "metadata.yaml", ".mcap", "a.zstd", "a.mcap.part"] {
            assert!(!is_recording(Path::new(name)), "{name}");
        }
        assert_eq!(stem("a.toml"), "a");
    }
}
