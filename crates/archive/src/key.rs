//! What a result is made from: the files, what is declared about them, the pipeline, the version.

use crate::error::ArchiveError;
use armcal_config::ConfigError;
use armcal_config::{Manifest, Pipeline, RecordingEntry};
use armcal_recording::{atomic, identity_of, input, make_folder_in, read_with};
use armcal_result::{VERSION, hash_of_parts};
use armcal_stages::RunError;
use serde::{Deserialize, Serialize};
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// Raised when results made from the same would be written differently.
const FORMAT: &str = "armcal.batch/3";
/// Format of what is remembered of a file.
const SCHEMA: &str = "armcal.seen/3";
/// A longer note is none of armcal's.
const NOTE_BYTES: u64 = 64 << 10;
/// Where the hashes of files are remembered, below the campaign's folder.
const SEEN: &str = ".inputs";

/// Makes the keys of a campaign's recordings.
pub(super) struct Keys {
    /// Hash of everything that is the same for all recordings.
    common: String,
    /// Folder of the campaign.
    out: PathBuf,
}

/// A file as it was when its hash was taken.
#[derive(PartialEq, Serialize, Deserialize)]
struct Seen {
    #[serde(default)]
    schema: String,
    path: String,
    /// Size and time of the last change of the file, and of those beside it that are read with it.
    sizes: Vec<(u64, u128)>,
    identity: String,
}

impl Keys {
    /// # Errors
    /// A model or board file of the pipeline that cannot be read.
    pub fn new(pipeline: &Pipeline, full: bool, out: &Path) -> Result<Keys, ArchiveError> {
        let mut parts =
            vec![FORMAT.to_owned(), VERSION.to_owned(), full.to_string(), relevant_settings(&pipeline.text)];
        let models = pipeline.models().into_iter();
        let model = models.flat_map(|model| [&model.dh, &model.urdf]).flatten();
        let board = pipeline.table.iter().map(|t| &t.board);
        for (what, path) in model.map(|p| ("model", p)).chain(board.map(|p| ("board", p))) {
            let path = pipeline.resolve(path);
            let text = input::read_to_string(&path, input::Kind::Text);
            parts.push(text.map_err(|source| ConfigError::ReadFile { what, path, source })?);
        }
        Ok(Keys { common: hash_of_parts(parts), out: out.to_owned() })
    }

    /// The key of one recording.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn of_recording(&self, entry: &RecordingEntry) -> Result<String, ArchiveError> {
        let in_recording = |source| RunError::Recording { recording: entry.name(), source };
        let mut parts = vec![self.common.clone(), declaration_hash(entry)];
        for path in &entry.paths {
            parts.push(self.identity(path).map_err(in_recording)?);
        }
        Ok(hash_of_parts(parts))
    }

    /// What all shares of one campaign have in common: settings and manifest.
    pub fn of_campaign(&self, manifest: &Manifest) -> String {
        let path = |p: &PathBuf| p.to_string_lossy().into_owned();
        let entry = |e: &RecordingEntry| {
            hash_of_parts(std::iter::once(declaration_hash(e)).chain(e.paths.iter().map(path)))
        };
        hash_of_parts(std::iter::once(self.common.clone()).chain(manifest.entries.iter().map(entry)))
    }

    /// What a file holds, and what is read with it, as a hash; remembered as long as sizes and modification times stay.
    fn identity(&self, path: &Path) -> Result<String, armcal_recording::RecordingError> {
        let name = path.to_string_lossy().into_owned();
        let memory = self.out.join(SEEN).join(format!("{}.json", &hash_of_parts([name.clone()])[..32]));
        let (logs, description) = read_with(path);
        let beside = logs.iter().chain(&description).map(PathBuf::as_path);
        let sizes: Option<Vec<_>> = std::iter::once(path).chain(beside).map(size_and_mtime).collect();
        // Armcal's own notes, to be written over: no input.
        let known = input::open_regular(&memory)
            .ok()
            .and_then(|file| serde_json::from_reader::<_, Seen>(file.take(NOTE_BYTES)).ok());
        if let (Some(sizes), Some(known)) = (&sizes, known) {
            let same = known.schema == SCHEMA && known.path == name && known.sizes == *sizes;
            // A file system without modification times cannot tell.
            if same && sizes.iter().all(|(_, modified_ns)| *modified_ns != 0) {
                return Ok(known.identity);
            }
        }
        let own = identity_of(path)?;
        let identity = match description {
            None => own,
            Some(description) => hash_of_parts([own, identity_of(&description)?]),
        };
        if let Some(sizes) = sizes {
            let seen = Seen { schema: SCHEMA.to_owned(), path: name, sizes, identity: identity.clone() };
            // A memory that cannot be written costs time only.
            if let Ok(text) = serde_json::to_vec(&seen) {
                let _ = make_folder_in(&self.out, SEEN).and_then(|_| atomic::write(&memory, &text));
            }
        }
        Ok(identity)
    }
}

/// Size and time of the last change of a file; `None` of what is not there, such as an object.
fn size_and_mtime(path: &Path) -> Option<(u64, u128)> {
    let about = std::fs::metadata(path).ok()?;
    let modified = about.modified().ok().and_then(|t| t.duration_since(UNIX_EPOCH).ok());
    Some((about.len(), modified.map_or(0, |t| t.as_nanos())))
}

/// The pipeline without what says nothing about how a recording is worked on; a text that is no TOML as it is.
fn relevant_settings(text: &str) -> String {
    let Ok(mut table) = text.parse::<toml::Table>() else { return text.to_owned() };
    for section in ["recordings", "check", "verify"] {
        table.remove(section);
    }
    table.to_string()
}

fn declaration_hash(entry: &RecordingEntry) -> String {
    let RecordingEntry { tilt, load_kg, loads, points, .. } = entry;
    let points = points.as_ref().map_or(String::new(), |points| {
        let content = input::read_to_string(&points.csv, input::Kind::Data).unwrap_or_default();
        hash_of_parts([format!("{points:?}"), content])
    });
    let more: String = loads.iter().map(|load| format!(" {}:{:e}", load.at, load.kg)).collect();
    hash_of_parts([
        entry.name(),
        format!("{:e} {:e} {load_kg:e}{more}{points}", tilt.roll_rad, tilt.pitch_rad),
    ])
}
