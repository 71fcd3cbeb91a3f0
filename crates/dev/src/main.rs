//! What is not shipped: how often the diagnosis is right, what armcal says to mistakes of the setup, and what is generated.

mod error;
mod mistakes;
mod score;

use clap::Parser;
use std::process::ExitCode;

/// Measures what armcal says, on simulated rigs whose truth it cannot see.
#[derive(Debug, Parser)]
#[command(name = "armcal-dev", version)]
enum Cli {
    /// How often the diagnosis is right: sealed scenarios, diagnosed without their truth, then judged by it.
    Score(score::Request),
    /// Runs armcal on setup mistakes and on sound sessions, judges what it says by its outputs alone, and writes the table
    ///
    /// Exit codes: 0 nothing false was said, 1 the suite itself failed, 3 something false was said, or a sound session accused.
    Mistakes(mistakes::Request),
    /// The JSON schema of `summary.json`, for docs/summary.schema.json.
    Schema,
    /// Every kind of warning and finding, for docs/warnings.md.
    Warnings,
}

fn main() -> ExitCode {
    let ended = match Cli::parse() {
        Cli::Score(asked) => score::run(&asked).map(|()| ExitCode::SUCCESS),
        Cli::Mistakes(asked) => mistakes::run(&asked).map_err(error::Error::from),
        Cli::Schema => print_text(&format!("{:#}\n", armcal_result::summary::summary_schema())),
        Cli::Warnings => print_text(&armcal_wording::warnings_page()),
    };
    ended.unwrap_or_else(|error| {
        print_stderr(&format!("error: {error}"));
        ExitCode::from(error.exit_code())
    })
}

fn print_text(text: &str) -> Result<ExitCode, error::Error> {
    Ok(armcal::stdout::print(text).map(|()| ExitCode::SUCCESS)?)
}

#[expect(clippy::print_stderr, reason = "progress and errors of the command")]
fn print_stderr(line: &str) {
    eprintln!("{line}");
}
