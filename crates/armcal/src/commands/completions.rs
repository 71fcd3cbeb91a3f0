//! `armcal completions`: what a shell needs to complete commands and options.

use super::{Outcome, print};
use crate::error::Error;
use clap::Command;
use clap_complete::{Shell, generate};

/// Prints the script of a shell.
pub fn run(mut root: Command, shell: Shell) -> Result<Outcome, Error> {
    let mut script = Vec::new();
    generate(shell, &mut root, "armcal", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}
