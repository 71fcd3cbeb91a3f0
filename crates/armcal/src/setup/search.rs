//! Every hypothesis against the inputs as they are: which one change explains the errors?

use super::alone::each_alone;
use super::beyond::beyond_physics;
use super::hypotheses::{Freedom, Hypothesis, Number, hypotheses};
use super::trial::{Inputs, Misfit};
use super::unseen::unseen;
use super::weigh::{ALIKE_FACTOR, at_the_floor, best, explains, far_enough, in_doubt, outdone};
use super::words::{finding, moved_frame};
use crate::story::Fitted;
use armcal_calibrate::Calibration;
use armcal_core::{Certainty, Parameter, Role, SetupFinding, SetupReport};
use rayon::prelude::*;

/// Mistakes one upon the other.
const MOST_MISTAKES: usize = 3;
/// Codes of changes that let the model's own parameters go.
const OF_THE_MODEL: [&str; 3] = ["parameter-bound", "parameter-fixed", "joint-zero"];
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

/// Searches one mistake after the other while each divides the errors, and adds what it finds to the report.
/// `fitted` is the calibration as it came; none where there was no way to calibrate.
pub fn search(inputs: &Inputs, fitted: Option<&Fitted>, report: &mut SetupReport) {
    let mut now = inputs.for_trials();
    let mut first = now.fit().ok();
    let judged = fitted.map(|f| &f.calibration);
    let mut found: Vec<(Hypothesis, Vec<String>)> = Vec::new();
    let mut before = first.as_ref().map_or_else(Misfit::of_nothing, |f| now.misfit(f));
    let begun = before;
    if !in_doubt(&begun) {
        report.not_testable.extend(unseen(&now, &begun));
        return;
    }
    let mut possible = Vec::new();
    while found.len() < MOST_MISTAKES && in_doubt(&before) {
        let at_bound = first.as_ref().map(at_bound).unwrap_or_default();
        let (mut tried, mut within) = (Vec::new(), Vec::new());
        for some in hypotheses(&now, &at_bound) {
            // A frame that is let go takes a share of anything: what is rarer may still fit better.
            if tried.iter().all(|t: &Tried| t.hypothesis.freedom == Freedom::Frame) {
                report.tried += some.len();
                let all = attempted(&now, &before, some);
                let (far, near) = explaining(&now, first.as_ref(), &before, all, &mut possible);
                tried.extend(far);
                within.extend(near);
            }
        }
        let weights: Vec<(Freedom, f64)> = tried.iter().map(weight).collect();
        let Some(best) = best(&weights).filter(|k| !outdone(weights[*k], &within)) else { break };
        let alike = |t: &&Tried| {
            t.hypothesis.freedom == tried[best].hypothesis.freedom
                && (t.misfit.log - tried[best].misfit.log).abs() < ALIKE_FACTOR.ln()
        };
        let own = &tried[best].hypothesis.change;
        let others = tried.iter().filter(|t| alike(t) && t.hypothesis.change != *own);
        let mut alternatives: Vec<String> = others.map(|t| t.hypothesis.change.clone()).collect();
        // A search from several starts comes to one end.
        alternatives.dedup();
        let Tried { hypothesis, inputs, fitted, misfit } = tried.swap_remove(best);
        found.push((hypothesis, alternatives));
        (now, first, before) = (inputs, Some(fitted), misfit);
    }
    let alone = || fitted.and_then(|fitted| each_alone(inputs, fitted, &begun));
    if found.is_empty() {
        report.findings.extend(alone().or_else(|| perhaps(inputs, judged, &begun, &possible)));
        return;
    }
    if let [(only, _)] = &found[..]
        && only.recording.is_some()
        && let Some(finding) = alone()
    {
        report.findings.push(finding);
        return;
    }
    // Everything together on all dwells and the pipeline's own hold-out: the numbers that are reported.
    let mut mended = inputs.clone();
    found.iter().for_each(|(h, _)| mended = h.undone(&mended));
    let after_fit = mended.fit().ok();
    let after = after_fit.as_ref().map(|f| f.calibration.clone());
    let together = found.iter().map(|(h, _)| h.change.as_str()).collect::<Vec<_>>().join(" and ");
    for (h, alternatives) in &found {
        let (before, after) = ((judged, begun), (after.as_ref(), before));
        let ends = match (fitted, &after_fit) {
            (Some(from), Some(to)) => moved_frame(&mended, h, from, to),
            _ => None,
        };
        report.findings.push(finding(h, &together, alternatives, ends, before, after));
    }
}

/// The change of the model's own parameters that would explain as much as a physical effect: told beside its name.
fn perhaps(
    inputs: &Inputs,
    judged: Option<&Calibration>,
    begun: &Misfit,
    possible: &[Tried],
) -> Option<SetupFinding> {
    let weights: Vec<(Freedom, f64)> = possible.iter().map(weight).collect();
    let Tried { hypothesis, misfit, .. } = &possible[best(&weights)?];
    let after = hypothesis.undone(inputs).fit().ok()?.calibration;
    let (before, after) = ((judged, *begun), (Some(&after), *misfit));
    let finding = finding(hypothesis, &hypothesis.change, &[], None, before, after);
    Some(SetupFinding { certainty: Certainty::Possible, ..finding })
}

fn weight(t: &Tried) -> (Freedom, f64) {
    (t.hypothesis.freedom, t.misfit.log)
}

/// Hypotheses, fitted.
fn attempted(now: &Inputs, before: &Misfit, all: Vec<Hypothesis>) -> Vec<Tried> {
    let mut tried: Vec<Tried> = all.into_par_iter().filter_map(|h| attempt(now, h)).collect();
    refine_numbers(now, before, &mut tried);
    tried
}

/// Those that explain the errors; of what explains them with a number that physics reaches, freedom and misfit. Changes of
/// the model's own parameters that leave nothing above the floor, but too little was above it to be sure, are `possible`.
fn explaining(
    now: &Inputs,
    first: Option<&Fitted>,
    before: &Misfit,
    tried: Vec<Tried>,
    possible: &mut Vec<Tried>,
) -> (Vec<Tried>, Vec<(Freedom, f64)>) {
    let (mut far, mut within) = (Vec::new(), Vec::new());
    for t in tried {
        let explains = explains(before, &t.misfit) && far_enough(before, t.hypothesis.freedom, &t.misfit);
        let own = OF_THE_MODEL.contains(&t.hypothesis.code) && !t.hypothesis.estimated.is_empty();
        if !explains && !(own && at_the_floor(before, &t.misfit)) {
            continue;
        }
        match (beyond_physics(now, first, &t), explains) {
            (true, true) => far.push(t),
            (true, false) => possible.push(t),
            (false, true) if t.hypothesis.number.is_some() => within.push(weight(&t)),
            (false, _) => {}
        }
    }
    (far, within)
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
        tried.retain(|t| !own(t));
        tried.extend(refined);
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

fn at_bound(fitted: &Fitted) -> Vec<Parameter> {
    let estimates = &fitted.calibration.fit.estimates;
    let own = estimates.iter().filter(|e| e.at_bound && e.parameter.role == Role::Robot);
    own.map(|e| e.parameter.clone()).collect()
}
