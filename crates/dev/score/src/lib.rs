//! How often the diagnosis is right: many scenarios whose truth only this crate reads.
//!
//! `Scenario -> case (calibrated and diagnosed without the truth) -> judge (with it) -> table, page`. The quick way hands the
//! observations over as the pipeline would have made them; the sealed way writes recordings to disk and runs the whole
//! pipeline on them. `Scenario -> laws` asks what must hold of every answer, whatever is true.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod case;
mod error;
mod interval;
mod judge;
mod laws;
mod nothing;
mod page;
mod reliability;
mod table;

pub use case::{Answer, answer_observed, answer_recorded, nominal_model};
pub use error::ScoreError;
pub use judge::{Judgement, judge};
pub use laws::{Laws, check_laws};
pub use page::{Campaign, confusion_page};
pub use reliability::Reliability;
pub use table::{Row, family_rows, terminal_table};

use armcal_diagnose::NOT_LISTED;
use armcal_lab::scenario::{Hidden, Scenario};
use rayon::prelude::*;
use serde::Serialize;

/// One scenario and what came of it.
#[derive(Debug, Clone, Serialize)]
pub struct Scored {
    /// The scenario.
    pub scenario: Scenario,
    /// What the tool said, knowing nothing.
    pub answer: Answer,
    /// What was hidden.
    pub hidden: Vec<Hidden>,
    /// How right that was.
    pub judgement: Judgement,
}

/// How a scenario reaches the diagnosis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Way {
    /// As observations, the noise of sensor, seats and encoders declared so many times as large as it is thought to be.
    Observed {
        /// How many times.
        noise_factor: f64,
    },
    /// As recordings on disk, through the whole pipeline.
    Recorded,
}

/// Runs scenarios in parallel, in their order; `done` is told of each one.
pub fn score_scenarios(
    scenarios: &[Scenario],
    way: Way,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Scored>, ScoreError> {
    scenarios
        .par_iter()
        .map(|scenario| {
            let (answer, hidden) = match way {
                Way::Observed { noise_factor } => answer_observed(scenario, noise_factor)?,
                Way::Recorded => answer_recorded(scenario)?,
            };
            let judgement = judge(&answer, &hidden);
            done();
            Ok(Scored { scenario: scenario.clone(), answer, hidden, judgement })
        })
        .collect()
}
