//! How a run ends, in sentences: what the calibration reached, what is missing, whether the result stands, what to do next.
//! Terminal and viewer say the same because both say this.

use crate::answer::answer;
use crate::found::{all_found, briefly_found};
use crate::next::next_steps;
use crate::pool_story;
use crate::text::conclusion;
use crate::told_warning::{ToldWarning, gravest_first};
use crate::two_arms::scale_step;
use armcal_result::{Run, Status};

/// What to do where the setup contradicts the data.
const MEND: &str =
    "mend what is said above and run again; what is missing physically is looked for after that";

/// Entries of a list that fit on one screen: of what was found, of what to do next, of grave warnings.
pub const SHOWN: usize = 2;

/// The end of a run.
pub struct Story {
    /// One word for a lamp: the status where the result does not stand, or the verdict that says why; else the verdict.
    pub lamp: &'static str,
    /// What the calibration reached.
    pub calibration: String,
    /// What is missing; empty where that is never looked for.
    pub missing: String,
    /// One entry for everything that was found.
    pub found: Vec<String>,
    /// The same in a line or two each.
    pub found_briefly: Vec<String>,
    /// Whether the result stands.
    pub status: Status,
    /// Whether the diagnosis found something that the model does not have.
    incomplete: bool,
    /// What to do, one step an entry.
    pub next: Vec<String>,
    /// Every warning, the gravest first, otherwise those of the recordings first.
    pub warnings: Vec<ToldWarning>,
}

impl Story {
    /// Of a run.
    pub fn of(run: &Run) -> Story {
        let answer = answer(run);
        let status = run.status();
        let (diagnosis, called) = (run.diagnosis.as_ref(), run.called());
        Story {
            lamp: lamp_status(answer.word, status),
            calibration: conclusion(&run.calibration) + &pool_story::transfer_sentence(run),
            found: diagnosis.map_or_else(Vec::new, |d| all_found(&called, d)),
            found_briefly: diagnosis.map_or_else(Vec::new, |d| briefly_found(&called, d)),
            status,
            incomplete: matches!(answer.word, "identified" | "ambiguous" | "unknown"),
            next: match diagnosis {
                Some(d) => next_steps(&called, d)
                    .into_iter()
                    .chain(pool_story::unseen_day_step(run))
                    .chain(scale_step(run))
                    .collect(),
                None if answer.word == "setup" => vec![MEND.to_owned()],
                None => pool_story::missing_effect_step(run)
                    .into_iter()
                    .chain(pool_story::unseen_day_step(run))
                    .chain(scale_step(run))
                    .collect(),
            },
            warnings: warnings_by_severity(run),
            missing: answer.sentence,
        }
    }

    /// Of what has no diagnosis: what was reached, and what else is to be known at first sight.
    pub fn undiagnosed(
        calibration: String,
        found: Vec<String>,
        status: Status,
        next: Vec<String>,
        warnings: Vec<ToldWarning>,
    ) -> Story {
        Story {
            lamp: lamp_status("not_diagnosed", status),
            calibration,
            missing: String::new(),
            found_briefly: found.clone(),
            found,
            status,
            incomplete: false,
            next,
            warnings: gravest_first(warnings),
        }
    }

    /// What a reader needs, a sentence an entry, the first first: as much as the terminal prints last, which is what a panel
    /// shows without being scrolled.
    pub fn lines(&self) -> Vec<String> {
        let label = if self.missing.is_empty() { "" } else { "found: " };
        let shown = |entries: &[String], label: &str, tab: &str| {
            let more = entries.len().saturating_sub(SHOWN);
            let first = entries.iter().take(SHOWN).map(|entry| format!("{label}{entry}"));
            let rest = (more > 0).then(|| format!("{label}and {more} more, on the tab {tab}"));
            first.chain(rest).collect::<Vec<_>>()
        };
        let (next, found) =
            (shown(&self.next, "next: ", "Missing"), shown(&self.found_briefly, label, "Numbers"));
        let status = format!("Status: {}", self.status_sentence());
        let head =
            [self.missing.clone(), self.calibration.clone()].into_iter().filter(|line| !line.is_empty());
        head.chain([status]).chain(next).chain(found).collect()
    }

    /// What to do first, as far as a screen has room.
    pub fn first_steps(&self) -> &[String] {
        &self.next[..self.next.len().min(SHOWN)]
    }

    /// How many steps there are beyond those.
    pub fn more_steps(&self) -> usize {
        self.next.len() - self.first_steps().len()
    }

    /// Whether the result stands, and what the command exits with.
    pub fn status_sentence(&self) -> &'static str {
        match self.status {
            Status::Ok if self.incomplete => "ok (exit code 0), with a model that misses what is said above.",
            status => status_sentence(status),
        }
    }
}

/// Whether a result of this status stands, and what the command exits with.
pub fn status_sentence(status: Status) -> &'static str {
    match status {
        Status::Ok => "ok.",
        Status::Inadequate => {
            "inadequate (exit code 3): the result cannot be trusted as it is, for what is said above."
        }
        Status::DataLost => {
            "data lost (exit code 3): a part of the input was not used; the warnings say which."
        }
    }
}

fn warnings_by_severity(run: &Run) -> Vec<ToldWarning> {
    let names = run.recording_names();
    let of_recordings = run.recordings.iter().flat_map(|r| {
        let told = |w| ToldWarning::new(&names, Some(&r.name), w);
        r.all_warnings().into_iter().map(told).collect::<Vec<_>>()
    });
    let overall = run.overall_warnings();
    gravest_first(of_recordings.chain(overall.iter().map(|w| ToldWarning::new(&names, None, w))).collect())
}

/// Never a verdict of success where the result does not stand.
fn lamp_status(verdict: &'static str, status: Status) -> &'static str {
    match status {
        Status::Ok => verdict,
        _ if matches!(verdict, "unexplained" | "setup") => verdict,
        _ => status.word(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lamp_is_a_verdict_of_success_only_where_the_result_stands() {
        assert_eq!(lamp_status("nothing_missing", Status::Ok), "nothing_missing");
        assert_eq!(lamp_status("nothing_missing", Status::Inadequate), "inadequate");
        assert_eq!(lamp_status("nothing_missing", Status::DataLost), "data_lost");
        assert_eq!(lamp_status("identified", Status::Inadequate), "inadequate");
        assert_eq!(lamp_status("unexplained", Status::Inadequate), "unexplained");
        assert_eq!(lamp_status("setup", Status::DataLost), "setup");
    }
}
