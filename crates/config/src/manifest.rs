//! Which recordings: from globs, files and bag folders, or from a manifest file.

use super::pattern::matching_paths;
use crate::{ConfigError, RecordingEntry};
use armcal_recording::{
    input, is_recording, is_table, is_url, list_objects, recordings_at, resolve_path, without_ending,
};
use armcal_table::Tilt;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Recordings in a fixed order, with unique names and absolute paths.
#[derive(Debug, Clone)]
pub struct Manifest {
    /// The recordings.
    pub entries: Vec<RecordingEntry>,
    /// The pipeline that the manifest file names.
    pub pipeline: Option<PathBuf>,
}

/// A manifest in TOML.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ManifestFile {
    pipeline: Option<PathBuf>,
    recordings: Vec<RecordingEntry>,
}

impl Manifest {
    /// From what a user types: one manifest file, or any number of globs, recordings and folders of split bags. Files
    /// below `out` are results and not taken.
    ///
    /// # Errors
    /// Nothing found, a pattern that is none, a manifest among other inputs, a name given twice.
    pub fn of(inputs: &[String], out: &Path) -> Result<Manifest, ConfigError> {
        match inputs {
            [one] if is_manifest(Path::new(one)) => Manifest::read(Path::new(one)),
            _ => Manifest::found(inputs, out),
        }
    }

    /// Reads a manifest file: TOML with `[[recordings]]` as in a pipeline, or one path a line. Paths are relative to it.
    ///
    /// # Errors
    /// A file that cannot be read, a syntax error with its line, no recording, a name given twice.
    pub fn read(path: &Path) -> Result<Manifest, ConfigError> {
        let at = |source| ConfigError::ReadFile { what: "manifest", path: path.to_owned(), source };
        let text = input::read_to_string(path, input::Kind::Data).map_err(at)?;
        let folder = std::path::absolute(path).map_err(at)?;
        let folder = folder.parent().unwrap_or(Path::new("")).to_owned();
        let file = if path.extension().is_some_and(|e| e == "toml") {
            toml::from_str(&text)
                .map_err(|source| ConfigError::Syntax { path: path.to_owned(), source: Box::new(source) })?
        } else {
            let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
            ManifestFile {
                pipeline: None,
                recordings: lines.map(|line| unnamed_entry(vec![line.into()])).collect(),
            }
        };
        let mut entries = file.recordings;
        for entry in &mut entries {
            if let Some(points) = &mut entry.points {
                points.csv = resolve_path(&folder, &points.csv);
            }
            entry.paths = entry.paths.iter().flat_map(|p| recordings_at(&resolve_path(&folder, p))).collect();
        }
        let pipeline = file.pipeline.map(|p| folder.join(p));
        Manifest { entries, pipeline }.checked(&path.display().to_string())
    }

    fn found(inputs: &[String], out: &Path) -> Result<Manifest, ConfigError> {
        let out = std::path::absolute(out).unwrap_or_else(|_| out.to_owned());
        let mut files = Vec::new();
        for input in inputs {
            let bad = |why: String| ConfigError::Recordings { what: input.clone(), why };
            if is_manifest(Path::new(input)) {
                return Err(bad("a manifest file must be the only input".into()));
            }
            let before = files.len();
            if is_url(Path::new(input)) {
                files.extend(
                    list_objects(input).map_err(|e| bad(e.to_string()))?.into_iter().map(PathBuf::from),
                );
            } else {
                for found in matching_paths(input).map_err(bad)? {
                    let found = std::path::absolute(&found).unwrap_or(found);
                    files.extend(recordings_below(&found).into_iter().filter(|p| !p.starts_with(&out)));
                }
            }
            if files.len() == before {
                return Err(bad("matches no recording; quote a pattern such as 'lab/**/*.mcap'".into()));
            }
        }
        files.sort();
        files.dedup();
        Manifest { entries: as_bags(files), pipeline: None }.checked(&inputs.join(" "))
    }

    /// Gives every recording a name of its own.
    fn checked(mut self, what: &str) -> Result<Manifest, ConfigError> {
        let bad = |why: String| Err(ConfigError::Recordings { what: what.to_owned(), why });
        if let Some(i) = self.entries.iter().position(|e| e.paths.is_empty()) {
            return bad(format!("recording {} has no paths", i + 1));
        }
        if self.entries.is_empty() {
            return bad("names no recording".into());
        }
        name_all(&mut self.entries);
        let mut known = BTreeMap::new();
        for (i, entry) in self.entries.iter().enumerate() {
            if let Some(first) = known.insert(entry.name(), i) {
                let (name, first, second) = (entry.name(), first + 1, i + 1);
                return bad(format!(
                    "recordings {first} and {second} are both called `{name}`; give one of them another name"
                ));
            }
        }
        Ok(self)
    }
}

/// Anything but a recording, a folder or a pattern.
fn is_manifest(path: &Path) -> bool {
    path.is_file() && !is_recording(path) && !is_table(path)
}

/// The recordings in a folder, and those of the rosbag2 folders in it; of anything else itself. A folder that cannot be looked
/// into stands for itself too, so that whoever opens it is told.
pub fn recordings_below(path: &Path) -> Vec<PathBuf> {
    if is_closed(path) {
        return vec![path.to_owned()];
    }
    let inside = std::fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut bags: Vec<PathBuf> =
        inside.filter(|p| p.join("metadata.yaml").is_file() || is_closed(p)).collect();
    bags.sort();
    let of_bag = |bag: &PathBuf| if is_closed(bag) { vec![bag.clone()] } else { recordings_at(bag) };
    recordings_at(path).into_iter().chain(bags.iter().flat_map(of_bag)).collect()
}

/// Whether it is a folder that cannot be looked into.
fn is_closed(path: &Path) -> bool {
    path.is_dir() && std::fs::read_dir(path).is_err()
}

/// Files beside a rosbag2 `metadata.yaml` are one recording; every other file is one by itself.
fn as_bags(files: Vec<PathBuf>) -> Vec<RecordingEntry> {
    let mut bags: Vec<(PathBuf, Vec<PathBuf>)> = Vec::new();
    for file in files {
        let bag = bag_of(&file).unwrap_or(&file).to_owned();
        match bags.last_mut() {
            Some((last, parts)) if *last == bag => parts.push(file),
            _ => bags.push((bag, vec![file])),
        }
    }
    bags.into_iter().map(|(_, parts)| unnamed_entry(parts)).collect()
}

/// The folder of the bag that a file is a part of, which rosbag2 calls as it was asked to, its parts `NAME_0`, `NAME_1`, ..
fn bag_of(file: &Path) -> Option<&Path> {
    file.parent().filter(|folder| folder.join("metadata.yaml").is_file())
}

fn unnamed_entry(paths: Vec<PathBuf>) -> RecordingEntry {
    RecordingEntry { name: None, paths, tilt: Tilt::default(), load_kg: 0.0, loads: Vec::new(), points: None }
}

/// Names without a name after as many of their last folders as it takes to tell them apart.
fn name_all(entries: &mut [RecordingEntry]) {
    let parts = |entry: &RecordingEntry| -> Vec<String> {
        let file = &entry.paths[0];
        let path = bag_of(file).map_or_else(|| without_ending(file), Path::to_owned);
        path.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect()
    };
    let parts: Vec<Vec<String>> = entries.iter().map(parts).collect();
    let stem = |parts: &[String], depth: usize| parts[parts.len().saturating_sub(depth)..].join("/");
    let deepest = entries.iter().map(|e| e.paths[0].components().count()).max().unwrap_or(1);
    for depth in 1..=deepest {
        let mut times: BTreeMap<String, usize> = BTreeMap::new();
        for (entry, parts) in entries.iter().zip(&parts) {
            *times.entry(entry.name.clone().unwrap_or_else(|| stem(parts, depth))).or_default() += 1;
        }
        for (entry, parts) in entries.iter_mut().zip(&parts).filter(|(e, _)| e.name.is_none()) {
            let name = stem(parts, depth);
            if times[&name] == 1 {
                entry.name = Some(name);
            }
        }
    }
}

#[cfg(test)]
#[path = "manifest_tests.rs"]
mod tests;
