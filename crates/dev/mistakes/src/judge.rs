//! Judges what was said to a mistake, by nothing but that.

use crate::causes::{Cause, find_cause};
use crate::run::{Place, Said, Statement};
use crate::{Draw, Error, Kind, Rig, Session, run};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A held-out error above this many times the floor, and the program may not end as if nothing were the matter.
pub const SHOWN: f64 = 2.0;

/// `nothing_missing` may not be said above this many times the floor.
pub const NOTHING: f64 = 1.5;

/// How an answer is to be judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Judgement {
    /// The cause is reported.
    Right,
    /// The held-out error is near the floor and nothing false is said: these data do not show the mistake.
    NotShown,
    /// Neither the cause nor anything false is reported: exit 1 or 3 with other words, or another mistake is reported.
    Missed,
    /// Exit 0 with a held-out error above [`SHOWN`] floors, and no cause.
    FalseDone,
    /// A physical effect is named alone.
    FalseName,
    /// `nothing_missing` above [`NOTHING`] floors.
    FalseNothing,
    /// Not ended, or ended by a panic.
    Broken,
}

impl Judgement {
    /// For the table.
    pub fn words(self) -> &'static str {
        match self {
            Judgement::Right => "ok",
            Judgement::NotShown => "ok, not shown",
            Judgement::Missed => "miss",
            Judgement::FalseDone => "FALSE: exit 0",
            Judgement::FalseName => "FALSE: effect named",
            Judgement::FalseNothing => "FALSE: nothing missing",
            Judgement::Broken => "BROKEN",
        }
    }
}

/// One mistake on one rig, and what came of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Case {
    /// The kind's name.
    pub kind: String,
    /// Its cause.
    pub cause: String,
    /// The rig.
    pub rig: Rig,
    /// The seed.
    pub seed: u64,
    /// What a report about a part has to name one of.
    pub about: Vec<String>,
    /// What was said.
    pub said: Said,
    /// The statement that names the cause.
    pub reported: Option<String>,
    /// How right that was.
    pub judgement: Judgement,
}

/// Makes one mistake on one rig, runs the program on it in `folder`, and judges.
pub fn run_case(armcal: &Path, kind: &Kind, rig: Rig, seed: u64, folder: &Path) -> Result<Case, Error> {
    let mut session = Session::sound(rig, seed, kind.name)?;
    let about = kind.make(&mut session, &mut Draw::new(seed, kind.name, rig.word()))?;
    let said = run::run(armcal, &session, folder)?;
    let (reported, judgement) = judge(&said, kind.cause, &about);
    let (kind, cause) = (kind.name.to_owned(), kind.cause.to_owned());
    Ok(Case { kind, cause, rig, seed, about, said, reported, judgement })
}

impl Case {
    /// Judges again what was said, as after a change of the table of causes.
    pub fn judged_again(self) -> Case {
        let (reported, judgement) = judge(&self.said, &self.cause, &self.about);
        Case { reported, judgement, ..self }
    }
}

/// What of it names the cause, and how right the whole is.
pub fn judge(said: &Said, cause_name: &str, about: &[String]) -> (Option<String>, Judgement) {
    let reported = find_report(said, cause_name, about);
    let above = |floors: f64| said.ratio().is_none_or(|ratio| ratio.is_nan() || ratio > floors);
    let done = matches!(said.exit, Some(0 | 3));
    let findings = said.statements.iter().any(|s| s.place == Place::Setup);
    let nothing = said.verdict.as_deref() == Some("nothing_missing");
    let judgement = match () {
        () if !matches!(said.exit, Some(0 | 1 | 3)) => Judgement::Broken,
        () if done && nothing && above(NOTHING) => Judgement::FalseNothing,
        () if reported.is_some() => Judgement::Right,
        () if done && said.names() => Judgement::FalseName,
        () if said.exit == Some(0) && above(SHOWN) => Judgement::FalseDone,
        () if done && !above(SHOWN) && !findings => Judgement::NotShown,
        () => Judgement::Missed,
    };
    (reported, judgement)
}

fn find_report(said: &Said, name: &str, about: &[String]) -> Option<String> {
    let cause = find_cause(name)?;
    let of_cavity = name == "board-typo";
    let statement = said.statements.iter().find(|s| names_cause(s, cause, of_cavity, about));
    let label = |s: &Statement| match s.code.as_str() {
        "" => "error message".to_owned(),
        code => code.to_owned(),
    };
    let effect = || {
        let kind = |effect: &str| effect.split([':', '@', ',']).next().unwrap_or_default().to_owned();
        let named = said.effects.iter().find(|effect| cause.effects.contains(&kind(effect)));
        named.filter(|_| said.names()).cloned()
    };
    statement.map(label).or_else(effect)
}

fn names_cause(statement: &Statement, cause: &Cause, of_cavity: bool, about: &[String]) -> bool {
    let text = without_checklists(&statement.text.to_lowercase());
    let code = cause.codes.iter().any(|code| statement.code.contains(code.as_str()));
    if !code && !cause.words.iter().any(|word| text.contains(word.as_str())) {
        return false;
    }
    // A report about a joint, or about a cavity, has to be about the right one.
    let particular = statement.code.starts_with("joint") || of_cavity;
    about.is_empty() || !particular || about.iter().any(|part| text.contains(&part.to_lowercase()))
}

/// The text without advice that lists several things to look at: that names none of them.
fn without_checklists(text: &str) -> String {
    let mut kept = String::new();
    for sentence in text.split_inclusive([';', ':', '.', '\n']) {
        let advice = ["check ", "look for "].iter().any(|word| sentence.trim_start().starts_with(word));
        let parts: usize = [", ", " and ", " or "].iter().map(|word| sentence.matches(word).count()).sum();
        if !(advice && parts >= 4) {
            kept += sentence;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(exit: i32, ratio: f64, verdict: &str) -> Said {
        Said {
            exit: Some(exit),
            held_out_mm: Some(ratio),
            floor_mm: Some(1.0),
            verdict: Some(verdict.to_owned()),
            ..Said::default()
        }
    }

    fn with(said: Said, place: Place, code: &str, text: &str) -> Said {
        Said { statements: vec![Statement { place, code: code.into(), text: text.into() }], ..said }
    }

    fn judged(said: &Said) -> Judgement {
        judge(said, "joint-sign", &["joint2".into()]).1
    }

    #[test]
    fn only_the_right_joint_is_the_right_cause() {
        let unexplained = || said(3, 100.0, "unexplained");
        let right = with(unexplained(), Place::Setup, "joint-sign", "joint2: with its sign reversed");
        let wrong = with(unexplained(), Place::Setup, "joint-sign", "joint3: with its sign reversed");
        assert_eq!(judged(&right), Judgement::Right);
        assert_eq!(judged(&wrong), Judgement::Missed);
        assert_eq!(judged(&unexplained()), Judgement::Missed);
    }

    #[test]
    fn false_sentences_are_told_from_misses() {
        assert_eq!(judged(&said(0, 100.0, "unexplained")), Judgement::FalseDone);
        assert_eq!(judged(&said(0, 2.0, "unexplained")), Judgement::NotShown);
        assert_eq!(judged(&said(3, 1.6, "nothing_missing")), Judgement::FalseNothing);
        assert_eq!(judged(&said(0, 1.4, "nothing_missing")), Judgement::NotShown);
        assert_eq!(judged(&said(3, 100.0, "identified")), Judgement::FalseName);
        assert_eq!(judged(&said(3, 1.2, "ambiguous")), Judgement::FalseName);
        assert_eq!(judged(&said(101, 1.0, "nothing_missing")), Judgement::Broken);
        assert_eq!(judged(&Said { exit: Some(1), ..Said::default() }), Judgement::Missed);
        // A number that is not there, or not a number, is not near the floor.
        assert_eq!(judged(&Said { exit: Some(0), ..Said::default() }), Judgement::FalseDone);
        assert_eq!(judged(&said(0, f64::NAN, "unexplained")), Judgement::FalseDone);
    }

    #[test]
    fn naming_the_cause_does_not_excuse_nothing_missing() {
        let both = with(said(0, 3.0, "nothing_missing"), Place::Warning, "joint-sign", "joint2");
        assert_eq!(judged(&both), Judgement::FalseNothing);
        let accused = with(said(0, 1.0, "nothing_missing"), Place::Setup, "board-mirror", "board");
        assert_eq!(judged(&accused), Judgement::Missed, "a false accusation is no silence");
    }

    #[test]
    fn a_list_of_all_that_may_be_wrong_names_nothing() {
        let list = "the board does not fit. Check that the board file is right, that its pose and tilt are right, and that \
                    the model's base and tool are right";
        let refused = |text: &str| with(Said { exit: Some(1), ..Said::default() }, Place::Error, "", text);
        assert_eq!(judge(&refused(list), "tilt-declared-wrong", &[]).1, Judgement::Missed);
        let short = "the board does not fit: check the declared tilt and the board's pose";
        assert_eq!(judge(&refused(short), "tilt-declared-wrong", &[]).1, Judgement::Right);
    }

    #[test]
    fn an_effect_counts_where_it_is_the_cause() {
        let slip = Said { effects: vec!["zero_slip:2@1".into()], ..said(0, 3.0, "identified") };
        assert_eq!(judge(&slip, "joint-zero-event", &[]).1, Judgement::Right);
        assert_eq!(judge(&slip, "joint-sign", &[]).1, Judgement::FalseName);
    }
}
