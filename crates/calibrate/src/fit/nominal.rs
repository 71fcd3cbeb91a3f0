//! The nominal arm with its frames placed, and where its fit ended, carried over from one calibration to another of the same arm.

use crate::fit::priors::{PriorScales, scales_of};
use crate::outcome::Calibration;
use armcal_model::Model;
use std::collections::BTreeMap;

/// Scales of learnt priors are carried over so many times as wide: from there they are learnt as from the default ones, which are
/// the widest. What a fit without an effect had to explain by the arm may be narrower with it, or wider.
const FROM_ABOVE: f64 = 3.0;

/// Where a fit may begin.
#[derive(Debug)]
pub(crate) struct Start {
    pub values: Vec<f64>,
    /// Of the default priors, from which they are learnt.
    pub prior_scales: PriorScales,
}

/// Parameters that give the nominal errors, and where the fit begins, as far as they are known.
#[derive(Debug, Default)]
pub(crate) struct Nominal {
    /// On all observations.
    pub of_all: Option<Vec<f64>>,
    /// In each turn of the hold-out.
    pub turns: Vec<Vec<f64>>,
    /// Where the fit without the added effects ended.
    pub start: Option<Start>,
}

/// Those of another calibration for a model that has its parameters and more effects; none where one of these does something
/// at nominal, or something else differs.
pub(crate) fn of_turns(other: &Calibration, model: &Model) -> Option<Nominal> {
    let known: BTreeMap<&str, usize> =
        other.fit.estimates.iter().enumerate().map(|(k, e)| (e.parameter.name.as_str(), k)).collect();
    let parameters = model.parameters();
    let at: Vec<Option<usize>> = parameters.iter().map(|p| known.get(p.name.as_str()).copied()).collect();
    if at.iter().flatten().count() != known.len() {
        return None;
    }
    let mut added = vec![false; parameters.len()];
    for effect in model.effects().iter().filter(|effect| at[effect.parameters.start].is_none()) {
        let first = effect.parameters.start;
        if parameters[first..first + effect.amplitudes].iter().any(|p| p.nominal != 0.0) {
            return None;
        }
        added[effect.parameters.clone()].fill(true);
    }
    if at.iter().zip(&added).any(|(at, added)| at.is_none() != *added) {
        return None;
    }
    let carried = |values: &Vec<f64>| -> Vec<f64> {
        at.iter().zip(parameters).map(|(at, p)| at.map_or(p.nominal, |k| values[k])).collect()
    };
    let learnt = at.iter().zip(parameters).filter_map(|(at, p)| Some((&other.fit.estimates[(*at)?], p)));
    let mut prior_scales = scales_of(learnt);
    prior_scales.values_mut().for_each(|scale| *scale = (*scale * FROM_ABOVE).min(1.0));
    Some(Nominal {
        start: Some(Start { values: carried(&other.fit.values()), prior_scales }),
        of_all: Some(carried(&other.nominal_values)),
        turns: other.turn_nominal_values.iter().map(carried).collect(),
    })
}

#[cfg(test)]
#[path = "../tests/nominal.rs"]
mod tests;
