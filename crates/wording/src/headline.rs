//! What is missing, in one sentence.

use crate::drivers::{channel_told, driver_told};
use crate::found::kind_of;
use armcal_core::{list_names, printable_name};
use armcal_diagnose::{Diagnosis, UnknownReport, Verdict};
use armcal_model::{EffectKind, EffectSpec, Family};
use armcal_result::Called;
use std::collections::BTreeSet;

/// Where the declared noise gives this many times the error that remains it is declared too large.
const OVERDECLARED: f64 = 1.5;

/// The answer in one sentence.
pub fn headline(called: &Called, d: &Diagnosis) -> String {
    let ties = called.ties.iter().map(|(name, all)| tie_sentence(name, all));
    let also = excess_noise_sentence(d).into_iter().chain(ties);
    let told = [as_spelt(called, d)].into_iter().chain(also).collect::<Vec<_>>().join(" ");
    called.in_words(&told) + &joints_told(called, d)
}

/// That a name in the model stands for one of several.
fn tie_sentence(name: &str, all: &[String]) -> String {
    printable_name(&format!(
        "In the model, {name} is one of {}: the data did not tell which.",
        list_names(all)
    ))
}

/// That errors end below what the declared noise gives, where they do, and by how much.
fn excess_noise_sentence(d: &Diagnosis) -> Option<String> {
    let (floor, error) = (d.floor_mm, d.holdout_mm.after);
    (floor > OVERDECLARED * error).then(|| {
        format!(
            "The noise is declared too large: it would give a mean error of {floor:.3} mm, {:.1} times the {error:.3} mm that \
             remain.",
            floor / error
        )
    })
}

/// The names of the joints that a headline numbers through all branches; nothing for an arm without any.
fn joints_told(called: &Called, d: &Diagnosis) -> String {
    let names = &called.branched_joints;
    if names.is_empty() {
        return String::new();
    }
    let of_effects =
        d.effects.iter().flat_map(|e| &e.set).filter_map(|name| EffectSpec::parse(name, names).ok());
    let targets = of_effects.filter_map(|spec| spec.target);
    let curves = d.unlisted.iter().chain(&d.unknown).filter_map(|u| u.own_angle());
    let joints: BTreeSet<usize> = targets.chain(curves).collect();
    let told =
        |joint: &usize| Some(format!(" Joint {} is {}.", joint + 1, printable_name(names.get(*joint)?)));
    joints.iter().filter_map(told).collect()
}

/// The same with recordings by their index, and events as a pipeline spells them.
fn as_spelt(called: &Called, d: &Diagnosis) -> String {
    let unseen = d.not_testable.len();
    match d.verdict {
        Verdict::NothingMissing => {
            let not_shown = match unseen {
                0 => String::new(),
                n => format!(" ({n} effects of realistic size would not have shown)"),
            };
            let nothing = if called.ties.is_empty() { "Nothing" } else { "Nothing else" };
            format!("{nothing} is missing that these data can show{not_shown}.")
        }
        Verdict::Identified => {
            let probability = d.probability.map_or(String::new(), |p| format!("probability {p:.2}, "));
            let names = printable_name(&d.names.join(", "));
            let meaning = one_kind(d).map_or(String::new(), |kind| format!(" In words: {}.", kind.summary));
            format!(
                "Missing: {names} ({probability}p = {:.3}){}.{meaning}",
                d.p_adjusted,
                remaining_error_text(d)
            )
        }
        Verdict::Ambiguous => {
            let sets: Vec<String> = d.effects.iter().map(|e| one_of(&e.set)).collect();
            format!("Missing: {}{}.", printable_name(&sets.join("; and ")), remaining_error_text(d))
        }
        Verdict::Unknown if d.unlisted.len() > 1 && curved_joints(d).len() == d.unlisted.len() => {
            let also: Vec<String> = d.beside_curves().iter().map(|e| e.set.join(" or ")).collect();
            let also = if also.is_empty() {
                String::new()
            } else {
                format!("; with that, also {}", also.join("; and "))
            };
            let joints = curved_joints(d).join(", ");
            printable_name(&format!(
                "Something unlisted is missing: joints {joints} each err over their own angle{also}."
            ))
        }
        Verdict::Unknown => match &d.unknown {
            Some(u) => match u.own_angle() {
                Some(joint) => format!(
                    "Something unlisted is missing: joint {} errs over its own angle ({}).",
                    joint + 1,
                    u.driver
                ),
                None => format!(
                    "Something unlisted is missing: it enters at {} and depends on {}.",
                    printable_name(&channel_told(&u.channel)),
                    driver_told(u.driver)
                ),
            },
            None => "Something is missing, and nothing listed explains it.".to_owned(),
        },
        Verdict::Unexplained => {
            let sentence = d.unexplained.as_ref().map(armcal_diagnose::Unexplained::sentence);
            let sentence =
                sentence.unwrap_or_else(|| "nothing that was tried predicts the errors".to_owned());
            printable_name(&format!("Unexplained: {sentence}."))
        }
    }
}

/// The kind of all effects that were found, where they are of one.
fn one_kind(d: &Diagnosis) -> Option<&'static EffectKind> {
    let mut kinds = d.effects.iter().map(|e| kind_of(e).filter(|kind| kind.family != Family::User));
    let first = kinds.next()??;
    kinds.all(|kind| kind.is_some_and(|k| k.name == first.name)).then_some(first)
}

/// Numbers of the joints that err over their own angle, the strongest first.
fn curved_joints(d: &Diagnosis) -> Vec<String> {
    d.unlisted.iter().filter_map(UnknownReport::own_angle).map(|joint| (joint + 1).to_string()).collect()
}

/// One effect by its name, or by all names that these data leave.
fn one_of(set: &[String]) -> String {
    match set {
        [name] => name.clone(),
        names => format!("one of {} (these data cannot tell which)", names.join(", ")),
    }
}

/// What stands beside the names: how much of the error they leave.
fn remaining_error_text(d: &Diagnosis) -> String {
    d.unexplained.as_ref().map_or(String::new(), |u| {
        format!("; with it {:.3} mm remain, {:.1} times {}", u.error_mm, u.times_floor, u.measure())
    })
}
