//! `armcal run`: the main job.

use super::{Outcome, may_write, print, print_written, style};
use crate::closed_chain::{self, ClosedPipeline};
use crate::error::Error;
use crate::pipeline::{Job, Pipeline};
use crate::progress::Progress;
use crate::{story, view};
use armcal_report::{
    Detail, Status, closed_files, closed_summary_json, closed_terminal, run_files, summary_json, terminal,
    write_all, write_closed,
};
use std::path::{Path, PathBuf};

/// Runs a pipeline, writes all results to `out`, prints the story, or everything (or the summary as JSON).
pub fn run(path: &Path, out: &Path, detail: Detail, json: bool) -> Result<Outcome, Error> {
    let pipeline = match Job::load(path)? {
        Job::OneArm(pipeline) => pipeline,
        Job::TwoArms(pipeline) => return two_arms(&pipeline, out, detail, json),
    };
    may_write(results(&pipeline, out))?;
    let progress = Progress::new();
    let (run, recordings) = story::run(&pipeline, &progress)?;
    progress.step("writing results");
    let written = write_all(&run, &recordings, out, &pipeline.output)?;
    view::remember(out, path, &[])?;
    progress.finish();

    if json {
        print(&summary_json(&run))?;
    } else {
        print(&terminal(&run, style(), detail))?;
        print_written(out, &written)?;
    }
    Ok(outcome(run.status()))
}

/// The files that the results of a pipeline are written to.
pub(super) fn results(pipeline: &Pipeline, out: &Path) -> Vec<PathBuf> {
    let mut files = run_files(out, pipeline.model.urdf.is_some());
    files.push(out.join(view::SOURCE_FILE));
    files
}

/// The same for two arms in a closed chain.
fn two_arms(pipeline: &ClosedPipeline, out: &Path, detail: Detail, json: bool) -> Result<Outcome, Error> {
    let arms = pipeline.arms.iter().map(|arm| (arm.name.as_str(), arm.model.urdf.is_some()));
    may_write(closed_files(out, arms))?;
    let progress = Progress::new();
    let (run, recordings) = closed_chain::run(pipeline, &progress)?;
    progress.step("writing results");
    let written = write_closed(&run, pipeline.output.copied(&recordings), out)?;
    progress.finish();
    if json {
        print(&closed_summary_json(&run)?)?;
    } else {
        print(&closed_terminal(&run, style(), detail))?;
        print_written(out, &written)?;
    }
    Ok(outcome(run.status()))
}

fn outcome(status: Status) -> Outcome {
    if status == Status::Ok { Outcome::Done } else { Outcome::Doubtful }
}
