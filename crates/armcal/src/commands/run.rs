//! `armcal run`: the main job.

use super::{Outcome, print, style};
use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::progress::Progress;
use crate::{story, view};
use armcal_report::{Status, summary_json, terminal, write_all};
use std::path::Path;

/// Runs a pipeline, writes all results to `out`, prints the table (or the summary as JSON).
pub fn run(path: &Path, out: &Path, json: bool) -> Result<Outcome, Error> {
    let pipeline = Pipeline::load(path)?;
    let progress = Progress::new();
    let (run, recordings) = story::run(&pipeline, &progress)?;
    progress.step("writing results");
    let written = write_all(&run, &recordings, out, &pipeline.output)?;
    view::remember(out, path)?;
    progress.finish();

    if json {
        print(&summary_json(&run));
    } else {
        print(&terminal(&run, style()));
        let names: Vec<String> =
            written.iter().filter_map(|p| p.file_name()).map(|n| n.to_string_lossy().into()).collect();
        print(&format!("\nWritten to {}: {}\n", out.display(), names.join(", ")));
    }
    Ok(if run.status() == Status::Ok { Outcome::Done } else { Outcome::Doubtful })
}
