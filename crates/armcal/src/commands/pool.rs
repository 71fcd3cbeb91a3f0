//! `armcal pool`: one arm, the results of many runs, one calibration.

use super::{Outcome, may_write, print, print_written, style};
use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::pool;
use crate::progress::Progress;
use armcal_report::{Status, pooled_files, pooled_json, pooled_terminal, write_pooled};
use std::path::{Path, PathBuf};

/// Pools results, writes to `out`, prints the table (or `pool.json`).
pub fn run(pipeline: &Path, results: &[PathBuf], out: &Path, json: bool) -> Result<Outcome, Error> {
    let pipeline = Pipeline::load_for_others(pipeline)?;
    may_write(pooled_files(out))?;
    let progress = Progress::new();
    let run = pool::run(&pipeline, results, &progress)?;
    progress.step("writing results");
    let written = write_pooled(&run, out)?;
    progress.finish();
    if json {
        print(&pooled_json(&run)?)?;
    } else {
        print(&pooled_terminal(&run, style()))?;
        print_written(out, &written)?;
    }
    Ok(if run.status() == Status::Ok { Outcome::Done } else { Outcome::Doubtful })
}
