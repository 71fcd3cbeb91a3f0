//! `armcal check`: whether a result keeps the limits in its pipeline's `[check]`.

use super::run::result_files;
use super::{Outcome, may_write, print};
use crate::error::Error;
use crate::progress::Progress;
use crate::view::{self, Given};
use armcal_check::{Judged, Judgement, Limits, SCHEMA, judge, junit, markdown, text};
use armcal_config::Pipeline;
use armcal_core::printable_name;
use armcal_recording::atomic;
use armcal_report::write_all;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// What `armcal check` is asked to do.
#[derive(Debug, Clone, Args)]
pub struct Request {
    /// Pipeline file with a [check] section, or the results of its run (their folder or run.mcap): what these concluded is not
    /// looked for again.
    pub pipeline: PathBuf,
    /// Write JUnit XML: a suite with a case for each limit, or an error where the run failed.
    #[arg(long, value_name = "FILE")]
    pub junit: Option<PathBuf>,
    /// Write Markdown, for the summary page of a job.
    #[arg(long, value_name = "FILE")]
    pub markdown: Option<PathBuf>,
    /// Write all results of the run to this folder too, as `armcal run` does.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// Runs the pipeline and judges it. A run that fails leaves its error in the files too, so that CI shows it where it
/// shows the checks.
pub fn run(request: &Request) -> Result<Outcome, Error> {
    // Loaded first: the files it names are inputs.
    let given = Given::alone(&request.pipeline);
    let loaded = given.and_then(|given| Ok((Pipeline::load(&given.pipeline)?, given)));
    may_write([&request.junit, &request.markdown].into_iter().flatten())?;
    match loaded.and_then(|(pipeline, given)| judge_pipeline(request, &pipeline, given)) {
        Ok(judged) => {
            write_if_requested(&request.junit, || Ok(junit::junit(&judged)?))?;
            write_if_requested(&request.markdown, || Ok(markdown::markdown(&judged)))?;
            print(&if request.json { super::json_text(&judged)? } else { text::text(&judged) })?;
            Ok(match judged.judgement {
                Judgement::Holds => Outcome::Done,
                Judgement::CompletedWithWarnings => Outcome::CompletedWithWarnings,
                Judgement::LimitExceeded => Outcome::LimitExceeded,
            })
        }
        Err(error) => Err(match report_failure(request, &error) {
            Ok(()) => error,
            Err(unwritten) => Error::Also { first: Box::new(error), second: Box::new(unwritten) },
        }),
    }
}

fn judge_pipeline(request: &Request, pipeline: &Pipeline, given: Given) -> Result<Judged, Error> {
    let limits = Limits::of(pipeline, &given.pipeline)?;
    may_write(request.out.as_deref().map(|out| result_files(pipeline, out)).into_iter().flatten())?;
    let progress = Progress::new();
    let settled = armcal_pipeline::settle_again(pipeline, given.concluded, &progress)?;
    let (mut run, recordings) = settled.diagnosed(pipeline, &progress);
    armcal_pipeline::add_refits(&mut run, pipeline, &progress)?;
    let judged = judge(&run, &limits)?;
    if let Some(out) = &request.out {
        progress.step("writing results");
        write_all(&run, &recordings, out, &pipeline.output)?;
        view::write_source_file(out, &given.pipeline, &[])?;
    }
    progress.finish();
    Ok(judged)
}

/// Says wherever a result was wanted that there is none; the error itself goes to stderr as every command's does.
fn report_failure(request: &Request, error: &Error) -> Result<(), Error> {
    let name = request.pipeline.file_stem().unwrap_or_default().to_string_lossy();
    let error = error.to_string();
    write_if_requested(&request.junit, || Ok(junit::junit_failed(&name, &error)?))?;
    write_if_requested(&request.markdown, || Ok(markdown::markdown_failed(&name, &error)))?;
    let line = format!("{}: no check was made, the run failed", printable_name(&name));
    if request.json {
        let value = json!({ "schema": SCHEMA, "judgement": "failed", "line": line, "error": error });
        print(&super::json_text(&value)?)?;
    } else {
        print(&format!("{line}\n"))?;
    }
    Ok(())
}

fn write_if_requested(
    path: &Option<PathBuf>,
    content: impl FnOnce() -> Result<String, Error>,
) -> Result<(), Error> {
    let Some(path) = path else { return Ok(()) };
    atomic::write(path, content()?.as_bytes()).map_err(Error::Output)
}
