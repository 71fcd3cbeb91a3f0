//! Mistakes of wiring, files, frames and units, looked for before any physics.
//!
//! A mistake of the setup is discrete: a sign, an order, a unit, a frame. Each is a hypothesis: the inputs with that one
//! thing changed (`hypotheses`), fitted anew (`trial`, `attempt`, `search`), weighed against the inputs as the pipeline has them
//! (`weigh`, `beyond`, `alone`) and told (`words`). The right one makes the errors fall as nothing else does; it is reported with what it would do. What
//! needs no refit (a body that never moves, a tilt that contradicts its measurement) is looked at directly (`facts`), first, and
//! ends the search where it is beyond doubt.
//!
//! No physical effect is looked for while a mistake stands: its name would be that of the mistake.

#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod alone;
mod attempt;
mod beyond;
mod describe;
mod facts;
mod hypotheses;
mod moving;
mod search;
mod spread;
mod trial;
mod unseen;
mod weigh;

use armcal_core::{SetupFinding, SetupReport};
use armcal_stages::{Fitted, Inputs};

/// Looks for mistakes in the inputs of a calibration.
pub fn examine(inputs: &Inputs, fitted: &Fitted) -> SetupReport {
    let sound = facts::is_sound(fitted);
    let mut report = led_by(facts::evident_mistakes(inputs, sound), inputs, Some(fitted));
    // What a mistake does to tilts and frames is its consequence.
    report.findings.extend(match sound {
        true if report.findings.is_empty() => facts::contradicted_declarations(inputs, fitted),
        true => Vec::new(),
        false => facts::suspect_readings(inputs),
    });
    report.findings.sort_by_key(|f| std::cmp::Reverse(f.certainty));
    report
}

/// The same for inputs that could not be calibrated at all.
pub fn examine_failed(inputs: &Inputs) -> SetupReport {
    let mut seen = facts::evident_mistakes(inputs, false);
    seen.extend(facts::suspect_readings(inputs));
    led_by(seen, inputs, None)
}

/// What was seen without a refit, and what a search finds where none of that is a mistake: beside a reading or a stream that
/// is none, a change elsewhere takes a share of the errors, and says nothing.
fn led_by(seen: Vec<SetupFinding>, inputs: &Inputs, fitted: Option<&Fitted>) -> SetupReport {
    let mut report = SetupReport { findings: seen, ..SetupReport::default() };
    if report.mistakes().next().is_none() {
        search::find_mistakes(inputs, fitted, &mut report);
    }
    report
}
