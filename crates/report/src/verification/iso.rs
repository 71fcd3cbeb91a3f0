//! Criteria of ISO 9283 in the terminal: the worst place of each, and what the recordings cannot show.

use crate::pen::{Pen, number_cell};
use armcal_core::printable_name;
use armcal_iso9283::{Criterion, NotMeasured};
use armcal_result::IsoReport;
use comfy_table::Cell;

/// Columns of [`rows`].
pub(super) const HEADER: [&str; 9] =
    ["clause", "criterion", "", "unit", "nominal", "calibrated", "worst at", "n", "asked"];
/// Where there is none.
pub(super) const NO_REPEATS: &str =
    "No pose and no path is commanded twice in these recordings, and the criteria are about repeats.";
const STAND_IN: &str = "Set-points are not recorded: encoder readings stand for commands.";

/// The section; one sentence where no criterion could be computed.
pub(super) fn section(pen: &Pen, report: &IsoReport, none: &str) -> String {
    let title = "ISO 9283, the worst place of each criterion (verification.json has all)";
    if report.calibrated.criteria.is_empty() {
        return pen.section(title, format!(" {none}\n"));
    }
    let mut table = pen.table(&HEADER);
    for row in rows(report) {
        let [clause, criterion, symbol, unit, nominal, calibrated, at, n, asked] = row;
        let mut cells: Vec<Cell> = [clause, criterion, symbol, unit].into_iter().map(Cell::new).collect();
        cells.extend([
            number_cell(nominal),
            number_cell(calibrated),
            Cell::new(at),
            number_cell(n),
            number_cell(asked),
        ]);
        table.add_row(cells);
    }
    let mut text = pen.render(&table);
    if !report.commands_recorded {
        text.push_str(&format!(" {STAND_IN}\n"));
    }
    let notes = report.calibrated.notes.iter().map(|note| ("note", printable_name(note)));
    text.push_str(&pen.list(notes));
    text.push_str(
        &pen.list(unmeasured_criteria(&report.calibrated.not_measured).into_iter().map(|m| ("no", m))),
    );
    pen.section(title, text)
}

/// The worst place of each criterion, in the order of [`HEADER`].
pub(super) fn rows(report: &IsoReport) -> Vec<[String; 9]> {
    let nominal = report.nominal.worst();
    let row = |c: &Criterion| {
        let before = nominal.iter().find(|n| n.clause == c.clause && n.name == c.name);
        [
            c.clause.to_string(),
            c.name.clone(),
            c.symbol.clone(),
            c.quantity.display_symbol().to_string(),
            before.map_or("-".into(), |n| criterion_text(n)),
            criterion_text(c),
            printable_name(&c.at),
            c.n.to_string(),
            c.asked.to_string(),
        ]
    };
    report.calibrated.worst().into_iter().map(row).collect()
}

/// What the criteria need to be read rightly, and which cannot be computed.
pub(super) fn remarks(report: &IsoReport) -> Vec<String> {
    let stand_in = (!report.commands_recorded).then(|| STAND_IN.to_owned());
    let notes = report.calibrated.notes.iter().map(|note| printable_name(note));
    let missing = unmeasured_criteria(&report.calibrated.not_measured)
        .into_iter()
        .map(|m| format!("not measured: {m}"));
    stand_in.into_iter().chain(notes).chain(missing).collect()
}

/// What cannot be computed, criteria with one reason together.
fn unmeasured_criteria(all: &[NotMeasured]) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for m in all {
        let symbol = if m.symbol.is_empty() { m.name.clone() } else { m.symbol.clone() };
        let named = format!("{} {symbol}", m.clause);
        match reasons.iter_mut().find(|(reason, _)| *reason == m.reason) {
            Some((_, names)) => names.push(named),
            None => reasons.push((&m.reason, vec![named])),
        }
    }
    reasons.iter().map(|(reason, names)| printable_name(&format!("{}: {reason}", names.join(", ")))).collect()
}

fn criterion_text(c: &Criterion) -> String {
    let sign = if c.plus_minus { "±" } else { "" };
    format!("{sign}{:.3}", c.display_value())
}
