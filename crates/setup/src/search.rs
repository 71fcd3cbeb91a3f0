//! Every hypothesis against the inputs as they are: which one change explains the errors?

use super::alone::each_alone;
use super::attempt::{Tried, fit_hypotheses};
use super::beyond::Physics;
use super::describe::{Side, describe_gain, moved_frame, scale_with_interval, setup_finding};
use super::hypotheses::{Freedom, Hypothesis, hypotheses_by_rarity};
use super::moving::Moving;
use super::spread::moved_m;
use super::trial::{Misfit, compute_misfit, for_trials};
use super::unseen::untestable_sign;
use super::weigh::{
    ALIKE_FACTOR, at_the_floor, explains_errors, far_enough, in_doubt, is_certain, is_gross,
    most_parsimonious, physics_explains_better,
};
use armcal_core::{Certainty, Parameter, Role, SetupFinding, SetupReport};
use armcal_stages::{Fitted, Inputs};
use rayon::prelude::*;

/// Mistakes one upon the other.
const MOST_MISTAKES: usize = 3;
/// What makes the errors of the nominal arm this many times as large undoes no mistake.
const HOPELESS: f64 = 2.0;

/// A mistake that was found, and the changes that these data cannot tell from it.
type Found = (Hypothesis, Vec<String>);

/// Searches one mistake after the other while each divides the errors, and adds what it finds to the report.
/// `fitted` is the calibration as it came; none where there was no way to calibrate.
pub fn find_mistakes(inputs: &Inputs, fitted: Option<&Fitted>, report: &mut SetupReport) {
    let now = for_trials(inputs, fitted);
    let first = now.fit().ok();
    let begun = first.as_ref().map_or_else(Misfit::of_nothing, |f| compute_misfit(&now, f));
    if !in_doubt(&begun) {
        report.not_testable.extend(untestable_sign(&now, &begun));
        return;
    }
    let mut possible = Vec::new();
    let (found, ended) = one_upon_the_other(now, first, begun, report, &mut possible);
    let one_recording = matches!(&found[..], [(only, _)] if only.recording.is_some());
    let alone = fitted.filter(|_| found.is_empty() || one_recording);
    let sure = match alone.and_then(|fitted| each_alone(inputs, fitted, &begun)) {
        Some(finding) => vec![finding],
        None => confirm_mistakes(inputs, fitted, &found, (begun, ended)),
    };
    if sure.is_empty() {
        report.findings.extend(fitted.and_then(|f| possible_explanation(inputs, f, &begun, &possible)));
    }
    report.findings.extend(sure);
}

/// The mistakes that explain the errors, and the misfit without them; `first` is the fit as it is, `before` its misfit.
fn one_upon_the_other(
    mut now: Inputs,
    mut first: Option<Fitted>,
    mut before: Misfit,
    report: &mut SetupReport,
    possible: &mut Vec<Tried>,
) -> (Vec<Found>, Misfit) {
    let mut found: Vec<Found> = Vec::new();
    while found.len() < MOST_MISTAKES && in_doubt(&before) {
        let at_bound = first.as_ref().map(at_bound).unwrap_or_default();
        now.pipeline.fit.give_up_above_m =
            first.as_ref().map(|f| HOPELESS * f.calibration.judged().nominal.mean_m);
        let (mut tried, mut within) = (Vec::new(), Vec::new());
        let physics = Physics::of(&now, first.as_ref());
        // Fewer equations than parameters follow any number that is let go.
        let few = first.as_ref().is_some_and(|f| f.calibration.fit.too_few_dwells().is_some());
        let moving = first.as_ref().and_then(|fitted| Moving::of(&now, fitted, &before));
        let gross = is_gross(&before, first.as_ref().map_or(0.0, moved_m));
        for mut some in hypotheses_by_rarity(&now, &at_bound, gross) {
            some.retain(|h| !few || h.freedom == Freedom::Discrete);
            let worth = |h: &Hypothesis| moving.as_ref().is_none_or(|m| !m.goes_too_far(h));
            some = some.into_par_iter().filter(worth).collect();
            // A frame that is let go takes a share of anything: what is rarer may still fit better.
            if tried.iter().all(|t: &Tried| t.hypothesis.freedom == Freedom::Frame) {
                report.tried += some.len();
                let all = fit_hypotheses(&now, &before, some);
                let (far, near) = classify_explanations(&physics, &before, all, possible);
                tried.extend(far);
                within.extend(near);
            }
        }
        let weights: Vec<(Freedom, f64)> = tried.iter().map(freedom_and_misfit).collect();
        let Some(best) =
            most_parsimonious(&weights).filter(|k| !physics_explains_better(weights[*k], &within))
        else {
            break;
        };
        let (freedom, log) = weights[best];
        let alike = |t: &&Tried| {
            let (other, other_log) = freedom_and_misfit(t);
            other == freedom && (other_log - log).abs() < ALIKE_FACTOR.ln()
        };
        let own = &tried[best].hypothesis.change;
        let others = tried.iter().filter(alike).map(|t| &t.hypothesis.change).filter(|change| *change != own);
        let mut alternatives: Vec<String> = others.cloned().collect();
        // A search from several starts comes to one end.
        alternatives.dedup();
        let Tried { hypothesis, inputs, fitted, misfit } = tried.swap_remove(best);
        found.push((hypothesis, alternatives));
        (now, first, before) = (inputs, Some(fitted), misfit);
    }
    (found, before)
}

/// What was found as it is reported: everything undone together on all dwells and the pipeline's own hold-out gives the
/// numbers. Nothing where that improves nothing, whatever a quick fit said.
fn confirm_mistakes(
    inputs: &Inputs,
    fitted: Option<&Fitted>,
    found: &[Found],
    (begun, ended): (Misfit, Misfit),
) -> Vec<SetupFinding> {
    if found.is_empty() {
        return Vec::new();
    }
    let mut mended = inputs.clone();
    found.iter().for_each(|(h, _)| mended = h.undone(&mended));
    let after = mended.fit().ok();
    let together = found.iter().map(|(h, _)| h.change.as_str()).collect::<Vec<_>>().join(" and ");
    let sides = (&Side { fitted, trial: begun }, &Side { fitted: after.as_ref(), trial: ended });
    let Some(gain) = describe_gain(sides.0, sides.1) else { return Vec::new() };
    // The keys of each hold what those before it did.
    let mut streams = inputs.pipeline.streams.clone();
    let one = |(h, alternatives): &Found| {
        let moved = fitted.zip(after.as_ref()).and_then(|(from, to)| moved_frame(&mended, h, from, to));
        let moved = moved.or_else(|| scale_with_interval(&mended, h));
        let finding = setup_finding(h, (&together, &gain), alternatives, moved, sides, &streams);
        finding.mend.iter().for_each(|mend| _ = streams.mend(mend));
        finding
    };
    found.iter().map(one).collect()
}

/// The change of a frame or of the model's own parameters that would explain as much as a physical effect: told beside its name.
fn possible_explanation(
    inputs: &Inputs,
    fitted: &Fitted,
    begun: &Misfit,
    possible: &[Tried],
) -> Option<SetupFinding> {
    let weights: Vec<(Freedom, f64)> = possible.iter().map(freedom_and_misfit).collect();
    let Tried { hypothesis, misfit, .. } = &possible[most_parsimonious(&weights)?];
    let mended = hypothesis.undone(inputs).fit().ok()?;
    let moved = moved_frame(inputs, hypothesis, fitted, &mended);
    let before = Side { fitted: Some(fitted), trial: *begun };
    let after = Side { fitted: Some(&mended), trial: *misfit };
    let gain = describe_gain(&before, &after)?;
    let streams = &inputs.pipeline.streams;
    let finding =
        setup_finding(hypothesis, (&hypothesis.change, &gain), &[], moved, (&before, &after), streams);
    Some(SetupFinding { certainty: Certainty::Possible, ..finding })
}

fn freedom_and_misfit(t: &Tried) -> (Freedom, f64) {
    (t.hypothesis.freedom, t.misfit.log)
}

/// Those that explain the errors; of what explains them with a number that physics reaches, freedom and misfit. Where too
/// little was above the floor to be sure, frames and changes of the model's own parameters are `possible`, and so are frames that
/// are no further off than physics may have it.
fn classify_explanations(
    physics: &Physics<'_>,
    before: &Misfit,
    tried: Vec<Tried>,
    possible: &mut Vec<Tried>,
) -> (Vec<Tried>, Vec<(Freedom, f64)>) {
    let (mut far, mut within) = (Vec::new(), Vec::new());
    for t in tried {
        let explains =
            explains_errors(before, &t.misfit) && far_enough(before, t.hypothesis.freedom, &t.misfit);
        let perhaps = t.hypothesis.of_the_model() && at_the_floor(before, &t.misfit);
        if !(explains || perhaps) {
            continue;
        }
        let certain =
            explains && (t.hypothesis.recording.is_some() || is_certain(before, t.hypothesis.freedom));
        match (physics.is_outdone_by(&t), certain) {
            (true, true) => far.push(t),
            (true, false) => possible.push(t),
            (false, true) if t.hypothesis.number.is_some() => within.push(freedom_and_misfit(&t)),
            (false, true) if physics.leaves_standing(&t) => possible.push(t),
            (false, _) => {}
        }
    }
    (far, within)
}

fn at_bound(fitted: &Fitted) -> Vec<Parameter> {
    let estimates = &fitted.calibration.fit.estimates;
    let own = estimates.iter().filter(|e| e.at_bound && e.parameter.role == Role::Robot);
    own.map(|e| e.parameter.clone()).collect()
}
