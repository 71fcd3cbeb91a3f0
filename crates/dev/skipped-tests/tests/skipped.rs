//! Prints which tests of this `cargo test` could not run here. It comes last because of its package's name; without the
//! harness of libtest, so that the list is the last thing on the screen.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "printing is its purpose")]

use skipped_tests::{list_notes, notes_folder, run_name, take_notes};
use std::process::ExitCode;

fn main() -> ExitCode {
    // Asked for the names of its tests by a tool: it has none.
    if std::env::args().any(|argument| argument == "--list") {
        return ExitCode::SUCCESS;
    }
    let listed = notes_folder().and_then(|folder| {
        let text = list_notes(&take_notes(&folder, &run_name())?);
        // For those who print it again at the end of a longer run.
        std::fs::write(folder.with_extension("txt"), &text)?;
        Ok(text)
    });
    match listed {
        Ok(text) => {
            print!("\n{text}");
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("listing the skipped tests: {e}");
            ExitCode::FAILURE
        }
    }
}
