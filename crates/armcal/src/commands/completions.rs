//! `armcal completions`: what a shell needs to complete commands and options.

use super::{Outcome, print};
use crate::cli::Cli;
use crate::error::Error;
use clap::CommandFactory as _;
use clap_complete::{Shell, generate};

/// Prints the script of a shell.
pub fn run(shell: Shell) -> Result<Outcome, Error> {
    let mut script = Vec::new();
    generate(shell, &mut Cli::command(), "armcal", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}
