//! Each number of the verdict in one plain sentence.

use armcal_diagnose::{DependsOn, Diagnosis, FoundEffect, Nested, Unexplained, Verdict};
use armcal_result::summary::Explanation;
use std::collections::BTreeMap;

/// Sentences for the verdict and its numbers.
pub fn explanations(d: &Diagnosis) -> Vec<Explanation> {
    let mut all = Vec::new();
    let mut say = |number: &str, sentence: String| {
        all.push(Explanation { number: number.to_string(), sentence });
    };
    say("verdict", verdict_sentence(d));
    say(
        "p_nothing",
        format!(
            "of all explanations that were scored by dwells their fits did not see, nothing has a probability of {}",
            probability_text(d.p_nothing)
        ),
    );
    say(
        "p_adjusted",
        format!(
            "if there were only noise that repeats as it does here, the best of all {} candidates would look this \
             convincing in a share {:.3} of data sets ({} sign-flipped copies; a name needs at most {})",
            d.candidates.len(),
            d.p_adjusted,
            d.gate.resamplings,
            d.gate.max_p_adjusted
        ),
    );
    for e in &d.effects {
        explain_effect(e, &mut say);
    }
    let found = match d.effects.is_empty() && d.unlisted.is_empty() {
        true => String::new(),
        false => format!(" without and {:.3} mm with what was found", d.holdout_mm.after),
    };
    say(
        "holdout_mm",
        format!(
            "the mean {} error is {:.3} mm{found}; the declared noise alone would give {:.3} mm{}",
            d.judged.words(),
            d.holdout_mm.before,
            d.floor_mm,
            d.repeatability_mm
                .map_or(String::new(), |mm| format!(", and poses that were revisited differ by {mm:.3} mm"))
        ),
    );
    for u in &d.unlisted {
        let known = match (u.shape.first(), u.shape.last()) {
            (Some(first), Some(last)) if matches!(u.driver, DependsOn::Angle(_) | DependsOn::AngleSum(_)) => {
                format!(
                    "; it is known for {} from {:.0} to {:.0} deg, the angles visited, and says nothing beyond",
                    u.driver,
                    first.at.to_degrees(),
                    last.at.to_degrees()
                )
            }
            _ => String::new(),
        };
        say(
            "unknown",
            format!(
                "what no listed effect explains looks most like something that enters at {} and depends on {}; with that \
                 shape in the linearised model the mean error of places left out in turn goes from {:.3} to {:.3} mm{known}",
                u.channel, u.driver, u.places.before, u.places.after
            ),
        );
    }
    if !d.tentative.is_empty() {
        let names: Vec<String> = d.tentative.iter().map(|t| t.set.join(" or ")).collect();
        say(
            "tentative",
            match d.beside_curves().is_empty() {
                true => format!(
                    "with that unlisted shape in the model too, the data also ask for {}",
                    names.join("; and ")
                ),
                false => format!(
                    "with these curves in the model the data also ask for {}; `armcal add suggested` adds that with them",
                    names.join("; and ")
                ),
            },
        );
    }
    say(
        "sigma_ratio",
        format!("what remains scatters {:.2} times as much as the declared noise", d.noise.sigma_ratio),
    );
    if !d.not_testable.is_empty() {
        say(
            "not_testable",
            format!(
                "{} effects of realistic size would have gone unseen in these data; they are not excluded",
                d.not_testable.len()
            ),
        );
    }
    let not_chosen_again = d.not_chosen_again.iter();
    let chosen_again =
        d.nested.iter().map(nested_sentence).chain(
            not_chosen_again.map(|why| format!("not chosen again without the held-out points: {why}")),
        );
    chosen_again.for_each(|sentence| say("nested", sentence));
    all
}

/// What a choice is worth on points that had no part in it, in one sentence without its capital.
pub fn nested_sentence(nested: &Nested) -> String {
    let turns = nested.chosen.len();
    // The order in which they were found is no other choice.
    let named = |effects: &Vec<String>| {
        let mut names = effects.clone();
        names.sort();
        if names.is_empty() { "nothing".to_owned() } else { names.join(" + ") }
    };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    nested.chosen.iter().for_each(|effects| *counts.entry(named(effects)).or_default() += 1);
    let chosen: Vec<String> =
        counts.iter().map(|(names, count)| format!("{names} in {count} of {turns}")).collect();
    format!(
        "chosen without the held-out points ({}), it {}; chosen with them, to {:.3} mm",
        chosen.join(", "),
        nested.held_out.change_text(),
        nested.chosen_on_all_mm
    )
}

fn verdict_sentence(d: &Diagnosis) -> String {
    let rest = match (&d.unknown, d.rest_may_be_shape) {
        (Some(_), true) => {
            "; what is left over is so small that it may be the shape of an effect that was found"
        }
        (Some(_), false) => "; something without a listed name is left over",
        (None, _) => "",
    };
    match d.verdict {
        Verdict::NothingMissing => {
            "nothing is missing that these data can show; the list of what they cannot show belongs to this answer".to_string()
        }
        Verdict::Identified => {
            let confirmed = d.effects.iter().all(|e| e.contrast.as_ref().is_some_and(|c| c.agrees));
            let word = if confirmed { "the cause is" } else { "the data are consistent with" };
            format!("{word} {}, and with no other name{rest}", d.names.join(" and "))
        }
        Verdict::Ambiguous => {
            let sets: Vec<String> = d.effects.iter().map(|e| e.set.join(" or ")).collect();
            format!("an effect is missing, and these data leave more than one name: {}{rest}", sets.join("; and: "))
        }
        Verdict::Unknown => "something is missing, and no listed effect explains it better than an unlisted one".to_string(),
        Verdict::Unexplained => d.unexplained.as_ref().map_or_else(
            || "the errors do not agree with the declared noise, and nothing that was tried predicts them".to_string(),
            Unexplained::sentence,
        ),
    }
}

fn explain_effect(e: &FoundEffect, say: &mut dyn FnMut(&str, String)) {
    say(
        &format!("{}.probability", e.name),
        format!(
            "given the other effects found, {} is the cause with probability {} among all that was refitted in its place",
            e.set.join(" or "),
            probability_text(e.probability)
        ),
    );
    say(
        &format!("{}.gain", e.name),
        format!(
            "of dwells that the fit did not see, the model with {} says {:.1} +- {:.1} nats more than without{}",
            e.name,
            e.gain_nats,
            e.gain_se,
            e.above_unlisted_nats.map_or(String::new(), |nats| format!(
                ", and {:.1} nats {} than with the best unlisted explanation in its place",
                nats.abs(),
                if nats < 0.0 { "less" } else { "more" }
            ))
        ),
    );
    say(
        &format!("{}.places", e.name),
        format!(
            "{} in the linearised model changes the mean error of places left out in turn from {:.3} to {:.3} mm (95 % \
             interval of the change {:.3} to {:.3} mm)",
            e.name, e.places.before, e.places.after, e.places.change_ci95[0], e.places.change_ci95[1]
        ),
    );
    if let Some(r) = &e.rival {
        say(
            &format!("{}.rival", e.name),
            format!(
                "the next listed explanation is {}, {:.1} +- {:.1} nats behind once both are refitted",
                r.name, r.behind_nats, r.behind_se
            ),
        );
    }
    if let Some(c) = &e.contrast {
        say(
            &format!("{}.contrast", e.name),
            format!(
                "{} pairs of visits to one pose that differ in {} show {:.2} +- {:.2} times the fitted size{}",
                c.pairs,
                c.differs,
                c.ratio,
                c.ratio_sigma,
                if c.agrees { ", which confirms it free of geometry" } else { ", which does not confirm it" }
            ),
        );
    }
}

/// A probability, small ones as what they are below.
fn probability_text(p: f64) -> String {
    if p < 5e-4 { "less than 0.001".to_owned() } else { format!("{p:.3}") }
}

#[cfg(test)]
mod tests {
    use super::nested_sentence;
    use armcal_calibrate::HeldOut;
    use armcal_diagnose::Nested;

    #[test]
    fn a_choice_made_again_is_counted_whatever_the_order_of_its_effects() {
        let turns = [vec!["backlash:2", "scale:1"], vec!["scale:1", "backlash:2"], vec![]];
        let held_out =
            HeldOut { before: 1.0, after: 0.9, change_ci95: [-0.3, 0.1], gain: 0.1, p: 0.5, groups: 12 };
        let chosen = turns.map(|effects| effects.into_iter().map(str::to_owned).collect()).to_vec();
        assert_eq!(
            nested_sentence(&Nested { held_out, chosen_on_all_mm: 0.8, chosen }),
            "chosen without the held-out points (backlash:2 + scale:1 in 2 of 3, nothing in 1 of 3), it changes the mean error there \
             from 1.000 to 0.900 mm (95 % -0.300 to +0.100); chosen with them, to 0.800 mm"
        );
    }
}
