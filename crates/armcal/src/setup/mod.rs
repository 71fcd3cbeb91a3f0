//! Mistakes of wiring, files, frames and units, looked for before any physics.
//!
//! A mistake of the setup is discrete: a sign, an order, a unit, a frame. Each is a hypothesis: the inputs with that one
//! thing changed (`hypotheses`), fitted anew (`trial`, `attempt`, `search`), weighed against the inputs as the pipeline has them
//! (`weigh`, `beyond`, `alone`) and told (`words`). The right one makes the errors fall as nothing else does; it is reported with what it would do. What
//! needs no refit (a body that never moves, a tilt that contradicts its measurement) is looked at directly (`facts`).
//!
//! No physical effect is looked for while a mistake stands: its name would be that of the mistake.

mod alone;
mod attempt;
mod beyond;
mod clocks;
mod facts;
mod hypotheses;
mod search;
mod trial;
mod unseen;
mod weigh;
mod words;

pub use clocks::{Reading, what_would_align};
pub use trial::{Change, Inputs};

use crate::story::Fitted;
use armcal_core::SetupReport;

/// Degrees in a radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Looks for mistakes in the inputs of a calibration.
pub fn examine(inputs: &Inputs, fitted: &Fitted) -> SetupReport {
    let mut report = SetupReport { findings: facts::streams(inputs), ..SetupReport::default() };
    // Of what is not what it is said to be, a change elsewhere takes a share of the errors, and says nothing.
    if report.findings.is_empty() {
        search::search(inputs, Some(fitted), &mut report);
    }
    // What a mistake does to tilts and frames is its consequence.
    let alone = report.findings.is_empty();
    report.findings.extend(facts::facts(inputs, fitted, alone));
    report.findings.sort_by_key(|f| std::cmp::Reverse(f.certainty));
    report
}

/// The same for inputs that could not be calibrated at all.
pub fn examine_failed(inputs: &Inputs) -> SetupReport {
    let mut report = SetupReport { findings: facts::streams(inputs), ..SetupReport::default() };
    if report.findings.is_empty() {
        report.findings.extend(facts::readings(inputs));
    }
    if report.findings.is_empty() {
        search::search(inputs, None, &mut report);
    }
    report
}
