//! The sections of a proposal, in the order of a pipeline file.

mod arm;
mod streams;
mod table;

use super::known::Known;
use super::page::Page;
use armcal_recording::seal_text;
use std::path::PathBuf;

/// A proposal on its way to its text.
pub struct Draft<'a> {
    /// What was found out.
    pub known: &'a Known<'a>,
    /// The text so far.
    pub page: Page,
    /// Folder of the pipeline.
    pub folder: PathBuf,
    /// Files that it names and that are still to be written.
    pub beside: Vec<(PathBuf, String)>,
    /// What may be otherwise.
    pub unsure: Vec<String>,
    /// What nothing shows.
    pub unseen: Vec<String>,
}

impl Draft<'_> {
    /// Notes a file that goes beside the pipeline, named after it.
    fn beside(&mut self, ending: &str, text: String) -> PathBuf {
        let stem = self.known.asked.out.file_stem().unwrap_or_default().to_string_lossy();
        let path = self.folder.join(format!("{stem}{ending}"));
        self.beside.push((path.clone(), seal_text(&text).into_owned()));
        path
    }
}
