//! What a run shows about the cause of a broken limit, in sentences that end in what to look at.

use super::limits::Limits;
use super::told::{all_warnings, listed_up};
use armcal_calibrate::Estimate;
use armcal_core::printable_name;
use armcal_core::{Code, Role, Severity};
use armcal_diagnose::{Diagnosis, FoundEffect, UnknownReport};
use armcal_model::{EffectSpec, Since, Target};
use armcal_result::{Run, Status};
use armcal_wording::{amplitude_text, channel_told, driver_told, look_at};

/// Everything the run says about what is wrong, the most telling first: bodies that moved, effects found, shapes
/// without a name, parameters on their bounds, warnings.
pub fn of_run(run: &Run, limits: &Limits) -> Vec<String> {
    let mut reasons = bodies_moved(run);
    if let Some(d) = &run.diagnosis {
        reasons.extend(d.effects.iter().map(|effect| run.in_words(&effect_sentence(run, limits, effect))));
        reasons.extend(d.unlisted.iter().map(unlisted_sentence));
    }
    reasons.extend(on_bounds(run));
    let grave = all_warnings(run).into_iter().filter(|w| w.severity > Severity::Notice && w.code != MOVED);
    let grave: Vec<String> = grave.map(|w| w.text).collect();
    reasons.extend(listed_up(grave, "warnings"));
    if reasons.is_empty() {
        reasons.push(nothing_said(run.diagnosis.as_ref()));
    }
    reasons
}

/// The warning about a body that moved; here it is told with its cause.
const MOVED: Code = Code::BodyMoved;

/// The table or the base moved while it was recorded.
fn bodies_moved(run: &Run) -> Vec<String> {
    let mut reasons = Vec::new();
    for recording in &run.recordings {
        for warning in recording.all_warnings().into_iter().filter(|w| w.code == MOVED) {
            let cause = match warning.subject.split(' ').next() {
                Some("table") => "The table was bumped or pushed, or its markers were: fasten both.",
                Some("base") => "The robot's foot slid, or the markers on its base were bumped: fasten both.",
                _ => "Fasten it.",
            };
            let how = warning
                .message
                .strip_prefix("a body that should stand still moved: ")
                .unwrap_or(&warning.message);
            let text = format!("In `{}` the {} moved: {how}. {cause}", recording.name, warning.subject);
            reasons.push(printable_name(&text));
        }
    }
    reasons
}

/// An effect that the diagnosis found: what happened, where, how large, and what to look at.
fn effect_sentence(run: &Run, limits: &Limits, effect: &FoundEffect) -> String {
    let joints = run.model.chain().joint_names();
    let sizes: Vec<String> = effect.parameters.iter().map(amplitude_text).collect();
    let others: Vec<&str> = effect.set.iter().filter(|n| **n != effect.name).map(String::as_str).collect();
    let rivals = match others.is_empty() {
        true => String::new(),
        false => format!(" These data cannot tell it from {}.", others.join(", ")),
    };
    let Some((spec, kind)) =
        EffectSpec::parse(&effect.name, joints).ok().and_then(|s| s.kind().ok().map(|k| (s, k)))
    else {
        return printable_name(&format!("{}: {}.{rivals}", effect.name, sizes.join(", ")));
    };
    let joint = spec.target.and_then(|j| joints.get(j)).map_or("", String::as_str);
    let teeth = match (kind.name, effect.parameters.first()) {
        ("zero_slip", Some(offset)) => limits.in_teeth(joint, offset.value),
        _ => String::new(),
    };
    let at = match (kind.target, &spec.marker) {
        (Target::Joint, _) => format!(" at {joint}"),
        (_, Some(marker)) => format!(" of {marker}"),
        _ => String::new(),
    };
    printable_name(&format!(
        "`{}`{at}{}: {}; {}{teeth}.{rivals} {} If it is here to stay, `armcal add {} PIPELINE` models it.",
        effect.name,
        since_text(run, spec.since),
        kind.summary,
        sizes.join(", "),
        look_at(kind),
        effect.name,
    ))
}

/// `, from dwell 17 of `roll` on`; `, in dwells 17 to 25 of `roll`; `, in `roll` as against the others`.
fn since_text(run: &Run, since: Option<Since>) -> String {
    let beside =
        if matches!(since, Some(Since::Recording(_))) { " as against the other recordings" } else { "" };
    let moment = since.and_then(|since| run.recording_names().moment(since));
    moment.map_or(String::new(), |moment| format!(",{moment}{beside}"))
}

fn unlisted_sentence(u: &UnknownReport) -> String {
    printable_name(&format!(
        "Something unlisted enters at {} and depends on {}: `armcal diagnose` shows its shape and a formula to add.",
        channel_told(&u.channel),
        driver_told(u.driver)
    ))
}

/// Robot parameters that want to go further than their bounds: a zero that slipped by more than its bound does.
fn on_bounds(run: &Run) -> Vec<String> {
    let estimates = run.calibration.fit.estimates.iter();
    let at_bound = |e: &&Estimate| e.at_bound && e.parameter.free && e.parameter.role == Role::Robot;
    let bounded = estimates.filter(at_bound).map(|e| {
        let p = &e.parameter;
        let change = p.unit.to_display(e.value - p.nominal);
        let cause = match zero_of(&p.name) {
            Some(joint) => {
                format!("the zero of {joint} may be further off: look for a slipped encoder or belt")
            }
            None => "it wants to go further, or something missing pulls there".to_owned(),
        };
        let (name, unit) = (&p.name, p.unit.display_symbol());
        printable_name(&format!("`{name}` is on its bound, {change:+.3} {unit} from nominal: {cause}."))
    });
    listed_up(bounded.collect(), "parameters on their bounds")
}

/// The joint whose zero a parameter is: `joint2` of `joint2.theta`.
pub fn zero_of(parameter: &str) -> Option<&str> {
    parameter.strip_suffix(".theta")
}

fn nothing_said(diagnosis: Option<&Diagnosis>) -> String {
    match diagnosis.map(|d| d.not_testable.len()) {
        None => "The run was not diagnosed; set [diagnosis] enabled = true to learn the cause.".to_owned(),
        Some(0) => {
            "The diagnosis finds no cause; `armcal run` and report.html show where the error is.".to_owned()
        }
        Some(n) => format!(
            "The diagnosis finds no cause, but {n} effects of realistic size would not have shown: `armcal diagnose` lists \
             them, report.html shows where the error is."
        ),
    }
}

/// Whether the fit explains its data: the parameters of one that does not are pulled about by what is missing.
pub fn is_model_adequate(run: &Run) -> bool {
    run.status() == Status::Ok && run.diagnosis.as_ref().is_none_or(|d| d.effects.is_empty())
}
