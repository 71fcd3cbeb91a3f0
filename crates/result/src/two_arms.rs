//! What is particular to a run with tips that are joined.

use crate::Run;
use armcal_core::{Against, Observation};
use schemars::JsonSchema;
use serde::Serialize;

/// Two arms, or two points of one robot, and how they are joined.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TwoArms<'a> {
    /// Their names.
    pub arms: [&'a str; 2],
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
pub fn link_length_m(run: &Run, p: &[f64]) -> Option<f64> {
    let length = |o: &Observation| o.length().filter(|_| o.is_joined());
    let length = run.observations.iter().find_map(length)?;
    run.model.lengths().nth(length).map(|(_, index)| p[index])
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
