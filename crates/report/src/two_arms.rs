//! What is particular to a run with tips that are joined.

use crate::run::Run;
use crate::text::printable;
use armcal_core::units::millimetres;
use armcal_core::{Against, Observation};
use serde::Serialize;

/// How the words for a direction begin in which both arms grow together.
const SCALE: &str = "scale (every length";

/// Two arms, or two points of one robot, and how they are joined.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct TwoArms<'a> {
    arms: [&'a str; 2],
    /// `same point` or `rigid link`.
    closure: &'static str,
    /// After the fit; none for tips in one point.
    link_length_mm: Option<f64>,
}

impl<'a> TwoArms<'a> {
    /// Of a run; `None` where nothing is joined.
    pub fn of(run: &'a Run) -> Option<TwoArms<'a>> {
        let joined = |o: &Observation| match o.against() {
            Some(Against::Feature(to)) => Some([o.feature, to]),
            _ => None,
        };
        let named = |feature| match run.model.chain().arms().get(run.model.arm_of(feature)) {
            Some(arm) => arm.name.as_str(),
            None => run.model.feature_name(feature),
        };
        let arms = run.observations.iter().find_map(joined)?.map(named);
        let link_length_m = link_length_m(run, &run.calibration.fit.values());
        let closure = if link_length_m.is_some() { "rigid link" } else { "same point" };
        Some(TwoArms { arms, closure, link_length_mm: link_length_m.map(|m| m * 1e3) })
    }
}

/// The length of the link between the tips [m]; none where they are in one point.
fn link_length_m(run: &Run, p: &[f64]) -> Option<f64> {
    let length = |o: &Observation| o.length().filter(|_| o.is_joined());
    let length = run.observations.iter().find_map(length)?;
    run.model.lengths().nth(length).map(|(_, index)| p[index])
}

/// `right and left, their tips in one point`; `None` where nothing is joined.
pub(crate) fn about(run: &Run) -> Option<String> {
    let points = TwoArms::of(run)?.arms.map(printable).join(" and ");
    let whose = if run.model.chain().arms().is_empty() { "" } else { "their tips " };
    Some(match link_length_m(run, &run.model.nominal()) {
        None => format!("{points}, {whose}in one point"),
        Some(length_m) => format!("{points}, {whose}on a rigid link of {} mm", millimetres(length_m)),
    })
}

/// How much of some observations is of joined tips.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Closing {
    /// Nothing.
    None,
    /// Some, beside what a sensor saw.
    Some,
    /// All.
    All,
}

impl Closing {
    /// Of these.
    pub fn of(observations: &[Observation]) -> Closing {
        match observations.iter().filter(|o| o.is_joined()).count() {
            0 => Closing::None,
            all if all == observations.len() => Closing::All,
            _ => Closing::Some,
        }
    }
}

/// What an error is.
pub(crate) fn errors_are(run: &Run) -> &'static str {
    match Closing::of(&run.observations) {
        Closing::None if run.model.places().next().is_some() => "Errors along what was measured",
        Closing::None => "Position errors",
        Closing::Some => "Position and closing errors",
        Closing::All => "Closing errors",
    }
}

/// What to do where an arm, or both together, may grow.
pub(crate) fn scale(run: &Run) -> Option<String> {
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
