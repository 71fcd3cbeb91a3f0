//! docs/warnings.md: every kind of warning and finding, from their list.

use armcal_core::Code;
use std::fmt::Write as _;

/// The page.
pub fn warnings_page() -> String {
    let mut page = String::from(
        "# Warnings and findings\n\nWritten by `cargo run -p armcal-dev -- warnings > docs/warnings.md`.\n\n\
         The code in brackets behind a warning is its name in `summary.json`, `run.mcap` and the page. It stays from version to \
         version; the sentence beside it says what was seen in which file, dwell or joint, and what to do. A warning that is \
         *inadequate* or tells of *data lost* makes the exit code 3; a *notice* leaves the result standing.\n\n\
         | code | what it says |\n|---|---|\n",
    );
    for code in Code::ALL {
        // Writing to a text cannot fail.
        let _ = writeln!(page, "| `{code}` | {} |", code.meaning());
    }
    page
}
