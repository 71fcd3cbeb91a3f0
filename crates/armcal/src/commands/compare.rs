//! `armcal compare`: two results on the same dwells.

use super::{Outcome, print, style};
use crate::error::Error;
use armcal_report::{Comparison, PastRun};
use std::path::Path;

/// Compares two results and prints the table (or JSON).
pub fn run(before: &Path, after: &Path, json: bool) -> Result<Outcome, Error> {
    let comparison = Comparison::of(&PastRun::open(before)?, &PastRun::open(after)?);
    if json {
        print(&super::json_text(&comparison)?);
    } else {
        print(&comparison.terminal(style()));
    }
    Ok(Outcome::Done)
}
