//! A pipeline with more effects, in its own words.

use crate::error::Error;
use armcal_config::Pipeline;
use armcal_model::{EffectSpec, EffectTable, tables_toml};
use armcal_recording::{is_marked, may_put, seal_text};
use std::path::{Path, PathBuf};

/// First line of an extended pipeline whose original has no such line.
const MARK: &str = "# armcal.pipeline/1, extended by `armcal add`";
/// A pipeline with more effects, and where it is written.
pub struct Extended {
    /// The pipeline.
    pub pipeline: Pipeline,
    /// Its file.
    pub path: PathBuf,
}

/// Appends `[[effects]]` tables to the pipeline's own text, so that comments and order stay as the user wrote them.
///
/// `original` is the pipeline's file; the extended one goes to `write`, or beside it.
pub fn extend_pipeline(
    pipeline: &Pipeline,
    original: &Path,
    write: Option<&Path>,
    (new, sets): (&[EffectSpec], &[Vec<String>]),
) -> Result<Extended, Error> {
    let table = |effect: &EffectSpec| {
        let one_of = set_of(&effect.to_string(), sets).cloned().unwrap_or_default();
        EffectTable { one_of, ..EffectTable::from(effect) }
    };
    let tables = tables_toml(new.iter().map(table).collect()).map_err(Error::Toml)?;
    let text = format!("{}\n\n# Added by `armcal add`.\n{tables}", pipeline.text.trim_end());
    // By the mark its own maker knows the file again, and what somebody changes in it.
    let marked = if is_marked(&text) { text } else { format!("{MARK}\n{text}") };
    let text = seal_text(&marked).into_owned();
    let path = write.map_or_else(|| extended_path(original, new), Path::to_owned);
    let pipeline = Pipeline::parse(&path, text, &pipeline.folder)?;
    may_put(&path, pipeline.text.as_bytes()).map_err(Error::Output)?;
    Ok(Extended { pipeline, path })
}

/// The names that are the same answer as one, where there are several.
pub fn set_of<'s>(name: &str, sets: &'s [Vec<String>]) -> Option<&'s Vec<String>> {
    sets.iter().find(|set| set.len() > 1 && set.iter().any(|other| other == name))
}

/// `paper.toml` and `backlash:1` give `paper+backlash-1.toml`.
fn extended_path(pipeline: &Path, new: &[EffectSpec]) -> PathBuf {
    let stem = pipeline.file_stem().unwrap_or_default().to_string_lossy();
    let safe = |c: char| if c.is_ascii_alphanumeric() || "_.".contains(c) { c } else { '-' };
    let names: String =
        new.iter().map(|e| format!("+{}", e.to_string().chars().map(safe).collect::<String>())).collect();
    pipeline.with_file_name(format!("{stem}{names}.toml"))
}
