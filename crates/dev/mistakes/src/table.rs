//! The table in Markdown.

use crate::Rig;
use crate::judge::{Case, Judgement, NOTHING, SHOWN};
use crate::sound::Sound;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// What is counted over all cases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// All of them.
    pub cases: usize,
    /// The cause is reported.
    pub right: usize,
    /// The data do not show it.
    pub not_shown: usize,
    /// Neither the cause nor anything false.
    pub missed: usize,
    /// Something false.
    pub false_said: usize,
}

impl Counts {
    /// Counts cases.
    pub fn of<'c>(cases: impl IntoIterator<Item = &'c Case>) -> Counts {
        let mut counts = Counts::default();
        for case in cases {
            counts.cases += 1;
            let count = match case.judgement {
                Judgement::Right => &mut counts.right,
                Judgement::NotShown => &mut counts.not_shown,
                Judgement::Missed => &mut counts.missed,
                _ => &mut counts.false_said,
            };
            *count += 1;
        }
        counts
    }

    /// Share of the cases that the data show in which the cause is reported [%].
    pub fn right_percent(&self) -> f64 {
        100.0 * self.right as f64 / (self.cases - self.not_shown).max(1) as f64
    }
}

/// The document: what was done, the counts, every case, every false alarm.
pub fn markdown(cases: &[Case], sound: &[Sound], command: &str) -> String {
    let mut text = format!(
        "# Setup mistakes\n\nMade by `{command}`; not edited by hand.\n\n\
         Each row is one mistake made in a sound session of a simulated rig: in the messages of its recordings, in their bytes, or in \
         the text of pipeline, board or arm. What makes them knows nothing of the checks; `armcal run` is judged by its exit code, \
         `summary.json` and error message alone, by the table of causes in `crates/dev/mistakes/src/causes.rs`. Rigs: `table` (three axes, \
         calibration table, Vicon), `sockets` (the same, encoders only), `poses` (six axes, tracked 6-DoF target).\n\n\
         *False* is: exit 0 without the cause where the held-out error is above {SHOWN} times what the declared noise gives; a physical effect named \
         alone; `nothing_missing` above {NOTHING} times the floor; a run that does not end. *Not shown*: the error stays within \
         {SHOWN} times the floor and nothing false is said, since these data cannot show the mistake.\n\n"
    );
    write_summary(&mut text, cases, sound);
    for rig in Rig::ALL {
        let rows: Vec<&Case> = cases.iter().filter(|case| case.rig == rig).collect();
        if !rows.is_empty() {
            rows_of(&mut text, rig, &rows);
        }
    }
    write_alarms(&mut text, sound);
    text
}

// Writing to a string cannot fail.
fn write_summary(text: &mut String, cases: &[Case], sound: &[Sound]) {
    *text += "| rig | cases | cause reported | not shown | missed | false | cause right, of those shown |\n";
    *text += "|---|--:|--:|--:|--:|--:|--:|\n";
    let mut line = |name: &str, c: Counts| {
        let percent = c.right_percent();
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {} | {percent:.0} % |",
            c.cases, c.right, c.not_shown, c.missed, c.false_said
        );
    };
    for rig in Rig::ALL {
        line(rig.word(), Counts::of(cases.iter().filter(|case| case.rig == rig)));
    }
    line("all", Counts::of(cases));
    let alarmed = sound.iter().filter(|s| !s.alarms.is_empty()).count();
    let hidden = sound.iter().filter(|s| s.hidden != "nothing").count();
    let _ = writeln!(
        text,
        "\n{} sound sessions, {hidden} of them with a physical effect hidden: {alarmed} with a false alarm.",
        sound.len()
    );
}

fn rows_of(text: &mut String, rig: Rig, rows: &[&Case]) {
    let _ = write!(
        text,
        "\n## {}\n\n| mistake | cause | held out, mm | over the floor | exit | verdict | reported | |\n\
         |---|---|--:|--:|--:|---|---|---|\n",
        rig.word()
    );
    for case in rows {
        let said = &case.said;
        let number = |value: Option<f64>, digits: usize| match value {
            None => "-".to_owned(),
            Some(v) if v >= 1e4 => format!("{v:.1e}"),
            Some(v) => format!("{v:.digits$}"),
        };
        let verdict = match (&said.verdict, said.names()) {
            (Some(verdict), true) => {
                format!("{verdict}: {}", said.effects.first().map_or("", String::as_str))
            }
            (verdict, _) => verdict.clone().unwrap_or_else(|| "-".to_owned()),
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {verdict} | {} | {} |",
            case.kind,
            case.cause,
            number(said.held_out_mm, 3),
            number(said.ratio(), 2),
            said.exit.map_or_else(|| "-".to_owned(), |exit| exit.to_string()),
            case.reported.as_deref().unwrap_or("-"),
            case.judgement.words(),
        );
    }
}

fn write_alarms(text: &mut String, sound: &[Sound]) {
    if sound.is_empty() {
        return;
    }
    *text += "\n## Sound sessions\n\n| hidden | sessions | with a false alarm |\n|---|--:|--:|\n";
    let mut families: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    for s in sound {
        let [all, alarmed] = families.entry(&s.hidden).or_default();
        *all += 1;
        *alarmed += usize::from(!s.alarms.is_empty());
    }
    for (family, [all, alarmed]) in families {
        let _ = writeln!(text, "| {family} | {all} | {alarmed} |");
    }
    for s in sound.iter().filter(|s| !s.alarms.is_empty()) {
        let _ = writeln!(
            text,
            "\n- session {} ({}, hidden: {}): {}",
            s.number,
            s.rig.word(),
            s.hidden,
            s.alarms.join("; ")
        );
    }
}
