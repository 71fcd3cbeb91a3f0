//! Outcome to exit code: 0 done, 1 failed or a limit is broken, 2 usage, 3 finished but data were lost or the model is inadequate.

use armcal::cli::Cli;
use armcal::commands::{self, Outcome};
use armcal_report::TerminalStyle;
use clap::Parser as _;
use std::io::Write as _;
use std::process::ExitCode;

fn main() -> ExitCode {
    // clap prints usage errors itself and exits with 2.
    let cli = Cli::parse();
    match commands::dispatch(&cli) {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Doubtful) => ExitCode::from(3),
        Ok(Outcome::Broken) => ExitCode::FAILURE,
        Err(error) => {
            // A closed stderr leaves nowhere to complain to; the exit code still tells.
            let _ = writeln!(
                std::io::stderr(),
                "error: {}",
                commands::harmless(&error.to_string(), TerminalStyle::Plain)
            );
            ExitCode::from(error.exit_code())
        }
    }
}
