//! Hypotheses fitted: each change, and of a change that holds a number the value that fits best.

use super::hypotheses::{Freedom, Hypothesis, Number};
use super::trial::{Misfit, compute_misfit};
use super::weigh::{SAME_FACTOR, could_explain};
use armcal_core::{Code, Observation};
use armcal_stages::{Fitted, Inputs, Rounds, fit_places};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Steps of a search between two neighbours.
const REFINEMENTS: usize = 10;

/// Share of all dwells for which later rounds may find places, and hardly ever do.
const MORE_LATER: f64 = 0.25;

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
pub fn fit_hypotheses(now: &Inputs, before: &Misfit, all: Vec<Hypothesis>) -> Vec<Tried> {
    let mut tried: Vec<Tried> = all.into_par_iter().filter_map(|h| fit_hypothesis(now, before, h)).collect();
    refine_numbers(now, before, &mut tried);
    tried
}

/// Of each number the value that fits best, refined; the other values are dropped.
fn refine_numbers(now: &Inputs, before: &Misfit, tried: &mut Vec<Tried>) {
    let of_number = |t: &Tried| t.hypothesis.number.is_some();
    let name = |t: &Tried| (t.hypothesis.code, t.hypothesis.subject.clone());
    let mut numbers: Vec<(Code, String)> = tried.iter().filter(|t| of_number(t)).map(name).collect();
    numbers.dedup();
    for number in numbers {
        let own = |t: &Tried| of_number(t) && name(t) == number;
        // In the place of its values: of what cannot be told apart the first in the list is believed.
        let place = tried.iter().take_while(|t| !own(t)).count();
        let (values, others): (Vec<Tried>, Vec<Tried>) = std::mem::take(tried).into_iter().partition(own);
        *tried = others;
        // A number that changes nothing fits as well at any value.
        let worth = nearest_value(values, before);
        tried.splice(place..place, worth.map(|best| golden_section_search(now, before, best)));
    }
}

/// The value that fits best, of those that fit better than without the change: by each dwell, or, where a precise sensor finds all of
/// them as bad as can be, by how far they are off together.
fn nearest_value(values: Vec<Tried>, before: &Misfit) -> Option<Tried> {
    let falls = |t: &Tried| t.misfit.log < before.log - SAME_FACTOR.ln();
    let nears =
        |t: &Tried| t.misfit.used >= before.used && t.misfit.of_spread() < before.of_spread() / SAME_FACTOR;
    let by_dwells = values.iter().any(falls);
    let worth = values.into_iter().filter(|t| if by_dwells { falls(t) } else { nears(t) });
    worth.min_by(|a, b| match by_dwells {
        true => a.misfit.log.total_cmp(&b.misfit.log),
        false => a.misfit.of_spread().total_cmp(&b.misfit.of_spread()),
    })
}

/// The best value of a number between the neighbours of the one that was tried, by golden section.
fn golden_section_search(now: &Inputs, before: &Misfit, tried: Tried) -> Tried {
    let Some(number) = tried.hypothesis.number.clone() else { return tried };
    let ratio = (5f64.sqrt() - 1.0) / 2.0;
    let at = |value: f64| {
        let of_value = (number.at)(value);
        let number = Some(Number { value, ..number.clone() });
        fit_hypothesis(now, before, Hypothesis { number, freedom: Freedom::Number, ..of_value })
    };
    // By the spread: of a scale, the plain mean is least at too small a one.
    let mean = |t: &Option<Tried>| t.as_ref().map_or(f64::INFINITY, |t| t.misfit.of_spread());
    let [mut low, mut high] = number.between;
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_a, mut at_b) = (at(a), at(b));
    // Each step keeps the better of the two inner values, and tries one more.
    for _ in 1..REFINEMENTS {
        if mean(&at_a) < mean(&at_b) {
            (high, b, at_b) = (b, a, at_a);
            a = high - ratio * (high - low);
            at_a = at(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + ratio * (high - low);
            at_b = at(b);
        }
    }
    let mut best = tried;
    for other in [at_a, at_b].into_iter().flatten() {
        if other.misfit.of_spread() < best.misfit.of_spread() {
            best = other;
        }
    }
    rounded(best, &number, &at)
}

/// A factor as somebody would have entered it, itself or its reciprocal to two digits, where that fits as well.
fn rounded(best: Tried, number: &Number, at: &dyn Fn(f64) -> Option<Tried>) -> Tried {
    let Some(value) = best.hypothesis.number.as_ref().map(|n| n.value).filter(|_| number.nothing == 1.0)
    else {
        return best;
    };
    let to_two = |x: f64| (x * 100.0).round() / 100.0;
    let near = [to_two(value), 1.0 / to_two(1.0 / value)];
    let inside = |x: &f64| (number.between[0]..=number.between[1]).contains(x);
    let tried = near.into_iter().filter(inside).filter_map(at);
    let as_well = |t: &Tried| t.misfit.of_spread() <= SAME_FACTOR * best.misfit.of_spread();
    let round = tried.filter(as_well).min_by(|a, b| a.misfit.of_spread().total_cmp(&b.misfit.of_spread()));
    round.unwrap_or(best)
}

/// The rounds of a trial, which end where nothing more could come of it.
struct Trial<'a> {
    /// What is fitted.
    inputs: &'a Inputs,
    /// The misfit that it must explain.
    before: &'a Misfit,
}

impl Rounds for Trial<'_> {
    fn is_worth_fitting(&mut self, observations: &[Observation]) -> bool {
        let total = self.inputs.dwells().count() as f64;
        let used: BTreeSet<_> = observations.iter().map(|o| o.dwell).collect();
        // A later round may find places for more.
        let most = used.len() as f64 + MORE_LATER * total;
        let least_log = (total - most).max(0.0) / total.max(1.0) * Misfit::of_nothing().log;
        most >= self.before.used as f64 || could_explain(self.before, least_log)
    }

    fn goes_on(&mut self, fitted: &Fitted) -> bool {
        let now = compute_misfit(self.inputs, fitted);
        let seats = now.seated > self.before.seated;
        seats || now.of_spread() < self.before.of_spread() || now.log < self.before.log
    }
}

/// A hypothesis, fitted as far as it could still explain what is left without it.
fn fit_hypothesis(now: &Inputs, before: &Misfit, hypothesis: Hypothesis) -> Option<Tried> {
    let inputs = hypothesis.undone(now);
    let fitted = fit_places(&inputs, &mut Trial { inputs: &inputs, before }).ok()?;
    let misfit = compute_misfit(&inputs, &fitted);
    Some(Tried { hypothesis, inputs, fitted, misfit })
}
