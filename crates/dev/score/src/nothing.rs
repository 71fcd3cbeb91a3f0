//! The table of scenarios that hide nothing listed.

use super::interval::Share;
use super::judge::NEAR_FLOOR;
use super::{Judgement, Scored};
use armcal_diagnose::Verdict;
use armcal_lab::planted::null_families;
use armcal_lab::scenario::Hidden;
use std::fmt::Write as _;

/// What was said where nothing listed was hidden, for each kind of noise.
pub(super) fn table_by_noise(scored: &[Scored]) -> String {
    let mut text = String::from(
        "| noise | n | wrong (95 %) | named | unknown | unexplained | silent |\n|---|---|---|---|---|---|---|\n",
    );
    let mut line = |label: &str, own: &[&Scored]| {
        let count = |of: &dyn Fn(&Scored) -> bool| own.iter().filter(|s| of(s)).count();
        let wrong = Share { k: count(&|s| s.judgement != Judgement::RightlySilent), n: own.len() };
        let said = |verdict| count(&|s| s.answer.sets.is_empty() && s.answer.verdict == verdict);
        let _ = writeln!(
            text,
            "| {label} | {} | {} | {} | {} | {} | {} |",
            own.len(),
            wrong.words(),
            count(&|s| !s.answer.sets.is_empty()),
            said(Verdict::Unknown),
            said(Verdict::Unexplained),
            count(&|s| s.judgement == Judgement::Silent),
        );
    };
    for family in null_families() {
        let own: Vec<&Scored> = scored.iter().filter(|s| s.scenario.family == family).collect();
        if !own.is_empty() {
            line(noise_description(family), &own);
        }
    }
    line("all", &scored.iter().collect::<Vec<_>>());
    if scored.iter().flat_map(|s| &s.hidden).any(Hidden::is_discrepancy) {
        let _ = write!(
            text,
            "\nA smooth displacement is a random function of the joint angles (a Gaussian process, length 0.5 to 1.5 rad), as \
             large per axis\nat the dwells as the row says. It has no name: any is wrong, *unknown* and *unexplained* are \
             right, and so is silence\nonly where the held-out error is within {NEAR_FLOOR} of the floor.\n"
        );
    }
    text
}

fn noise_description(family: &str) -> &str {
    match family {
        "nothing" => "as declared",
        "nothing:white" => "no cavity tolerance",
        "nothing:cavities" => "three times the declared cavity tolerance",
        "nothing:autocorrelated" => "memory over seats, and a camera that wanders over 15 s",
        "nothing:heavy_tails" => "heavy tails (Student t, 3 degrees of freedom)",
        "nothing:swaps" => "marker swaps",
        "nothing:smooth_3" => "a smooth displacement of the tip, 3 times the declared noise",
        "nothing:smooth_10" => "a smooth displacement of the tip, 10 times the declared noise",
        other => other,
    }
}
