//! From the text of a pipeline to a checked one.

use crate::contradictions::{in_recordings, in_sections};
use crate::{ConfigError, Pipeline, load_two_arms, read_text};
use armcal_recording::input::{self, Kind};
use armcal_recording::{files_of, is_url};
use std::path::{Path, PathBuf};

/// Text that is no TOML is nobody's; its syntax error is told by whoever parses it.
fn is_of_two_arms(text: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("arms"))
}

impl Pipeline {
    /// Reads and checks a pipeline file.
    pub fn load(path: &Path) -> Result<Pipeline, ConfigError> {
        let text = read_text("pipeline", Kind::Text, path)?;
        Pipeline::parse(path, text, path.parent().unwrap_or(Path::new("")))
    }

    /// The same for recordings that are named elsewhere; the pipeline's own are left out.
    pub fn load_for_others(path: &Path) -> Result<Pipeline, ConfigError> {
        let text = read_text("pipeline", Kind::Text, path)?;
        let mut pipeline = Pipeline::read(path, text, path.parent().unwrap_or(Path::new("")))?;
        pipeline.note_inputs();
        pipeline.recordings.clear();
        in_sections(&pipeline, path)?;
        Ok(pipeline)
    }

    /// Reads and checks the text of a pipeline whose relative paths start in `folder`.
    pub fn parse(path: &Path, text: String, folder: &Path) -> Result<Pipeline, ConfigError> {
        let pipeline = Pipeline::proposed(path, text, folder)?;
        pipeline.note_inputs();
        Ok(pipeline)
    }

    /// The same of one whose files may not be written yet: they are no inputs.
    pub fn proposed(path: &Path, text: String, folder: &Path) -> Result<Pipeline, ConfigError> {
        let pipeline = Pipeline::read(path, text, folder)?;
        in_recordings(&pipeline, path)?;
        in_sections(&pipeline, path)?;
        Ok(pipeline)
    }

    fn read(path: &Path, text: String, folder: &Path) -> Result<Pipeline, ConfigError> {
        let mut pipeline = match is_of_two_arms(&text) {
            true => load_two_arms::parse(path, &text)?,
            false => toml::from_str(&text)
                .map_err(|source| ConfigError::Syntax { path: path.to_owned(), source: Box::new(source) })?,
        };
        let gauges = pipeline.measure.iter();
        pipeline.streams.gauges =
            gauges.filter_map(|m| Some((m.name().to_owned(), m.reading.clone()?))).collect();
        pipeline.folder = folder.to_owned();
        pipeline.text = text;
        pipeline.open_folders();
        Ok(pipeline)
    }

    /// Puts the files of a bag in the place of its folder.
    fn open_folders(&mut self) {
        for entry in &mut self.recordings {
            let is_folder = |p: &PathBuf| !is_url(p) && self.folder.join(p).is_dir();
            if entry.paths.iter().any(is_folder) {
                entry.name = Some(entry.name());
                let paths: Vec<PathBuf> =
                    entry.paths.iter().map(|p| armcal_recording::resolve_path(&self.folder, p)).collect();
                entry.paths = files_of(&paths);
            }
        }
    }

    /// Notes every file that the pipeline names, so that no output is begun in its place.
    fn note_inputs(&self) {
        let model = self.models().into_iter().flat_map(|model| [&model.dh, &model.urdf]).flatten();
        let board = self.table.iter().map(|table| &table.board);
        let recordings = self.recordings.iter().flat_map(|entry| &entry.paths);
        model.chain(board).chain(recordings).for_each(|path| input::register_path(&self.resolve(path)));
        if let Some(reference) = &self.check.reference {
            let reference = self.resolve(reference);
            let inside = ["summary.json", "run.mcap"].map(|name| reference.join(name));
            inside.iter().chain([&reference]).for_each(|path| input::register_path(path));
        }
    }
}
