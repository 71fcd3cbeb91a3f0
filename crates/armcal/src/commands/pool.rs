//! `armcal pool`: one arm, the results of many runs, one calibration.

use super::{Outcome, may_write, print, print_written, terminal_style};
use crate::error::Error;
use crate::progress::Progress;
use crate::view;
use armcal_config::Pipeline;
use armcal_config::{InputMessages, OutputConfig};
use armcal_report::{Detail, pool_files, pool_json, run_text, write_all};
use armcal_result::Status;
use std::path::{Path, PathBuf};

/// Pools results, writes all that one arm's run has to `out`, prints the story, or everything (or `pool.json`).
pub fn run(
    path: &Path,
    results: &[PathBuf],
    out: &Path,
    detail: Detail,
    json: bool,
) -> Result<Outcome, Error> {
    let pipeline = Pipeline::load_for_others(path)?;
    let mut files = pool_files(out, pipeline.arm_files());
    files.push(out.join(view::SOURCE_FILE));
    may_write(files)?;
    let progress = Progress::new();
    let run = armcal_pipeline::calibrate_jointly(&pipeline, results, &progress)?.run;
    progress.step("writing results");
    // The recordings themselves are not at hand.
    let written = write_all(&run, &[], out, &OutputConfig { input: InputMessages::Reference })?;
    view::write_source_file(out, path, results)?;
    progress.finish();
    if json {
        print(&pool_json(&run))?;
    } else {
        print(&run_text(&run, terminal_style(), detail))?;
        print_written(out, &written)?;
    }
    Ok(if run.status() == Status::Ok { Outcome::Done } else { Outcome::CompletedWithWarnings })
}
