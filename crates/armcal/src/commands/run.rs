//! `armcal run`: the main job.

use super::{Outcome, may_write, print, print_written, terminal_style};
use crate::error::Error;
use crate::progress::Progress;
use crate::view;
use armcal_config::Pipeline;
use armcal_report::{Detail, run_files, run_text, summary_json, write_all};
use armcal_result::Status;
use std::path::{Path, PathBuf};

/// Runs a pipeline, writes all results to `out`, prints the story, or everything (or the summary as JSON).
pub fn run(path: &Path, out: &Path, detail: Detail, json: bool) -> Result<Outcome, Error> {
    let pipeline = Pipeline::load(path)?;
    may_write(result_files(&pipeline, out))?;
    let progress = Progress::new();
    let (run, recordings) = armcal_pipeline::run(&pipeline, &progress)?;
    progress.step("writing results");
    let written = write_all(&run, &recordings, out, &pipeline.output)?;
    view::write_source_file(out, path, &[])?;
    progress.finish();

    if json {
        print(&summary_json(&run)?)?;
    } else {
        print(&run_text(&run, terminal_style(), detail))?;
        print_written(out, &written)?;
    }
    Ok(status_outcome(run.status()))
}

/// The files that the results of a pipeline are written to.
pub(super) fn result_files(pipeline: &Pipeline, out: &Path) -> Vec<PathBuf> {
    let mut files = run_files(out, pipeline.arm_files());
    files.push(out.join(view::SOURCE_FILE));
    files
}

fn status_outcome(status: Status) -> Outcome {
    if status == Status::Ok { Outcome::Done } else { Outcome::CompletedWithWarnings }
}
