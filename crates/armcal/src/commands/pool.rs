//! `armcal pool`: one arm, the results of many runs, one calibration.

use super::{Outcome, batch, may_write, print, print_written, style};
use crate::error::Error;
use crate::progress::Progress;
use crate::{pool, view};
use armcal_config::Pipeline;
use armcal_config::{InputMessages, OutputConfig};
use armcal_report::{Detail, Run, Status, pool_files, pool_json, terminal, write_all, write_pool_brief};
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
    let run = pool::run(&pipeline, results, &progress)?.run;
    progress.step("writing results");
    // The recordings themselves are not at hand.
    let written = write_all(&run, &[], out, &OutputConfig { input: InputMessages::Reference })?;
    view::remember(out, path, results)?;
    progress.finish();
    show(&run, out, &written, detail, json)
}

/// Answers the open round of a pool for one share of the results.
pub(crate) fn map(
    pipeline: Option<&Path>,
    results: &[PathBuf],
    out: &Path,
    shard: Option<&str>,
) -> Result<Outcome, Error> {
    let (shard, pipeline) = (batch::shard_of(shard)?, pipeline.ok_or(Error::NoPipeline)?);
    let progress = Progress::new();
    let pool::Mapped { round, results, skipped } = pool::map(pipeline, results, out, shard, &progress)?;
    progress.finish();
    let done = if skipped { "was answered already" } else { "answered" };
    print(&format!("share {shard}: {results} results, round {round} {done}\n"))?;
    Ok(Outcome::Done)
}

/// Goes on with a pool as far as the answers of its shares reach.
pub(crate) fn reduce(out: &Path, json: bool) -> Result<Outcome, Error> {
    let progress = Progress::new();
    let (pipeline, reduced) = pool::reduce(out, &progress)?;
    let run = match reduced {
        pool::Reduced::Done(run) => run,
        pool::Reduced::Round { number, questions } => {
            progress.finish();
            print(&format!(
                "round {number}: {questions} questions; map every share again, then reduce again\n"
            ))?;
            return Ok(Outcome::Again);
        }
    };
    may_write(pool_files(out, pipeline.arm_files()))?;
    progress.step("writing results");
    let written = write_pool_brief(&run, out)?;
    progress.finish();
    let outcome = show(&run, out, &written, Detail::Story, json)?;
    if !json {
        print("Page, tables and run.mcap need the observations themselves: `armcal pool` writes them.\n")?;
    }
    Ok(outcome)
}

fn show(run: &Run, out: &Path, written: &[PathBuf], detail: Detail, json: bool) -> Result<Outcome, Error> {
    if json {
        print(&pool_json(run))?;
    } else {
        print(&terminal(run, style(), detail))?;
        print_written(out, written)?;
    }
    Ok(if run.status() == Status::Ok { Outcome::Done } else { Outcome::Doubtful })
}
