//! The page at once, and the run behind it when the first question comes.

use super::session::RefitSession;
use super::source::Given;
use super::texts::Texts;
use crate::error::Error;
use armcal_config::Pipeline;
use armcal_pipeline::are_same_inputs;
use armcal_stages::{Silent, Steps};
use std::sync::OnceLock;

/// What is served.
pub struct Live {
    given: Given,
    texts: Texts,
    /// Ready once somebody asks, or already where it took a run to make the page.
    session: OnceLock<Result<RefitSession, Error>>,
}

impl Live {
    /// The page that the run wrote whose results were named, where it read just what is there now; else that of a new run.
    pub fn of(given: Given, progress: &dyn Steps) -> Result<Live, Error> {
        if let Some(texts) = written_page(&given)? {
            return Ok(Live { given, texts, session: OnceLock::new() });
        }
        let (session, texts) = RefitSession::of(&given, progress)?;
        Ok(Live { given, texts, session: OnceLock::from(Ok(session)) })
    }

    /// What `summary.json` of the run says.
    pub fn summary(&self) -> &str {
        &self.texts.summary
    }

    /// The page.
    pub fn html(&self) -> &str {
        &self.texts.page
    }

    /// The run, ready to be refitted; made by whoever asks first.
    pub fn session(&self) -> Result<&RefitSession, &Error> {
        let made = || RefitSession::of(&self.given, &Silent).map(|(session, _)| session);
        self.session.get_or_init(made).as_ref()
    }
}

fn written_page(given: &Given) -> Result<Option<Texts>, Error> {
    let (Some(concluded), Some(run), []) = (&given.concluded, &given.run, &given.results[..]) else {
        return Ok(None);
    };
    if !are_same_inputs(&Pipeline::load(&given.pipeline)?, concluded)? {
        return Ok(None);
    }
    Texts::read(run)
}
