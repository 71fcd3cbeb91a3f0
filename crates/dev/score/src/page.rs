//! The page with all tables of a campaign of scenarios: `docs/confusion.md`, misses included.

use super::interval::Share;
use super::judge::{AT_FLOOR, DWELLS};
use super::table::{JUDGEMENTS, describe_answer};
use super::{Judgement, Reliability, Row, Scored, family_rows, nothing};
use armcal_lab::planted::{null_families, uncatalogued_families};
use armcal_result::VERSION;
use std::fmt::Write as _;

/// What was scored, and by which command.
#[derive(Debug, Clone)]
pub struct Campaign<'a> {
    /// The command, as it can be given again.
    pub command: String,
    /// Scenarios whose observations were handed over.
    pub scored: &'a [Scored],
    /// Scenarios that went through recordings on disk.
    pub whole_way: &'a [Scored],
    /// How many times as large as it is thought to be the noise was declared.
    pub noise_factor: f64,
}

/// Judgements by which what was hidden is found.
const FOUND: [Judgement; 5] =
    [Judgement::RightlySilent, Judgement::First, Judgement::InSet, Judgement::Placed, Judgement::Nearest];

/// The kinds of scenarios, each with a section of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Listed,
    Outside,
    Together,
    Nothing,
}

fn kind_of_family(family: &str) -> Kind {
    match family {
        _ if family.contains('+') => Kind::Together,
        _ if null_families().contains(&family) => Kind::Nothing,
        _ if uncatalogued_families().contains(&family) => Kind::Outside,
        _ => Kind::Listed,
    }
}

/// The page as Markdown. The same campaign gives the same bytes.
pub fn confusion_page(campaign: &Campaign<'_>) -> String {
    let mut text = introduction(campaign);
    let of = |wanted: Kind| -> Vec<Scored> {
        campaign.scored.iter().filter(|s| kind_of_family(&s.scenario.family) == wanted).cloned().collect()
    };
    let sections = [
        ("In the catalogue", of(Kind::Listed)),
        ("Outside the catalogue", of(Kind::Outside)),
        ("Two effects at once", of(Kind::Together)),
        ("The whole way", campaign.whole_way.to_vec()),
    ];
    for (title, scored) in sections.iter().filter(|(_, scored)| !scored.is_empty()) {
        let _ = write!(
            text,
            "\n## {title}\n\n{}\n{}",
            markdown_table(&family_rows(scored)),
            section_totals(scored)
        );
        if *title == "The whole way" {
            text += "\nThese scenarios were written as recordings, read back, and run as a pipeline: clocks, dwells, cavities, \
                     calibration, diagnosis.\n";
        }
    }
    let silent = of(Kind::Nothing);
    if !silent.is_empty() {
        let _ = write!(text, "\n## Nothing hidden\n\n{}", nothing::table_by_noise(&silent));
    }
    let told = Reliability::of(campaign.scored.iter().chain(campaign.whole_way));
    text + &told.section() + &misses_section(campaign)
}

fn introduction(campaign: &Campaign<'_>) -> String {
    let (n, seeds) = (campaign.scored.len() + campaign.whole_way.len(), seed_range(campaign));
    let declared = match campaign.noise_factor {
        1.0 => String::new(),
        factor => format!(
            "The noise of sensor, seats and encoders is declared {factor} times as large as it is; no reading differs.\n\n"
        ),
    };
    format!(
        "<!-- armcal.confusion/1 -->\n\n# How often the diagnosis is right\n\n\
         Written in one go by armcal {VERSION}: {n} scenarios, {seeds}.\n\n\
         ```sh\n{}\n```\n\n{declared}\
         Sealed scenarios of the simulated rig (`crates/lab`): the paper's geometry errors, masses up to 25 % off, one \
         mechanism\nsimulated by its own physics, its size log-uniform over what is realistic for a low-cost arm unless \
         `--size` says otherwise.\nThe tool sees the observations and the nominal arm; the scorer opens the truth \
         afterwards. Shares have exact 95 %\nintervals (Clopper-Pearson). Any scenario can be made again: `armcal \
         simulate --hide FAMILY --seed SEED`.\n\n\
         *first*: everything hidden is named first; *in set*: it is in the ambiguous set; *unknown, placed*: called \
         unlisted, at\nthe right joint or length and over the right driver; *nearest listed*: named as the listed effect \
         that it is a form of;\n*unknown*: called unlisted though it is listed, or at another place; *partial*: some of \
         it found, nothing wrong; *not shown*:\nnot seen, and without it the held-out error is within {AT_FLOOR} of the \
         floor; *silent*: not seen though it shows; *found*: first, in set, placed or nearest; *wrong set*,\n*wrong*: a set or a single name that does not hold \
         it. The moment of an event may be missed by {DWELLS} dwells. *before*,\n*after/floor*: median of the mean \
         error on held-out points before and after `armcal add suggested`, over the declared noise;\n*at floor*: share \
         within {AT_FLOOR} of it after; *removed*: median share of the excess over the floor that is gone.\n",
        campaign.command
    )
}

fn seed_range(campaign: &Campaign<'_>) -> String {
    let all = campaign.scored.iter().chain(campaign.whole_way).map(|s| s.scenario.seed);
    match (all.clone().min(), all.max()) {
        (Some(first), Some(last)) => format!("seeds {first} to {last}"),
        _ => "no seed".to_owned(),
    }
}

/// One row a family; of the judgements, the columns that are not empty.
fn markdown_table(rows: &[Row]) -> String {
    let used: Vec<usize> =
        (0..JUDGEMENTS.len()).filter(|k| rows.iter().any(|row| row.counts[*k] > 0)).collect();
    let designs = rows.iter().any(|row| row.design != rows[0].design);
    let mut text = String::from("| hidden | n |");
    used.iter().for_each(|k| text += &format!(" {} |", JUDGEMENTS[*k].1));
    text += " found (95 %) | before/floor | after/floor | at floor | removed |\n|---|---|";
    text += &"---|".repeat(used.len() + 5);
    text.push('\n');
    for row in rows {
        let design = if designs { format!(" ({})", row.design) } else { String::new() };
        let _ = write!(text, "| `{}`{design} | {} |", row.family, row.n);
        used.iter().for_each(|k| text += &format!(" {} |", row.counts[*k]));
        let found =
            JUDGEMENTS.iter().zip(row.counts).filter(|((j, _), _)| FOUND.contains(j)).map(|(_, n)| n).sum();
        let removed =
            if row.removed.is_nan() { "-".to_owned() } else { format!("{:.0} %", 100.0 * row.removed) };
        let _ = writeln!(
            text,
            " {} | {:.2} | {:.2} | {:.0} % | {removed} |",
            Share { k: found, n: row.n }.percent(),
            row.before,
            row.after,
            100.0 * row.at_floor,
        );
    }
    text
}

/// The sums of a section.
fn section_totals(scored: &[Scored]) -> String {
    let share = |judgements: &[Judgement]| {
        let k = scored.iter().filter(|s| judgements.contains(&s.judgement)).count();
        (k, Share { k, n: scored.len() }.words())
    };
    let mut text = String::new();
    for (what, judgements) in [
        ("Named first", &[Judgement::First][..]),
        ("Named first or in the set", &[Judgement::First, Judgement::InSet]),
        ("Called unlisted, at its place", &[Judgement::Placed]),
        ("Not seen though it shows", &[Judgement::Silent]),
        ("Confidently wrong", &[Judgement::Wrong]),
    ] {
        let (k, share) = share(judgements);
        if k > 0 || judgements == [Judgement::Wrong] {
            let _ = writeln!(text, "- {what}: {share}");
        }
    }
    text
}

/// Every scenario that was not answered rightly, with what was said.
fn misses_section(campaign: &Campaign<'_>) -> String {
    let quick = campaign.scored.iter().map(|s| ("", s));
    let whole = campaign.whole_way.iter().map(|s| (" (whole way)", s));
    let unfound = quick.chain(whole).filter(|(_, s)| !FOUND.contains(&s.judgement));
    let (unseen, missed): (Vec<_>, Vec<(&str, &Scored)>) =
        unfound.partition(|(_, s)| s.judgement == Judgement::NotShown);
    let mut text = format!(
        "\n## Misses\n\nScenarios that leave nothing above the floor to see, and were not seen (*not shown*): {}. Missed or \
         answered wrongly: {}",
        unseen.len(),
        missed.len()
    );
    if missed.is_empty() {
        return text + ".\n";
    }
    text += ":\n\n| hidden | seed | what and how large | judged | said | before/floor | after/floor |\n\
             |---|---|---|---|---|---|---|\n";
    for (way, s) in missed {
        let judged = JUDGEMENTS.iter().find(|(j, _)| *j == s.judgement).map_or("", |(_, words)| words);
        let hidden: Vec<String> = s
            .hidden
            .iter()
            .map(|h| format!("{} {:.3e} {}", h.effect.as_ref().unwrap_or(&h.mechanism), h.size, h.unit))
            .collect();
        let a = &s.answer;
        let _ = writeln!(
            text,
            "| `{}`{way} | {} | {} | {judged} | {} | {:.2} | {:.2} |",
            s.scenario.family,
            s.scenario.seed,
            hidden.join(" + "),
            describe_answer(a).replace('|', " or "),
            a.before_mm / a.floor_mm,
            a.after_mm / a.floor_mm,
        );
    }
    text
}

#[cfg(test)]
pub(super) mod tests {
    use super::{Campaign, confusion_page};
    use crate::{Answer, Judgement, Scored};
    use armcal_diagnose::Verdict;
    use armcal_lab::scenario::{Design, Hidden, Scenario};

    /// A scenario with a name given to it, its held-out error twice the floor before and at the floor after.
    pub fn scored(family: &str, seed: u64, judgement: Judgement, sets: &[&[&str]]) -> Scored {
        let sets: Vec<Vec<String>> =
            sets.iter().map(|set| set.iter().map(|name| (*name).to_owned()).collect()).collect();
        let verdict = if sets.is_empty() { Verdict::NothingMissing } else { Verdict::Identified };
        let hidden = Hidden {
            family: family.to_owned(),
            mechanism: "a gap".to_owned(),
            joint: Some(2),
            recording: None,
            dwell: None,
            size: 0.0021,
            unit: "rad".to_owned(),
            effect: family.split('+').next().map(|family| format!("{family}:2")),
            same: Vec::new(),
            alike: Vec::new(),
            channel: "q2".to_owned(),
            driver: "arrival".to_owned(),
        };
        let answer = Answer {
            verdict,
            names: sets.concat(),
            probability: Some(0.95),
            set_probabilities: vec![0.95; sets.len()],
            sets,
            unknown: None,
            suggested: Vec::new(),
            before_mm: 0.26,
            after_mm: 0.13,
            floor_mm: 0.13,
            dwells: 291,
            seconds: 1.0,
            calibration_seconds: 1.0,
        };
        let scenario = Scenario::new(family, Design::FreePoses, seed);
        let hidden = if family.starts_with("nothing") { Vec::new() } else { vec![hidden] };
        Scored { scenario, answer, hidden, judgement }
    }

    #[test]
    fn the_page_has_every_kind_in_its_section_and_every_miss_by_seed() {
        let all = [
            scored("backlash", 1, Judgement::First, &[&["backlash:2"]]),
            scored("backlash", 2, Judgement::WrongSet, &[&["eccentricity:2", "periodic:2"]]),
            scored("gravity_backlash", 1, Judgement::Silent, &[]),
            scored("gravity_backlash", 2, Judgement::NotShown, &[]),
            scored("outside:twist", 1, Judgement::Placed, &[]),
            scored("backlash+compliance", 1, Judgement::InSet, &[&["backlash:2"]]),
            scored("nothing", 1, Judgement::RightlySilent, &[]),
            scored("nothing:swaps", 1, Judgement::Wrong, &[&["gear_ratio:1"]]),
            scored("nothing:smooth_10", 1, Judgement::Silent, &[]),
        ];
        let whole = [scored("backlash", 1, Judgement::First, &[&["backlash:2"]])];
        let command = "armcal-dev score all".to_owned();
        let campaign = Campaign { command, scored: &all, whole_way: &whole, noise_factor: 0.1 };
        let text = confusion_page(&campaign);
        let sections: Vec<&str> = text.lines().filter(|line| line.starts_with('#')).collect();
        assert_eq!(
            sections,
            [
                "# How often the diagnosis is right",
                "## In the catalogue",
                "## Outside the catalogue",
                "## Two effects at once",
                "## The whole way",
                "## Nothing hidden",
                "## Probabilities",
                "## Misses",
            ]
        );
        let expected = [
            "Written in one go by armcal 0.1.0: 10 scenarios, seeds 1 to 2.",
            "armcal-dev score all",
            "The noise of sensor, seats and encoders is declared 0.1 times as large as it is; no reading differs.",
            "| hidden | n | first | not shown | silent | wrong set | found (95 %) | before/floor | after/floor | at floor | removed |",
            "| `backlash` | 2 | 1 | 0 | 0 | 1 | 50.0 % (1.3 to 98.7) | 2.00 | 1.00 | 100 % | 100 % |",
            "| `gravity_backlash` | 2 | 0 | 1 | 1 | 0 | 0.0 % (0.0 to 84.2) | 2.00 | 1.00 | 100 % | 100 % |",
            "- Named first: 1 of 4, 25.0 % (0.6 to 80.6)",
            "- Not seen though it shows: 1 of 4, 25.0 % (0.6 to 80.6)",
            "| as declared | 1 | 0 of 1, 0.0 % (0.0 to 97.5) | 0 | 0 | 0 | 0 |",
            "| marker swaps | 1 | 1 of 1, 100.0 % (2.5 to 100.0) | 1 | 0 | 0 | 0 |",
            "| a smooth displacement of the tip, 10 times the declared noise | 1 | 1 of 1, 100.0 % (2.5 to 100.0) | 0 | 0 | 0 | 1 |",
            "| all | 3 | 2 of 3, 66.7 % (9.4 to 99.2) | 1 | 0 | 0 | 1 |",
            "| 0.7 to 0.9 | 0 | 0 | - |",
            "| 0.9 to 0.99 | 5 | 3 | 60.0 % (14.7 to 94.7) |",
            "That is: of 5 names told with 0.9 or more, 3 are true: 60.0 % (14.7 to 94.7).",
            "Scenarios that leave nothing above the floor to see, and were not seen (*not shown*): 1. Missed or answered wrongly: 4:",
            "| `backlash` | 2 | backlash:2 2.100e-3 rad | wrong set | eccentricity:2 or periodic:2 | 2.00 | 1.00 |",
            "| `gravity_backlash` | 1 | gravity_backlash:2 2.100e-3 rad | silent | nothing | 2.00 | 1.00 |",
            "| `nothing:swaps` | 1 |  | wrong | gear_ratio:1 | 2.00 | 1.00 |",
        ];
        let mut lines = text.lines();
        for line in expected {
            assert!(lines.any(|l| l == line), "not there, or not in this order: {line}\n{text}");
        }
        assert_eq!(text, confusion_page(&campaign));
    }

    #[test]
    fn without_a_miss_the_page_says_so() {
        let all = [scored("backlash", 5, Judgement::First, &[&["backlash:2"]])];
        let campaign = Campaign { command: String::new(), scored: &all, whole_way: &[], noise_factor: 1.0 };
        let text = confusion_page(&campaign);
        assert!(text.ends_with("Missed or answered wrongly: 0.\n"), "{text}");
        assert!(!text.contains("is declared"));
        assert!(!text.contains("Nothing hidden") && !text.contains("The whole way"));
    }
}
