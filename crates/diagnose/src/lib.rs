//! Which physical effect is missing from a calibrated model, with error control and honest refusals.
//!
//! Two parts. The linear core ([`diagnose_problem`]) is linear algebra on a [`Problem`]: whitened residuals, what
//! the geometry could do, and columns of everything that might be missing. The model adapter ([`diagnose`]) builds problems from
//! a model and refits it. In the order of the story:
//!
//! * `columns`, `grams`: what might be missing as columns, and what is asked of thousands of them;
//! * `projection`: what the geometry could do is taken out, prior rows and all;
//! * `evidence`, `cells`, `weigh`: nothing, the catalogue and the unlisted compete; `scatter` says how errors repeat;
//! * `knowledge`: what the user says of the arm decides which of the catalogue are tried;
//! * `outliers`: accidents are set aside and reported;
//! * `search`, `forward`, `fewer`: one effect after the other while they are promising, and no more than needed;
//! * `density`, `score`: what an explanation says of dwells that its fit did not see, the one number by which all are compared;
//! * `judge`: each among the others: `bootstrap` is the gate, `score` what it predicts, `contrasts` pairs of visits, `confusion` what
//!   is the same to these data;
//! * `settle`, `costs`, `ranking`: names against all that predicts as much, each refitted; the order of all explanations;
//! * `curves`: joints that err over their own angle, all at once, and what is left beside them;
//! * `unknown`, `expression`: where the unlisted enters, on what it depends, its shape, a formula to paste;
//! * `inner`, `reports`, `combination`, `next`: the verdict in numbers, and what to record next;
//! * `conclude`: the verdict once what was found is in the model, and what remains;
//! * `rests`: where a joint rests in a gap that was found;
//! * `nested`: the choice made again without each part of the hold-out.
//!
//! Formulas, thresholds and their sources: `notes/diagnosis.md` of the project.

mod bootstrap;
mod by_dwell;
mod cells;
mod channels;
mod columns;
mod combination;
mod conclude;
mod conditioned_problems;
mod config;
mod confusion;
mod contrasts;
mod costs;
mod crossval;
mod curves;
mod density;
mod diagnosis;
mod drivers;
mod error;
mod events;
mod evidence;
mod expression;
mod fewer;
mod forward;
mod grams;
mod group;
mod inner;
mod judge;
mod knowledge;
mod model_refit;
mod nested;
mod next;
mod observed;
mod outliers;
mod places;
mod problem;
mod projection;
mod ranking;
mod refit;
mod reports;
mod rests;
mod ripple;
mod scans;
mod scatter;
mod score;
mod search;
mod settle;
mod stretches;
mod suggestion;
mod unexplained;
mod unknown;
mod view;
mod weigh;

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and tell its numbers")]
mod tests;

#[cfg(test)]
extern crate self as armcal_diagnose;
#[cfg(test)]
use tests::arm::LinearRefit;

pub use armcal_model::Toggle;
pub use combination::{Combination, Term};
pub use config::DiagnosisConfig;
pub use contrasts::Contrast;
pub use diagnosis::*;
pub use error::DiagnoseError;
pub use inner::diagnose_problem;
pub use knowledge::Knowledge;
pub use nested::{Nested, nested_validation};
pub use observed::{Calibrated, diagnose};
pub use problem::{Amplitude, Candidate, Channel, Columns, DwellRow, Part, Problem, Scan};
pub use refit::Refit;
pub use ripple::Ripple;
pub use scatter::{Correlation, Scatter};
pub use score::is_clear;
pub use unexplained::UNEXPLAINED;
