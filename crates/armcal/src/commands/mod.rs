//! One command, one file.

mod export;
mod inspect;
mod run;
mod simulate;

use crate::cli::{Cli, Command};
use crate::error::Error;
use std::io::Write as _;

/// How a command ended when it did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done.
    Done,
    /// Done, but data were lost or the model is inadequate.
    Doubtful,
}

/// Runs the command a user typed.
pub fn dispatch(cli: &Cli) -> Result<Outcome, Error> {
    match &cli.command {
        Command::Run { pipeline, out, json } => run::run(pipeline, out, *json),
        Command::Inspect { inputs, json } => inspect::run(inputs, *json),
        Command::Simulate { lab, out, seed } => simulate::run(lab, out, *seed),
        Command::Export { pipeline, out } => export::run(pipeline, out),
    }
}

/// Prints a result; a reader that closed the pipe is not an error.
fn print(text: &str) {
    let mut stdout = std::io::stdout().lock();
    let _ = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
}
