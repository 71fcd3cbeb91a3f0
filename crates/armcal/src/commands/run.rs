//! `armcal run`: the main job.

use super::{Outcome, print, style};
use crate::closed_chain::{self, ClosedPipeline};
use crate::error::Error;
use crate::pipeline::Job;
use crate::progress::Progress;
use crate::{story, view};
use armcal_report::{
    Status, closed_summary_json, closed_terminal, summary_json, terminal, write_all, write_closed,
};
use std::path::{Path, PathBuf};

/// Runs a pipeline, writes all results to `out`, prints the table (or the summary as JSON).
pub fn run(path: &Path, out: &Path, json: bool) -> Result<Outcome, Error> {
    let pipeline = match Job::load(path)? {
        Job::OneArm(pipeline) => pipeline,
        Job::TwoArms(pipeline) => return two_arms(&pipeline, out, json),
    };
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
        print_written(out, &written);
    }
    Ok(outcome(run.status()))
}

/// The same for two arms in a closed chain.
fn two_arms(pipeline: &ClosedPipeline, out: &Path, json: bool) -> Result<Outcome, Error> {
    let progress = Progress::new();
    let (run, recordings) = closed_chain::run(pipeline, &progress)?;
    progress.step("writing results");
    let written = write_closed(&run, &recordings, out)?;
    progress.finish();
    if json {
        print(&closed_summary_json(&run)?);
    } else {
        print(&closed_terminal(&run, style()));
        print_written(out, &written);
    }
    Ok(outcome(run.status()))
}

/// Which files a command left where.
pub(super) fn print_written(out: &Path, written: &[PathBuf]) {
    let names: Vec<String> =
        written.iter().filter_map(|p| p.file_name()).map(|n| n.to_string_lossy().into()).collect();
    print(&format!("\nWritten to {}: {}\n", out.display(), names.join(", ")));
}

fn outcome(status: Status) -> Outcome {
    if status == Status::Ok { Outcome::Done } else { Outcome::Doubtful }
}
