//! `armcal compare`: two results on the same dwells.

use super::{Outcome, may_write, print, terminal_style};
use crate::error::Error;
use armcal_recording::atomic;
use armcal_report::{comparison_html, comparison_text};
use armcal_result::{Comparison, StoredRun};
use std::path::Path;

/// Compares two results, prints the table (or JSON), and writes the page if one is wanted.
pub fn run(before: &Path, after: &Path, html: Option<&Path>, json: bool) -> Result<Outcome, Error> {
    let (before, after) = (StoredRun::open(before)?, StoredRun::open(after)?);
    may_write(html)?;
    let comparison = Comparison::of(&before, &after);
    if comparison.all.is_none() {
        return Err(Error::NothingInCommon {
            before: before.path,
            after: after.path,
            why: unpaired_reasons(&comparison),
        });
    }
    if let Some(path) = html {
        let page = comparison_html(&before, &after, &comparison)?;
        atomic::write(path, page.as_bytes()).map_err(Error::Output)?;
    }
    if json {
        print(&super::json_text(&comparison)?)?;
    } else {
        print(&comparison_text(&comparison, terminal_style()))?;
    }
    Ok(Outcome::Done)
}

/// Why no dwell of one result is in the other, recording by recording.
fn unpaired_reasons(comparison: &Comparison) -> String {
    let reasons: Vec<String> = comparison.unpaired.iter().map(ToString::to_string).collect();
    reasons.join("; ")
}
