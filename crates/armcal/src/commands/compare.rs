//! `armcal compare`: two results on the same dwells.

use super::{Outcome, print, style};
use crate::error::Error;
use armcal_recording::atomic;
use armcal_report::{Comparison, PastRun, comparison_html};
use std::path::Path;

/// Compares two results, prints the table (or JSON), and writes the page if one is wanted.
pub fn run(before: &Path, after: &Path, html: Option<&Path>, json: bool) -> Result<Outcome, Error> {
    let (before, after) = (PastRun::open(before)?, PastRun::open(after)?);
    if let Some(path) = html {
        atomic::write(path, comparison_html(&before, &after)?.as_bytes()).map_err(Error::Output)?;
    }
    let comparison = Comparison::of(&before, &after);
    if json {
        print(&super::json_text(&comparison)?);
    } else {
        print(&comparison.terminal(style()));
    }
    Ok(Outcome::Done)
}
