//! `armcal run`: the main job.

use super::{Outcome, print};
use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::progress::Progress;
use crate::story;
use armcal_report::{Status, TerminalStyle, summary_json, terminal, write_all};
use std::io::IsTerminal as _;
use std::path::Path;

/// Runs a pipeline, writes all results to `out`, prints the table (or the summary as JSON).
pub fn run(pipeline: &Path, out: &Path, json: bool) -> Result<Outcome, Error> {
    let pipeline = Pipeline::load(pipeline)?;
    let progress = Progress::new();
    let (run, recordings) = story::run(&pipeline, &progress)?;
    progress.step("writing results");
    let written = write_all(&run, &recordings, out, &pipeline.output)?;
    progress.finish();

    if json {
        print(&summary_json(&run));
    } else {
        let colour = std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        print(&terminal(&run, if colour { TerminalStyle::Colour } else { TerminalStyle::Plain }));
        let names: Vec<String> =
            written.iter().filter_map(|p| p.file_name()).map(|n| n.to_string_lossy().into()).collect();
        print(&format!("\nWritten to {}: {}\n", out.display(), names.join(", ")));
    }
    Ok(if run.status() == Status::Ok { Outcome::Done } else { Outcome::Doubtful })
}
