//! What all pages have in common: the head, the first screen, and the scripts at the end (`templates/base.html`).

use super::embed;
use crate::ReportError;
use armcal_result::{Status, VERSION};
use armcal_wording::Story;
use serde::Serialize;

/// Longer headlines than this are set smaller, so that what to do next stays on the first screen.
const LONG: usize = 160;

/// The frame of a page and its first screen.
pub(crate) struct Shell {
    /// Which page it is, as its metadata say.
    pub kind: &'static str,
    pub title: String,
    /// What it is about, in one line above the headline.
    pub kicker: String,
    pub headline: String,
    /// What stands below the headline; may be empty.
    pub lead: String,
    /// Whether the result stands; `None` where the page is about none.
    pub status: Option<(Status, String)>,
    /// What to do first.
    pub steps: Vec<String>,
    /// How many steps there are beyond those, in the section `next`.
    pub more_steps: usize,
    pub version: &'static str,
    pub style: &'static str,
    pub plotly: &'static str,
    pub policy: String,
    pub script: String,
    pub data: String,
}

impl Shell {
    /// A page of this kind that runs these scripts over this document and talks to nobody.
    ///
    /// # Errors
    /// A document that cannot be written.
    pub fn new(
        kind: &'static str,
        (title, kicker): (String, String),
        scripts: &[&str],
        document: &impl Serialize,
    ) -> Result<Shell, ReportError> {
        let script = embed::script(scripts);
        Ok(Shell {
            kind,
            title,
            kicker,
            headline: String::new(),
            lead: String::new(),
            status: None,
            steps: Vec::new(),
            more_steps: 0,
            version: VERSION,
            style: embed::STYLE,
            plotly: embed::PLOTLY,
            policy: embed::content_security_policy(&[embed::PLOTLY, &script]),
            data: embed::json_for_html(document)?,
            script,
        })
    }

    /// The same with a headline.
    pub fn saying(self, headline: String) -> Shell {
        Shell { headline, ..self }
    }

    /// The same with the first screen of a story.
    pub fn telling(self, story: &Story) -> Shell {
        let (headline, lead) = match story.missing.is_empty() {
            true => (story.calibration.clone(), story.found.join(" ")),
            false => (story.missing.clone(), story.calibration.clone()),
        };
        Shell {
            headline,
            lead,
            status: Some((story.status, story.status_sentence().to_owned())),
            steps: story.first_steps().to_vec(),
            more_steps: story.more_steps(),
            ..self
        }
    }

    /// The status where the result does not stand.
    pub fn grave(&self) -> Option<&'static str> {
        match self.status.as_ref()?.0 {
            Status::Ok => None,
            Status::Inadequate => Some("inadequate"),
            Status::DataLost => Some("data lost"),
        }
    }

    pub fn long(&self) -> bool {
        self.headline.len() > LONG
    }
}
