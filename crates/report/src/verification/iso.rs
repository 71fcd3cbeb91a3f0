//! Criteria of ISO 9283 in the terminal: the worst place of each, and what the recordings cannot show.

use super::IsoReport;
use crate::pen::{Pen, number};
use crate::text::printable;
use armcal_iso9283::{Criterion, NotMeasured};
use comfy_table::Cell;

/// The section; one sentence where no criterion could be computed.
pub(super) fn section(pen: &Pen, report: &IsoReport) -> String {
    let title = "ISO 9283, the worst place of each criterion (verification.json has all)";
    if report.calibrated.criteria.is_empty() {
        let why = " No pose and no path is commanded twice in these recordings, and the criteria are about repeats.\n";
        return pen.section(title, why.to_owned());
    }
    let mut table =
        pen.table(&["clause", "criterion", "", "unit", "nominal", "calibrated", "worst at", "n", "asked"]);
    let nominal = report.nominal.worst();
    for calibrated in report.calibrated.worst() {
        let before = nominal.iter().find(|c| c.clause == calibrated.clause && c.name == calibrated.name);
        table.add_row(vec![
            Cell::new(calibrated.clause),
            Cell::new(&calibrated.name),
            Cell::new(&calibrated.symbol),
            Cell::new(calibrated.quantity.display_symbol()),
            number(before.map_or("-".into(), |c| shown(c))),
            number(shown(calibrated)),
            Cell::new(printable(&calibrated.at)),
            number(calibrated.n),
            number(calibrated.asked),
        ]);
    }
    let mut text = pen.render(&table);
    if !report.commands_recorded {
        text.push_str(" Set-points are not recorded: encoder readings stand for commands.\n");
    }
    let notes = report.calibrated.notes.iter().map(|note| ("note", printable(note)));
    text.push_str(&pen.list(notes));
    text.push_str(&pen.list(missing(&report.calibrated.not_measured).into_iter().map(|m| ("no", m))));
    pen.section(title, text)
}

/// What cannot be computed, criteria with one reason together.
fn missing(all: &[NotMeasured]) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for m in all {
        let symbol = if m.symbol.is_empty() { m.name.clone() } else { m.symbol.clone() };
        let named = format!("{} {symbol}", m.clause);
        match reasons.iter_mut().find(|(reason, _)| *reason == m.reason) {
            Some((_, names)) => names.push(named),
            None => reasons.push((&m.reason, vec![named])),
        }
    }
    reasons.iter().map(|(reason, names)| printable(&format!("{}: {reason}", names.join(", ")))).collect()
}

fn shown(c: &Criterion) -> String {
    let sign = if c.plus_minus { "±" } else { "" };
    format!("{sign}{:.3}", c.display_value())
}
