//! Tips that are joined, in words.

use armcal_core::printable_name;
use armcal_core::units::format_mm;
use armcal_result::{Closing, Run, TwoArms, link_length_m};

/// How the words for a direction begin in which both arms grow together.
const SCALE: &str = "scale (every length";

/// `right and left, their tips in one point`; `None` where nothing is joined.
pub fn joined_tips_text(run: &Run) -> Option<String> {
    let points = TwoArms::of(run)?.arms.map(printable_name).join(" and ");
    let whose = if run.model.chain().arms().is_empty() { "" } else { "their tips " };
    Some(match link_length_m(run, &run.model.nominal()) {
        None => format!("{points}, {whose}in one point"),
        Some(length_m) => format!("{points}, {whose}on a rigid link of {} mm", format_mm(length_m)),
    })
}

/// What an error is.
pub fn errors_are(run: &Run) -> &'static str {
    match Closing::of(&run.observations) {
        Closing::None if run.model.places().next().is_some() => "Errors along what was measured",
        Closing::None => "Position errors",
        Closing::Some => "Position and closing errors",
        Closing::All => "Closing errors",
    }
}

/// What to do where an arm, or both together, may grow.
pub fn scale_step(run: &Run) -> Option<String> {
    let open = run.calibration.fit.undetermined.iter().any(|u| u.text.contains(SCALE));
    let or = match run.model.chain().arms() {
        [] => "let a sensor see one of them ([streams.tip])",
        _ => "measure where a base stands (`base = { pose = \"measured\" }`)",
    };
    open.then(|| match run.model.places().next() {
        Some(_) => "the size of the arm is not determined: measure a distance ([[measure]] kind = \"distance\"), or give two points \
                    whose distance is known (`pose = \"measured\"`)"
            .to_owned(),
        None => format!(
            "the size of both arms together is not determined: join the tips by a link of known length (`kind = \"rigid-link\"`), or \
             {or}"
        ),
    })
}
