//! The confusion table.

use super::judge::AT_FLOOR;
use super::{Answer, Judgement, Scored};
use armcal_core::robust::median;
use armcal_diagnose::Verdict;
use armcal_report::{number_cell, plain_table, table_text};
use comfy_table::Cell;
use serde::Serialize;

/// All scenarios of one family and design.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Family.
    pub family: String,
    /// Design of motion.
    pub design: String,
    /// Scenarios.
    pub n: usize,
    /// How many were judged so, in the order of [`JUDGEMENTS`].
    pub counts: [usize; 11],
    /// Median error on held-out points over the floor, before.
    pub before: f64,
    /// The same with the suggestion added.
    pub after: f64,
    /// Share of scenarios within 1.1 of the floor after it.
    pub at_floor: f64,
    /// Median share of the excess over the floor that the suggestion removed.
    pub removed: f64,
    /// What was said instead, most frequent first.
    pub instead: Vec<(String, usize)>,
}

/// The judgements in the order of the columns.
pub const JUDGEMENTS: [(Judgement, &str); 11] = [
    (Judgement::RightlySilent, "silent, rightly"),
    (Judgement::First, "first"),
    (Judgement::InSet, "in set"),
    (Judgement::Placed, "unknown, placed"),
    (Judgement::Nearest, "nearest listed"),
    (Judgement::Unknown, "unknown"),
    (Judgement::Partial, "partial"),
    (Judgement::NotShown, "not shown"),
    (Judgement::Silent, "silent"),
    (Judgement::WrongSet, "wrong set"),
    (Judgement::Wrong, "wrong"),
];

/// One row a family and design, in the order in which they come.
pub fn family_rows(scored: &[Scored]) -> Vec<Row> {
    let mut keys: Vec<(String, String)> = Vec::new();
    for s in scored {
        let key = family_and_design(s);
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    keys.into_iter()
        .map(|k| {
            let own: Vec<&Scored> = scored.iter().filter(|s| family_and_design(s) == k).collect();
            family_row(k, &own)
        })
        .collect()
}

fn family_and_design(s: &Scored) -> (String, String) {
    let design = serde_json::to_value(s.scenario.design).unwrap_or_default();
    (s.scenario.family.clone(), design.as_str().unwrap_or_default().to_owned())
}

fn family_row((family, design): (String, String), own: &[&Scored]) -> Row {
    let ratio =
        |mm: fn(&Scored) -> f64| median(&own.iter().map(|s| mm(s) / s.answer.floor_mm).collect::<Vec<_>>());
    let removed: Vec<f64> = own
        .iter()
        .filter(|s| s.answer.before_mm > 1.05 * s.answer.floor_mm)
        .map(|s| {
            let a = &s.answer;
            (a.before_mm - a.after_mm) / (a.before_mm - a.floor_mm)
        })
        .collect();
    let at_floor = own.iter().filter(|s| s.answer.after_mm <= AT_FLOOR * s.answer.floor_mm).count();
    let right = [Judgement::RightlySilent, Judgement::First, Judgement::Placed];
    let mut instead: Vec<(String, usize)> = Vec::new();
    for s in own.iter().filter(|s| !right.contains(&s.judgement)) {
        let words = describe_answer(&s.answer);
        match instead.iter_mut().find(|(w, _)| *w == words) {
            Some((_, n)) => *n += 1,
            None => instead.push((words, 1)),
        }
    }
    instead.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    Row {
        family,
        design,
        n: own.len(),
        counts: JUDGEMENTS.map(|(j, _)| own.iter().filter(|s| s.judgement == j).count()),
        before: ratio(|s| s.answer.before_mm),
        after: ratio(|s| s.answer.after_mm),
        at_floor: at_floor as f64 / own.len() as f64,
        removed: if removed.is_empty() { f64::NAN } else { median(&removed) },
        instead,
    }
}

/// An answer in a few words: the sets of names, else where the unlisted enters, else the verdict alone.
pub(super) fn describe_answer(answer: &Answer) -> String {
    match (&answer.unknown, answer.sets.is_empty()) {
        (Some((channel, driver)), true) => format!("{channel} <- {driver}"),
        (None, true) if answer.verdict == Verdict::NothingMissing => "nothing".to_owned(),
        (None, true) => answer.verdict.word().to_owned(),
        _ => answer.sets.iter().map(|set| set.join("|")).collect::<Vec<_>>().join(" + "),
    }
}

/// The rows as text.
pub fn terminal_table(rows: &[Row]) -> String {
    let used: Vec<usize> =
        (0..JUDGEMENTS.len()).filter(|k| rows.iter().any(|row| row.counts[*k] > 0)).collect();
    let mut table = plain_table();
    let mut header = vec!["hidden".to_owned(), "design".to_owned(), "n".to_owned()];
    header.extend(used.iter().map(|k| JUDGEMENTS[*k].1.to_owned()));
    header.extend(["before/floor", "after/floor", "at floor", "removed", "instead"].map(str::to_owned));
    table.set_header(header);
    for row in rows {
        let mut cells = vec![Cell::new(&row.family), Cell::new(&row.design), number_cell(row.n.to_string())];
        cells.extend(used.iter().map(|k| number_cell(row.counts[*k].to_string())));
        cells.push(number_cell(format!("{:.2}", row.before)));
        cells.push(number_cell(format!("{:.2}", row.after)));
        cells.push(number_cell(format!("{:.0} %", 100.0 * row.at_floor)));
        cells.push(number_cell(if row.removed.is_nan() {
            "-".to_owned()
        } else {
            format!("{:.0} %", 100.0 * row.removed)
        }));
        let instead = row.instead.iter().take(3).map(|(words, n)| format!("{n}x {words}"));
        cells.push(Cell::new(instead.collect::<Vec<_>>().join("; ")));
        table.add_row(cells);
    }
    table_text(&table)
}
