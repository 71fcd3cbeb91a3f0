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
    /// Folders of earlier results, of a pool.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    results: Vec<PathBuf>,
}

/// Leaves a note in `out` of where its pipeline is, and the results that it pools, as seen from there: both may move together, and the note does not
/// depend on where they are. A path that no text can hold is not noted.
pub fn remember(out: &Path, pipeline: &Path, results: &[PathBuf]) -> Result<(), Error> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = real(out);
    let seen = |path: &Path| pathdiff::diff_paths(real(path), &folder).unwrap_or_else(|| real(path));
    let source = Source { pipeline: seen(pipeline), results: results.iter().map(|r| seen(r)).collect() };
    let Ok(text) = toml::to_string(&source) else { return Ok(()) };
    let text = format!("# armcal.view/1\n# Where `armcal view` finds the pipeline of these results.\n{text}");
    atomic::write(&out.join(FILE), text.as_bytes()).map_err(Error::Output)
}

/// The pipeline behind a folder of results, and the results that it pools; a pipeline file is itself.
pub fn source_of(input: &Path) -> Result<(PathBuf, Vec<PathBuf>), Error> {
    if input.extension().is_some_and(|e| e == "toml") {
        return Ok((input.to_owned(), Vec::new()));
    }
    let path = input.join(FILE);
    let unknown = |why: String| Error::Result {
        path: input.to_owned(),
        problem: format!(
            "does not say which pipeline made it (view.toml: {why}); name the pipeline file instead"
        ),
    };
    let text = input::read_to_string(&path, input::Kind::Data).map_err(|e| unknown(e.to_string()))?;
    let source: Source = toml::from_str(&text).map_err(|e| unknown(e.to_string()))?;
    Ok((input.join(source.pipeline), source.results.iter().map(|r| input.join(r)).collect()))
}
