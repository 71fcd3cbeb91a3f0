//! What is particular to a run of two arms whose tips are joined.

use crate::run::Run;
use crate::text::{millimetres, printable};
use serde::Serialize;

/// How the words for a direction begin in which both arms grow together.
const SCALE: &str = "scale (every length";

/// Two arms and how their tips are joined.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct TwoArms<'a> {
    arms: Vec<&'a str>,
    /// `same point` or `rigid link`.
    closure: &'static str,
    /// After the fit; none for tips in one point.
    link_length_mm: Option<f64>,
}

impl<'a> TwoArms<'a> {
    /// Of a run; `None` for one arm.
    pub fn of(run: &'a Run) -> Option<TwoArms<'a>> {
        let arms: Vec<&str> = run.model.chain().arms().iter().map(|arm| arm.name.as_str()).collect();
        let link_length_m = link_length_m(run, &run.calibration.fit.values());
        let closure = if link_length_m.is_some() { "rigid link" } else { "same point" };
        (!arms.is_empty()).then(|| TwoArms { arms, closure, link_length_mm: link_length_m.map(|m| m * 1e3) })
    }
}

/// The length of the link between the tips [m]; none where they are in one point.
fn link_length_m(run: &Run, p: &[f64]) -> Option<f64> {
    run.model.lengths().next().map(|(_, index)| p[index])
}

/// `right and left, their tips in one point`; `None` for one arm.
pub(crate) fn about(run: &Run) -> Option<String> {
    let arms = TwoArms::of(run)?.arms.into_iter().map(printable).collect::<Vec<_>>().join(" and ");
    Some(match link_length_m(run, &run.model.nominal()) {
        None => format!("{arms}, their tips in one point"),
        Some(length_m) => format!("{arms}, their tips on a rigid link of {} mm", millimetres(length_m)),
    })
}

/// What an error is.
pub(crate) fn errors_are(run: &Run) -> &'static str {
    match (run.model.chain().arms().is_empty(), run.model.places().next()) {
        (false, _) => "Closing errors",
        (true, Some(_)) => "Errors along what was measured",
        (true, None) => "Position errors",
    }
}

/// What to do where an arm, or both together, may grow.
pub(crate) fn scale(run: &Run) -> Option<String> {
    let open = run.calibration.fit.undetermined.iter().any(|u| u.text.contains(SCALE));
    let one_arm = run.model.chain().arms().is_empty();
    open.then(|| match one_arm {
        true => "the size of the arm is not determined: measure a distance ([[measure]] kind = \"distance\"), or give two points \
                 whose distance is known (`pose = \"measured\"`)"
            .to_owned(),
        false => "the size of both arms together is not determined: join the tips by a link of known length (`kind = \"rigid-link\"`), or \
         measure where a base stands (`base = { pose = \"measured\" }`)"
            .to_owned(),
    })
}
