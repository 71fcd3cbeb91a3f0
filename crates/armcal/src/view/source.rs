//! Which pipeline made a folder of results.

use crate::error::Error;
use armcal_recording::{atomic, input};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Name of the file in the folder.
pub(crate) const FILE: &str = "view.toml";

#[derive(Serialize, Deserialize)]
struct Source {
    pipeline: PathBuf,
}

/// Leaves a note in `out` of where its pipeline is, as seen from there: both may move together, and the note does not
/// depend on where they are. A path that no text can hold is not noted.
pub fn remember(out: &Path, pipeline: &Path) -> Result<(), Error> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let (folder, pipeline) = (real(out), real(pipeline));
    let path = pathdiff::diff_paths(&pipeline, folder).unwrap_or(pipeline);
    let Ok(text) = toml::to_string(&Source { pipeline: path }) else { return Ok(()) };
    let text = format!("# Where `armcal view` finds the pipeline of these results.\n{text}");
    atomic::write(&out.join(FILE), text.as_bytes()).map_err(Error::Output)
}

/// The pipeline behind a folder of results; a pipeline file is itself.
pub fn pipeline_of(input: &Path) -> Result<PathBuf, Error> {
    if input.extension().is_some_and(|e| e == "toml") {
        return Ok(input.to_owned());
    }
    let path = input.join(FILE);
    let text = input::read_to_string(&path)
        .map_err(|source| Error::NoSource { folder: input.to_owned(), source: Box::new(source) })?;
    let source: Source = toml::from_str(&text)
        .map_err(|e| Error::NoSource { folder: input.to_owned(), source: Box::new(e) })?;
    Ok(input.join(source.pipeline))
}
