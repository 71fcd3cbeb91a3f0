//! Outcome to exit code: 0 done, 1 failed or a limit is broken, 2 usage, 3 finished but data were lost or the model is
//! inadequate.

use armcal::cli::Cli;
use armcal::commands::Outcome;
use armcal::dispatch::dispatch;
use armcal::{Error, stdout, threads};
use armcal_report::TerminalStyle;
use clap::Parser as _;
use std::io::Write as _;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // Help and version are results; usage errors clap prints itself and exits with 2.
        Err(asked) if !asked.use_stderr() => {
            return exit_code(stdout::write_stdout(|_| asked.print()).map(|()| Outcome::Done));
        }
        Err(mistake) => mistake.exit(),
    };
    exit_code(threads::start_workers().and_then(|()| dispatch(&cli)))
}

fn exit_code(result: Result<Outcome, Error>) -> ExitCode {
    match result {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::CompletedWithWarnings) => ExitCode::from(3),
        Ok(Outcome::LimitExceeded) => ExitCode::FAILURE,
        Err(error) => {
            // A closed stderr leaves nowhere to complain to; the exit code still tells.
            let _ = writeln!(
                std::io::stderr(),
                "error: {}",
                stdout::escape_control_characters(&error.to_string(), TerminalStyle::Plain)
            );
            ExitCode::from(error.exit_code())
        }
    }
}
