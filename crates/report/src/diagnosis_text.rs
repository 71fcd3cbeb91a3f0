//! What is missing, for a person in the terminal.

use crate::called::Called;
use crate::explanations::{explanations, nested_sentence};
use crate::findings::shown_unlisted;
use crate::look_at::look_at;
use crate::pen::{Pen, TerminalStyle, number};
use crate::run::Run;
use crate::sizes::{clear, size_in_table, sizes, sizes_of};
use crate::text::printable;
use armcal_calibrate::HeldOut;
use armcal_core::{Certainty, SetupReport, listed};
use armcal_diagnose::{Diagnosis, FoundEffect, UnknownReport, Verdict};
use armcal_model::{EffectKind, EffectSpec, Family, effects_toml, find};
use comfy_table::Cell;
use std::collections::BTreeSet;

/// Rows of the ranking.
pub(crate) const RANKED: usize = 8;
/// Heading of errors that no calibration gave.
pub(crate) const PREDICTED: &str = "linearised, left out [mm]";
/// Amplitudes of an effect that are told where there is a line or two.
const FEW_SIZES: usize = 2;
/// Share of a curve [%] from which the multiples of a ripple are worth a word.
const BENT_PERCENT: f64 = 5.0;
/// Where the declared noise gives this many times the error that remains it is declared too large.
const OVERDECLARED: f64 = 1.5;
/// Heading of the tables that add what is unlisted.
pub(crate) const PASTE: &str = "To paste into the pipeline";

/// The diagnosis of a run in full, ending in a newline; says so where there is none.
pub fn diagnosis_text(run: &Run, style: TerminalStyle) -> String {
    match &run.diagnosis {
        None => run.answer().sentence + "\n",
        Some(d) => full_text(&run.called(), d, style),
    }
}

/// A diagnosis in full.
pub(crate) fn full_text(called: &Called, d: &Diagnosis, style: TerminalStyle) -> String {
    full(&Pen { style }, called, d)
}

/// What is missing: the answer, what was found, what to do next.
fn brief(pen: &Pen, called: &Called, d: &Diagnosis) -> String {
    let list = |label, entries: Vec<String>| pen.list(entries.into_iter().map(|entry| (label, entry)));
    pen.section(&headline(called, d), list("-", all_found(called, d)) + &list("next:", next(called, d)))
}

/// What was found: with names, without one, and what the choice among them is worth; one entry each.
pub(crate) fn all_found(called: &Called, d: &Diagnosis) -> Vec<String> {
    let nested = d.nested.iter().map(|n| printable(&nested_sentence(n)));
    let beside = d.beside_curves().iter().map(|e| format!("{WITH_CURVES}{}", found(e)));
    let all = d.effects.iter().map(found).chain(shown_unlisted(d).map(unlisted)).chain(beside).chain(nested);
    all.map(|said| called.in_words(&said)).collect()
}

/// The same in a line or two each: names, sizes, and what they take of the error.
pub(crate) fn briefly_found(called: &Called, d: &Diagnosis) -> Vec<String> {
    let falls = |h: &HeldOut| format!("linearised from {:.3} to {:.3} mm", h.before, h.after);
    let sizes = |e: &FoundEffect| match e.parameters.len() {
        ..=FEW_SIZES => sizes_of(e),
        n if e.parameters.iter().all(|p| clear(p) < 1.0) => {
            format!("none of its {n} sizes is determined by itself")
        }
        _ => size_in_table(&e.parameters),
    };
    let named = d.effects.iter().map(|e| format!("{}: {}; {}", e.name, sizes(e), falls(&e.places)));
    let unlisted = shown_unlisted(d).map(|u| {
        format!(
            "unlisted, at {} over {}: {}",
            channel_told(&u.channel),
            driver_told(&u.driver),
            falls(&u.places)
        )
    });
    let beside = d
        .beside_curves()
        .iter()
        .map(|e| format!("{WITH_CURVES}{}: {}", e.set.join(" or "), falls(&e.places)));
    named.chain(unlisted).chain(beside).map(|said| called.in_words(&printable(&said))).collect()
}

/// What is said before an effect that shows only beside error curves of joints.
pub(crate) const WITH_CURVES: &str = "with these curves in the model also ";

/// What to do next, one step an entry.
pub(crate) fn next(called: &Called, d: &Diagnosis) -> Vec<String> {
    let recorded = d.record_next.iter().map(|r| called.in_words(&printable(r)));
    added(called, d).into_iter().chain(looked_at(called, d)).chain(recorded).collect()
}

/// The kind of an effect that was found; none of something without a name.
pub(crate) fn kind_of(e: &FoundEffect) -> Option<&'static EffectKind> {
    e.name.split([':', '@', ',']).next().and_then(find)
}

/// The kind of all effects that were found, where they are of one.
fn one_kind(d: &Diagnosis) -> Option<&'static EffectKind> {
    let mut kinds = d.effects.iter().map(|e| kind_of(e).filter(|kind| kind.family != Family::User));
    let first = kinds.next()??;
    kinds.all(|kind| kind.is_some_and(|k| k.name == first.name)).then_some(first)
}

/// What to look at on the rig, once for all effects of one kind; only where one name is left.
fn looked_at(called: &Called, d: &Diagnosis) -> Vec<String> {
    let mut steps: Vec<(&str, Vec<&str>)> = Vec::new();
    for e in d.effects.iter().filter(|e| e.set.len() == 1) {
        let Some(kind) = kind_of(e).filter(|kind| kind.family != Family::User) else { continue };
        match steps.iter_mut().find(|(advice, _)| *advice == look_at(kind)) {
            Some((_, names)) => names.push(&e.name),
            None => steps.push((look_at(kind), vec![&e.name])),
        }
    }
    let step = |(advice, names): (&str, Vec<&str>)| {
        let (capital, rest) = advice.split_at(1);
        let advice = format!("{}{}", capital.to_ascii_lowercase(), rest.trim_end_matches('.'));
        printable(&format!("{}: {advice}", names.join(", ")))
    };
    steps.into_iter().map(|s| called.in_words(&step(s))).collect()
}

/// What adding it to the model does, where something was found and a calibration with it confirms it.
fn added(called: &Called, d: &Diagnosis) -> Option<String> {
    if !called.is_refitted {
        return None;
    }
    let (before, after) = (d.holdout_mm.before, d.holdout_mm.after);
    let error = d.judged.words();
    let does = match d.warnings.iter().any(|w| w.code == "judged-by-fit") {
        true => format!(
            "the fitted points err less; the mean {error} error, {before:.3} and {after:.3} mm, does not change clear of chance"
        ),
        false => format!("the mean {error} error goes from {before:.3} to {after:.3} mm"),
    };
    // `armcal add` reads the recordings of a pipeline; a pool has none.
    let adds = match called.is_pool {
        true => "with it under `[[effects]]` of the pipeline, pooled again",
        false => "`armcal add suggested PIPELINE` adds it to the model",
    };
    Some(format!("{adds}: {does}"))
}

/// The answer in one sentence.
pub(crate) fn headline(called: &Called, d: &Diagnosis) -> String {
    let ties = called.ties.iter().map(|(name, all)| tied(name, all));
    let also = overdeclared(d).into_iter().chain(ties);
    let told = [as_spelt(called, d)].into_iter().chain(also).collect::<Vec<_>>().join(" ");
    called.in_words(&told) + &joints_told(called, d)
}

/// That a name in the model stands for one of several.
fn tied(name: &str, all: &[String]) -> String {
    printable(&format!("In the model, {name} is one of {}: the data did not tell which.", listed(all)))
}

/// That errors end below what the declared noise gives, where they do, and by how much.
fn overdeclared(d: &Diagnosis) -> Option<String> {
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
    let told = |joint: &usize| Some(format!(" Joint {} is {}.", joint + 1, printable(names.get(*joint)?)));
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
            let names = printable(&d.names.join(", "));
            let meaning = one_kind(d).map_or(String::new(), |kind| format!(" In words: {}.", kind.summary));
            format!("Missing: {names} ({probability}p = {:.3}){}.{meaning}", d.p_adjusted, beside(d))
        }
        Verdict::Ambiguous => {
            let sets: Vec<String> = d.effects.iter().map(|e| one_of(&e.set)).collect();
            format!("Missing: {}{}.", printable(&sets.join("; and ")), beside(d))
        }
        Verdict::Unknown if d.unlisted.len() > 1 && curved_joints(d).len() == d.unlisted.len() => {
            let also: Vec<String> = d.beside_curves().iter().map(|e| e.set.join(" or ")).collect();
            let also = if also.is_empty() {
                String::new()
            } else {
                format!("; with that, also {}", also.join("; and "))
            };
            let joints = curved_joints(d).join(", ");
            printable(&format!(
                "Something unlisted is missing: joints {joints} each err over their own angle{also}."
            ))
        }
        Verdict::Unknown => match &d.unknown {
            Some(u) => match u.own_angle() {
                Some(joint) => format!(
                    "Something unlisted is missing: joint {} errs over its own angle ({}).",
                    joint + 1,
                    printable(&u.driver)
                ),
                None => format!(
                    "Something unlisted is missing: it enters at {} and depends on {}.",
                    printable(&channel_told(&u.channel)),
                    printable(&driver_told(&u.driver))
                ),
            },
            None => "Something is missing, and nothing listed explains it.".to_owned(),
        },
        Verdict::Unexplained => {
            let sentence = d.unexplained.as_ref().map(armcal_diagnose::Unexplained::sentence);
            let sentence =
                sentence.unwrap_or_else(|| "nothing that was tried predicts the errors".to_owned());
            printable(&format!("Unexplained: {sentence}."))
        }
    }
}

/// Where an error enters, in words.
pub fn channel_told(channel: &str) -> String {
    let joint = channel.strip_prefix("joint").filter(|n| n.chars().all(|c| c.is_ascii_digit()));
    match (channel, joint) {
        (_, Some(number)) if !number.is_empty() => format!("joint {number}"),
        ("lengths", _) => "all lengths of the arm".to_owned(),
        ("world", _) => "the tip, along an axis of the world".to_owned(),
        _ => channel.to_owned(),
    }
}

/// What an error depends on, in words before its spelling in formulas; other products and sums of drivers as they are spelt.
pub fn driver_told(driver: &str) -> String {
    let joint = |text: &str, kind: char| text.strip_prefix(kind)?.parse::<usize>().ok();
    let product = driver.split_once('*').and_then(|(s, q)| Some((joint(s, 's')?, joint(q, 'q')?)));
    let sum = driver.split_once('+').and_then(|(a, b)| Some((joint(a, 'q')?, joint(b, 'q')?)));
    match (product, sum) {
        (Some((s, q)), _) if s == q => {
            return format!("the angle of joint {q}, with opposite signs by direction of arrival ({driver})");
        }
        (_, Some((a, b))) => return format!("the sum of the angles of joints {a} and {b} ({driver})"),
        _ => {}
    }
    let (kind, joint) = driver.split_at(driver.find(|c: char| c.is_ascii_digit()).unwrap_or(driver.len()));
    let words = match (kind, joint.parse::<usize>()) {
        ("q", Ok(joint)) => format!("the angle of joint {joint}"),
        ("tau", Ok(joint)) => format!("the gravity torque on joint {joint}"),
        ("s", Ok(joint)) => format!("the direction in which joint {joint} arrived"),
        ("t", _) if joint.is_empty() => "time".to_owned(),
        _ => return driver.to_owned(),
    };
    format!("{words} ({driver})")
}

/// The mistakes of the setup in one sentence; none where there is none.
pub(crate) fn setup_sentence(setup: &SetupReport) -> Option<String> {
    let messages: Vec<&str> = setup.mistakes().map(|f| f.message.as_str()).collect();
    (!messages.is_empty()).then(|| printable(&format!("Setup first: {}.", messages.join("; also, "))))
}

/// The change of the setup that leaves less of the error than what is named physically, in one sentence.
pub(crate) fn setup_beside(setup: &SetupReport) -> Option<String> {
    let tried =
        setup.findings.iter().find(|f| f.certainty == Certainty::Possible && f.before_mm.is_some())?;
    Some(printable(&format!("Or the setup: {}.", tried.message)))
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
fn beside(d: &Diagnosis) -> String {
    d.unexplained.as_ref().map_or(String::new(), |u| {
        format!("; with it {:.3} mm remain, {:.1} times {}", u.error_mm, u.times_floor, u.measure())
    })
}

fn full(pen: &Pen, called: &Called, d: &Diagnosis) -> String {
    let told = |said: &str| called.in_words(&printable(said));
    let mut sections = vec![brief(pen, called, d)];
    sections.push(pen.section("Candidates, best first", ranking(pen, called, d)));
    if !d.cannot_tell_apart.is_empty() {
        let pairs = d.cannot_tell_apart.iter().map(|[a, b]| ("-", told(&format!("{a} and {b}"))));
        sections.push(pen.section("The same to these data", pen.list(pairs)));
    }
    if !d.not_testable.is_empty() {
        let rows = d.not_testable.iter().map(|n| {
            let text = format!(
                "{}: smallest size seen {}, typical {} ({})",
                n.effect, n.smallest_seen, n.typical, n.why
            );
            ("-", told(&text))
        });
        sections.push(pen.section("What these data could not have shown", pen.list(rows)));
    }
    let tables: Vec<String> = shown_unlisted(d).map(pasted).filter(|t| !t.is_empty()).collect();
    if !tables.is_empty() {
        sections.push(pen.section(PASTE, tables.join("\n")));
    }
    let sentences = explanations(d).into_iter().map(|e| {
        ("-", format!("{}: {}", called.recordings.number_label(&printable(&e.number)), told(&e.sentence)))
    });
    sections.push(pen.section("The numbers, one by one", pen.list(sentences)));
    sections.join("\n")
}

fn ranking(pen: &Pen, called: &Called, d: &Diagnosis) -> String {
    let mut table = pen.table(&[
        "explanation",
        "size",
        "behind [nats]",
        "probability",
        "p",
        PREDICTED,
        "absorbed",
        "also",
    ]);
    for c in d.candidates.iter().take(RANKED) {
        table.add_row(vec![
            Cell::new(called.in_words(&printable(&c.spec))),
            Cell::new(sizes(c)),
            number(behind(c.standing.map(|s| s.behind_nats), c.standing.map(|s| s.behind_se))),
            number(c.standing.map_or("-".into(), |s| format!("{:.3}", s.probability))),
            number(format!("{:.3}", c.p_adjusted)),
            number(c.holdout_mm.map_or("-".into(), |h| format!("{:.3} -> {:.3}", h.before, h.after))),
            number(format!("{:.0} %", c.absorbed * 100.0)),
            Cell::new(called.in_words(&printable(&c.same_to_the_data.join(", ")))),
        ]);
    }
    pen.render(&table)
}

/// How far behind the answer, with its standard error.
pub(crate) fn behind(nats: Option<f64>, se: Option<f64>) -> String {
    nats.zip(se).map_or("-".into(), |(nats, se)| format!("{nats:.1} ± {se:.1}"))
}

pub(crate) fn found(e: &FoundEffect) -> String {
    let set = if e.set.len() > 1 { format!(" (one of {})", e.set.join(", ")) } else { String::new() };
    let contrast = match &e.contrast {
        Some(c) if c.agrees => {
            format!("; {} pairs that differ only in {} confirm it", c.pairs, c.differs)
        }
        _ => String::new(),
    };
    let h = &e.places;
    let rival = e.rival.as_ref().map_or(String::new(), |r| {
        format!(
            "; the next listed explanation, {}, is {:.1} +- {:.1} nats behind and would leave {:.3} mm",
            r.name, r.behind_nats, r.behind_se, r.places.after
        )
    });
    printable(&format!(
        "{}{set}: {}; linearised, each place left out in turn: from {:.3} to {:.3} mm (change {:.3} to {:.3}, 95 \
         %){rival}{contrast}",
        e.name,
        sizes_of(e),
        h.before,
        h.after,
        h.change_ci95[0],
        h.change_ci95[1],
    ))
}

/// The `[[effects]]` table for something unlisted; empty where nothing offered reaches its shape.
pub(crate) fn pasted(u: &UnknownReport) -> String {
    u.effect().and_then(|effect| effects_toml(&[effect]).ok()).unwrap_or_default()
}

pub(crate) fn unlisted(u: &UnknownReport) -> String {
    let range = match (u.shape.first(), u.shape.last()) {
        // An angle that counts with the direction of arrival is an angle.
        (Some(from), Some(to))
            if u.driver.rsplit('*').next().is_some_and(|driver| driver.starts_with('q')) =>
        {
            let deg = |at: f64| at.to_degrees();
            format!(", known for {} from {:.0} to {:.0} deg", u.driver, deg(from.at), deg(to.at))
        }
        (Some(from), Some(to)) => format!(", known for {} from {:.3} to {:.3}", u.driver, from.at, to.at),
        _ => String::new(),
    };
    let ripple = u.ripple.as_ref().map_or(String::new(), |r| {
        let (percent, amplitude) = (100.0 * r.share, u.unit.to_display(r.amplitude));
        let more = 100.0 * r.share_with_multiples - percent;
        let bent = if more >= BENT_PERCENT { format!(", {more:.0} % more with twice and three times that") } else { String::new() };
        format!(
            "; {percent:.0} % of it beside its slow part is a ripple of {:.1} periods a turn, amplitude {amplitude:.4} {}{bent}",
            r.periods_per_turn,
            u.unit.display_symbol()
        )
    });
    let formula = u
        .expression
        .as_ref()
        .map_or(String::new(), |e| format!("; as a formula on {}: {}", e.acts_on, e.formula));
    printable(&format!(
        "unlisted, at {} over {}: linearised, each place left out in turn: from {:.3} to {:.3} mm with \
         its shape{range}{ripple}{formula}",
        channel_told(&u.channel),
        driver_told(&u.driver),
        u.places.before,
        u.places.after
    ))
}

#[cfg(test)]
mod tests {
    use super::{channel_told, driver_told};

    #[test]
    fn places_where_an_error_enters_are_told_in_words() {
        let told = ["joint12", "lengths", "joint2.a", "joint2 with the direction of joint3 kept", "joint"]
            .map(channel_told);
        let words = [
            "joint 12",
            "all lengths of the arm",
            "joint2.a",
            "joint2 with the direction of joint3 kept",
            "joint",
        ];
        assert_eq!(told, words);
    }

    #[test]
    fn drivers_are_told_in_words_before_their_spelling() {
        let told =
            ["q2", "tau3", "s1", "t", "s1*q1", "q1+q2", "s1*q2", "temperature", "recording"].map(driver_told);
        assert_eq!(
            told,
            [
                "the angle of joint 2 (q2)",
                "the gravity torque on joint 3 (tau3)",
                "the direction in which joint 1 arrived (s1)",
                "time (t)",
                "the angle of joint 1, with opposite signs by direction of arrival (s1*q1)",
                "the sum of the angles of joints 1 and 2 (q1+q2)",
                "s1*q2",
                "temperature",
                "recording"
            ]
        );
    }
}
