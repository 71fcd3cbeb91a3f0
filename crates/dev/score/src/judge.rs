//! An answer against the truth.

use super::case::Answer;
use armcal_diagnose::{NOT_LISTED, Verdict};
use armcal_lab::scenario::Hidden;
use armcal_model::{Since, place_and_moment};
use serde::Serialize;

/// Dwells by which the moment of an event may be missed: between two dwells, nobody can tell.
pub(super) const DWELLS: usize = 2;

/// A held-out error within this factor of the floor is at the floor.
pub(super) const AT_FLOOR: f64 = 1.1;

/// Errors within this factor of the floor may be called nothing: the diagnosis's own `floor_factor`.
pub(super) const NEAR_FLOOR: f64 = 1.5;

/// How right an answer was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Judgement {
    /// Nothing that has a name was hidden, and no name was given.
    RightlySilent,
    /// Everything hidden was named first.
    First,
    /// Everything hidden was in the sets.
    InSet,
    /// Something outside the catalogue was called unknown, at its place and driver.
    Placed,
    /// Something outside the catalogue was given the name of the listed effect that it is a form of, nothing else.
    Nearest,
    /// Called unknown: with the catalogue holding it, or at another place.
    Unknown,
    /// Some of what was hidden was found, nothing wrong was claimed.
    Partial,
    /// Something hidden went unseen, and without it the held-out error is at the floor: these data do not show it.
    NotShown,
    /// Something hidden went unseen.
    Silent,
    /// A set that does not hold the truth.
    WrongSet,
    /// A name that is not the truth's, or a claim where nothing was hidden.
    Wrong,
}

/// Judges an answer by what was hidden.
pub fn judge(answer: &Answer, hidden: &[Hidden]) -> Judgement {
    if hidden.is_empty() {
        return match answer.verdict {
            Verdict::NothingMissing => Judgement::RightlySilent,
            // That errors above the floor do not agree with the declared noise is true, and names nothing.
            Verdict::Unexplained if answer.before_mm > AT_FLOOR * answer.floor_mm => Judgement::RightlySilent,
            _ => Judgement::Wrong,
        };
    }
    if hidden.iter().all(Hidden::is_discrepancy) {
        return judge_displacement(answer);
    }
    let listed: Vec<&Hidden> = hidden.iter().filter(|h| h.effect.is_some()).collect();
    if answer.verdict == Verdict::NothingMissing {
        let shown = answer.before_mm > AT_FLOOR * answer.floor_mm;
        return if shown { Judgement::Silent } else { Judgement::NotShown };
    }
    if listed.is_empty() {
        return judge_unlisted(answer, hidden);
    }
    let first = |h: &&Hidden| {
        answer.sets.iter().any(|set| set.first().is_some_and(|name| matches_name(h, name, false)))
    };
    let within = |h: &&Hidden| answer.sets.iter().flatten().any(|name| matches_name(h, name, true));
    let wrong = answer.sets.iter().filter(|set| !holds_truth(set, hidden)).count();
    let confident = answer.sets.iter().any(|set| set.len() == 1 && !holds_truth(set, hidden));
    if wrong == 0 && listed.iter().all(first) {
        return Judgement::First;
    }
    if wrong == 0 && listed.iter().all(within) {
        return Judgement::InSet;
    }
    match (answer.sets.is_empty(), confident, wrong) {
        (true, ..) => Judgement::Unknown,
        (_, true, _) => Judgement::Wrong,
        (_, _, 0) => Judgement::Partial,
        _ => Judgement::WrongSet,
    }
}

/// Whether one of the names is that of something hidden. That it may be something not listed is no name.
pub(super) fn holds_truth(set: &[String], hidden: &[Hidden]) -> bool {
    set.iter().any(|name| hidden.iter().any(|h| matches_name(h, name, true)))
}

/// Of a smooth displacement, which nothing listed is: any listed name is wrong, that something unlisted or unexplained is
/// left is right, and that nothing is missing is right only as long as the errors are near the floor.
fn judge_displacement(answer: &Answer) -> Judgement {
    if answer.sets.iter().flatten().any(|name| name != NOT_LISTED) {
        return Judgement::Wrong;
    }
    match answer.verdict {
        Verdict::NothingMissing if answer.before_mm > NEAR_FLOOR * answer.floor_mm => Judgement::Silent,
        _ => Judgement::RightlySilent,
    }
}

fn judge_unlisted(answer: &Answer, hidden: &[Hidden]) -> Judgement {
    let form = |name: &String| hidden.iter().flat_map(|h| &h.alike).any(|truth| same_effect(truth, name));
    let mut names = answer.sets.iter().flatten().filter(|name| *name != NOT_LISTED);
    if !answer.sets.is_empty() && names.all(form) {
        return Judgement::Nearest;
    }
    if answer.verdict == Verdict::Identified {
        return Judgement::Wrong;
    }
    if !answer.sets.is_empty() {
        return Judgement::WrongSet;
    }
    // What drives a product of two drives the product.
    let drives = |h: &str, said: &str| h == said || h.split('*').any(|factor| factor == said);
    let at = |(channel, driver): &(String, String)| {
        hidden.iter().any(|h| h.channel == *channel && drives(&h.driver, driver))
    };
    if answer.unknown.as_ref().is_some_and(at) { Judgement::Placed } else { Judgement::Unknown }
}

/// Whether a name is the hidden effect's, or one that is the same to the data; `alike` also takes what nearly is.
fn matches_name(hidden: &Hidden, name: &str, alike: bool) -> bool {
    let mut right: Vec<&String> = hidden.effect.iter().chain(&hidden.same).collect();
    if alike {
        right.extend(&hidden.alike);
    }
    right.into_iter().any(|truth| same_effect(truth, name))
}

/// The same kind at the same target; a moment may be missed by a few dwells, and shapes are not compared.
fn same_effect(truth: &str, name: &str) -> bool {
    let (Some((place, truth)), Some((other, name))) = (place_and_moment(truth), place_and_moment(name))
    else {
        return false;
    };
    let one_moment = match (truth, name) {
        (None, None) => true,
        // A step at the first dwell of a recording and one between recordings are one event.
        (Some(Since::Recording(r)), Some(Since::Dwell(d)))
        | (Some(Since::Dwell(d)), Some(Since::Recording(r))) => r == d.recording && d.dwell <= DWELLS,
        (Some(truth), Some(name)) => truth.near(&name, DWELLS),
        _ => false,
    };
    place == other && one_moment
}

#[cfg(test)]
mod tests {
    use super::{Judgement, judge, same_effect};
    use crate::page::tests::scored;
    use armcal_diagnose::{NOT_LISTED, Verdict};

    /// A smooth displacement has no name: what is told of it, at 1.2 and at 2 floors, and how right that is.
    #[test]
    fn of_a_smooth_displacement_every_name_is_wrong() {
        let hidden = armcal_lab::scenario::Hidden {
            effect: None,
            mechanism: "waves".to_owned(),
            ..scored("backlash", 1, Judgement::First, &[]).hidden.remove(0)
        };
        for (verdict, sets, far, near) in [
            (Verdict::Identified, &[&["backlash:2"][..]][..], Judgement::Wrong, Judgement::Wrong),
            (Verdict::Ambiguous, &[&["backlash:2", NOT_LISTED]], Judgement::Wrong, Judgement::Wrong),
            (Verdict::Unknown, &[], Judgement::RightlySilent, Judgement::RightlySilent),
            (Verdict::Unexplained, &[], Judgement::RightlySilent, Judgement::RightlySilent),
            (Verdict::NothingMissing, &[], Judgement::Silent, Judgement::RightlySilent),
        ] {
            let mut answer = scored("nothing:smooth_3", 1, Judgement::Wrong, sets).answer;
            answer.verdict = verdict;
            assert_eq!(judge(&answer, std::slice::from_ref(&hidden)), far, "{verdict:?}");
            answer.before_mm = 1.2 * answer.floor_mm;
            assert_eq!(judge(&answer, std::slice::from_ref(&hidden)), near, "{verdict:?} near the floor");
        }
    }

    #[test]
    fn names_are_the_same_within_what_nobody_can_tell() {
        assert!(same_effect("backlash:2", "backlash:2") && !same_effect("backlash:2", "backlash:3"));
        assert!(same_effect("periodic:1,frequency=30", "periodic:1,frequency=29.5"));
        assert!(
            same_effect("tool_shift@1.17", "tool_shift@1.19")
                && !same_effect("tool_shift@1.17", "tool_shift@1.20")
        );
        assert!(
            same_effect("tool_shift@1.17-25", "tool_shift@1.18-24")
                && !same_effect("tool_shift@1.17-25", "tool_shift@1.17")
                && !same_effect("tool_shift@1.17-25", "tool_shift@1.17-30")
        );
        assert!(
            same_effect("zero_slip:2@1", "zero_slip:2@1.0") && !same_effect("zero_slip:2@1", "zero_slip:2@2")
        );
    }
}
