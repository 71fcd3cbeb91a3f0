//! Which pipeline made a folder of results.

use crate::error::Error;
use armcal_recording::{atomic, input};
use armcal_result::{Conclusions, RUN, StoredResultError};
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
pub fn write_source_file(out: &Path, pipeline: &Path, results: &[PathBuf]) -> Result<(), Error> {
    let real = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = real(out);
    let seen = |path: &Path| pathdiff::diff_paths(real(path), &folder).unwrap_or_else(|| real(path));
    let source = Source { pipeline: seen(pipeline), results: results.iter().map(|r| seen(r)).collect() };
    let Ok(text) = toml::to_string(&source) else { return Ok(()) };
    let text = format!("# armcal.view/1\n# Where `armcal view` finds the pipeline of these results.\n{text}");
    atomic::write(&out.join(FILE), text.as_bytes()).map_err(Error::Output)
}

/// A pipeline to work on, named by its file or by the results that it gave.
pub struct Given {
    /// The pipeline file.
    pub pipeline: PathBuf,
    /// The results that it pools.
    pub results: Vec<PathBuf>,
    /// What the run concluded whose results were named.
    pub concluded: Option<Conclusions>,
    /// The results that were named.
    pub run: Option<PathBuf>,
}

impl Given {
    /// By a pipeline file, a `run.mcap`, or its folder.
    pub fn by(input: &Path) -> Result<Given, Error> {
        let (pipeline, results) = source_of(input)?;
        let run = (pipeline != input).then(|| input.to_owned());
        let concluded = run.as_deref().map(Conclusions::open).transpose()?.flatten();
        Ok(Given { pipeline, results, concluded, run })
    }

    /// The same of what is no pool. What has no note of its pipeline is read as one, to be refused for what it is.
    pub fn alone(input: &Path) -> Result<Given, Error> {
        if folder_of(input).is_none_or(|folder| !folder.join(FILE).exists()) {
            return Ok(Given { pipeline: input.to_owned(), results: Vec::new(), concluded: None, run: None });
        }
        let given = Given::by(input)?;
        if given.results.is_empty() {
            return Ok(given);
        }
        let problem =
            "it pools other results, and this is asked of a pipeline with recordings; name one".to_owned();
        Err(StoredResultError::Unusable { path: input.to_owned(), problem }.into())
    }
}

/// The folder of results that a path means, if it does: itself, or that of a `run.mcap`.
fn folder_of(input: &Path) -> Option<&Path> {
    match input.is_dir() {
        // Where a pipeline is meant it is refused as a folder.
        true => Some(input).filter(|_| input.extension().is_none_or(|e| e != "toml")),
        false => input.parent().filter(|_| input.file_name().is_some_and(|name| name == RUN)),
    }
}

/// The pipeline behind results, and the results that it pools; a pipeline file is itself.
fn source_of(input: &Path) -> Result<(PathBuf, Vec<PathBuf>), Error> {
    let Some(folder) = folder_of(input) else { return Ok((input.to_owned(), Vec::new())) };
    let path = folder.join(FILE);
    let unknown = |why: String| StoredResultError::Unusable {
        path: input.to_owned(),
        problem: format!(
            "does not say which pipeline made it (view.toml: {why}); name the pipeline file instead"
        ),
    };
    let text = input::read_to_string(&path, input::Kind::Data).map_err(|e| unknown(e.to_string()))?;
    let source: Source = toml::from_str(&text).map_err(|e| unknown(e.to_string()))?;
    Ok((folder.join(source.pipeline), source.results.iter().map(|r| folder.join(r)).collect()))
}
