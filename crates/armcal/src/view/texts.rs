//! What results say in words, as they are served.

use crate::error::Error;
use armcal_report::{live_page, report_html, summary_json};
use armcal_result::sensitivity::Basis;
use armcal_result::{REPORT, Run, SUMMARY, attached_texts};
use std::path::Path;

/// What results say in words.
pub struct Texts {
    /// The page that is served.
    pub page: String,
    /// `summary.json`.
    pub summary: String,
}

impl Texts {
    /// Those of a run.
    pub fn of(run: &Run, basis: &Basis) -> Result<Texts, Error> {
        let page = report_html(run, basis)?;
        Ok(Texts { page: live_page(&page).unwrap_or(page), summary: summary_json(run)? })
    }

    /// Those that a run wrote into its `run.mcap`; none where that page cannot be served.
    pub fn read(run: &Path) -> Result<Option<Texts>, Error> {
        let [page, summary] = attached_texts(run, [REPORT, SUMMARY])?;
        Ok(page.and_then(|page| live_page(&page)).zip(summary).map(|(page, summary)| Texts { page, summary }))
    }
}
