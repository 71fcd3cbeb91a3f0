//! Hypotheses fitted: each change, and of a change that holds a number the value that fits best.

use super::hypotheses::{Freedom, Hypothesis, Number};
use super::trial::{Inputs, Misfit};
use crate::story::Fitted;
use rayon::prelude::*;

/// Steps of a search between two neighbours.
const REFINEMENTS: usize = 10;

/// A hypothesis and how well the inputs fit with it.
pub struct Tried {
    /// The mistake that somebody may have made.
    pub hypothesis: Hypothesis,
    /// The inputs without it.
    pub inputs: Inputs,
    /// The fit to those.
    pub fitted: Fitted,
    /// How badly it fits.
    pub misfit: Misfit,
}

/// Those of the hypotheses that can be fitted. `before` is the misfit without any.
pub fn attempted(now: &Inputs, before: &Misfit, all: Vec<Hypothesis>) -> Vec<Tried> {
    let mut tried: Vec<Tried> = all.into_par_iter().filter_map(|h| attempt(now, h)).collect();
    refine_numbers(now, before, &mut tried);
    tried
}

/// Of each number the value that fits best, refined; the other values are dropped.
fn refine_numbers(now: &Inputs, before: &Misfit, tried: &mut Vec<Tried>) {
    let of_number = |t: &Tried| t.hypothesis.number.is_some();
    let name = |t: &Tried| (t.hypothesis.code, t.hypothesis.subject.clone());
    let mut numbers: Vec<(&'static str, String)> = tried.iter().filter(|t| of_number(t)).map(name).collect();
    numbers.dedup();
    for number in numbers {
        let own = |t: &Tried| of_number(t) && name(t) == number;
        let values = tried.iter().filter(|t| own(t));
        let Some(best) = values.min_by(|a, b| a.misfit.log.total_cmp(&b.misfit.log)) else { continue };
        let refined = (best.misfit.log < before.log).then(|| refined(now, best)).flatten();
        // In the place of its values: of what cannot be told apart the first in the list is believed.
        let place = tried.iter().take_while(|t| !own(t)).count();
        tried.retain(|t| !own(t));
        tried.splice(place..place, refined);
    }
}

/// The best value of a number between the neighbours of the one that was tried, by golden section.
fn refined(now: &Inputs, tried: &Tried) -> Option<Tried> {
    let number = tried.hypothesis.number.as_ref()?;
    let ratio = (5f64.sqrt() - 1.0) / 2.0;
    let at = |value: f64| {
        let number = Some(Number { value, ..number.clone() });
        attempt(
            now,
            Hypothesis { number, freedom: Freedom::Number, ..(tried.hypothesis.number.as_ref()?.at)(value) },
        )
    };
    let [mut low, mut high] = number.between;
    let mut best = at(number.value);
    for _ in 0..REFINEMENTS {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        let (at_a, at_b) = (at(a), at(b));
        let mean = |t: &Option<Tried>| t.as_ref().map_or(f64::INFINITY, |t| t.misfit.mean_m);
        let left = mean(&at_a) < mean(&at_b);
        let better = if left { at_a } else { at_b };
        if mean(&better) < mean(&best) {
            best = better;
        }
        (low, high) = if left { (low, b) } else { (a, high) };
    }
    best
}

fn attempt(now: &Inputs, hypothesis: Hypothesis) -> Option<Tried> {
    let inputs = hypothesis.undone(now);
    let fitted = inputs.fit().ok()?;
    let misfit = inputs.misfit(&fitted);
    Some(Tried { hypothesis, inputs, fitted, misfit })
}
