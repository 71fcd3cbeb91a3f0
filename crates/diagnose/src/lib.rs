//! Which physical effect is missing from a calibrated model, with error control and honest refusals.
//!
//! Two parts. The linear core ([`diagnose_problem`]) is linear algebra on a [`Problem`]: whitened residuals, what
//! the geometry could do, and columns of everything that might be missing. The model adapter ([`diagnose`]) builds problems from
//! a model and refits it. In the order of the story:
//!
//! * `problem`: residuals, geometry and everything that might be missing as `columns`; what is asked of thousands of them
//!   (`grams`); what the geometry could do is taken out, prior rows and all (`projection`);
//! * `weigh`: nothing, the catalogue and the unlisted compete and propose (`evidence`, `cells`); `crossval` predicts dwells that a
//!   fit did not see, `scatter` says how errors repeat, `confusion` what is the same to these data;
//! * `judge`: each among the others: `bootstrap` is the gate, `density` and `score` what it predicts, the one number by which all
//!   are compared, `contrasts` pairs of visits, `costs` what its freedom costs; `conditioned_problems` remember it;
//! * `diagnosis`: the result as data; `enters`: where an error enters and what it depends on;
//! * `unlisted`: where what has no name enters, on what it depends, its shape, a formula to paste (`expression`); joints that
//!   err over their own angle, all at once (`curves`);
//! * `search`: one effect after the other while they are promising (`forward`), no more than needed (`fewer`), names against all
//!   that predicts as much, each refitted (`settle`);
//! * `verdict`: accidents are set aside (`outliers`), what is missing beyond them, in numbers (`reports`), the order of all
//!   explanations (`ranking`), what to record next (`next`), the verdict once what was found is in the model (`conclude`);
//! * `robot`: the adapter: problems of a model (`view`, `channels`, `scans`), its refits, where a joint rests in a gap that was
//!   found (`rests`), the choice made again without each part of the hold-out (`nested`). What the user says of the arm decides
//!   which of the catalogue are tried (`knowledge`).
//!
//! Formulas, thresholds and their sources: `notes/diagnosis.md` of the project.

mod config;
mod diagnosis;
mod enters;
mod error;
mod events;
mod judge;
mod problem;
mod robot;
mod search;
mod unlisted;
mod verdict;
mod weigh;

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may stop and tell its numbers")]
mod tests;

#[cfg(test)]
extern crate self as armcal_diagnose;
#[cfg(test)]
use tests::arm::LinearRefit;

pub use armcal_model::Toggle;
pub use config::DiagnosisConfig;
pub use diagnosis::combination::{Combination, Term};
pub use diagnosis::ripple::Ripple;
pub use diagnosis::*;
pub use enters::{DependsOn, EntersAt};
pub use error::DiagnoseError;
pub use judge::contrasts::Contrast;
pub use judge::refit::Refit;
pub use judge::score::is_clear;
pub use problem::{Amplitude, Candidate, Channel, Columns, DwellRow, Part, Problem, Scan};
pub use robot::knowledge::Knowledge;
pub use robot::nested::nested_validation;
pub use robot::{Calibrated, diagnose};
pub use verdict::diagnose_problem;
pub use weigh::scatter::{Correlation, Scatter};
