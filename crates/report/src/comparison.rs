//! Two results on the same dwells, for the terminal.

use crate::pen::{Pen, TerminalStyle, number_cell};
use armcal_core::printable_name;
use armcal_core::units::format_mm;
use armcal_result::{Comparison, Difference, Moved};
use comfy_table::Cell;

/// Rows of parameters that moved most.
const MOVED: usize = 10;

/// The comparison as text, ending in a newline.
pub fn comparison_text(comparison: &Comparison, style: TerminalStyle) -> String {
    let pen = Pen { style };
    let mut sections =
        vec![pen.section("Position errors [mm], paired by dwell", difference_table(comparison, &pen))];
    if !comparison.dwells.is_empty() {
        sections.push(pen.section("Dwells that changed most [mm]", dwell_table(comparison, &pen)));
    }
    sections.push(pen.section("Parameters that moved most", parameter_table(comparison, &pen)));
    sections.push(format!("{}\n", pen.bold(&comparison_sentence(comparison))));
    sections.join("\n")
}

/// The result in one sentence.
pub fn comparison_sentence(comparison: &Comparison) -> String {
    let (points, d) = match (&comparison.held_out, &comparison.all) {
        (Some(d), _) => ("held-out points", d),
        (None, Some(d)) => ("points (nothing was held out of both)", d),
        (None, None) => {
            return "The two results have no dwell in common, so there is nothing to compare.".into();
        }
    };
    let verdict = match d.ci95_mm {
        Some([_, high]) if high < 0.0 => "falls",
        Some([low, _]) if low > 0.0 => "rises",
        _ => "does not change by more than chance:",
    };
    let numbers = if verdict.ends_with(':') { "" } else { " from" };
    let interval = d.ci95_mm.map_or(String::new(), |[low, high]| {
        format!(" (difference {:+.3} mm, 95 % {low:+.3} to {high:+.3})", d.difference_mm)
    });
    let (before, after) = (format_mm(d.before_mm * 1e-3), format_mm(d.after_mm * 1e-3));
    format!("On {} {points} the mean error {verdict}{numbers} {before} to {after} mm{interval}.", d.n)
}

fn difference_table(comparison: &Comparison, pen: &Pen) -> String {
    let mut table =
        pen.table(&["points", "n", "groups", "before", "after", "difference", "95 %", "better", "worse"]);
    for (name, d) in comparison.differences() {
        let mut row = vec![Cell::new(printable_name(&name)), number_cell(d.n), number_cell(d.groups)];
        row.extend(difference_shown(&d, "-").map(number_cell));
        row.extend([d.better, d.worse].map(number_cell));
        table.add_row(row);
    }
    let mut text = pen.render(&table);
    if !comparison.unpaired.is_empty() {
        text.push_str(
            &pen.list(comparison.unpaired.iter().map(|u| ("left out", printable_name(&u.to_string())))),
        );
    }
    text
}

fn dwell_table(comparison: &Comparison, pen: &Pen) -> String {
    let mut table = pen.table(&["recording", "dwell", "cavity", "before", "after", "change"]);
    for d in &comparison.dwells {
        table.add_row(vec![
            Cell::new(printable_name(&d.recording)),
            number_cell(d.dwell),
            Cell::new(printable_name(&d.cavity)),
            number_cell(format!("{:.3}", d.before_mm)),
            number_cell(format!("{:.3}", d.after_mm)),
            number_cell(format!("{:+.3}", d.after_mm - d.before_mm)),
        ]);
    }
    pen.render(&table)
}

fn parameter_table(comparison: &Comparison, pen: &Pen) -> String {
    let mut table = pen.table(&["parameter", "unit", "before", "after", "change", "in 95 % widths"]);
    for m in comparison.moved.iter().take(MOVED) {
        let name = [Cell::new(printable_name(&m.name)), Cell::new(&m.unit)];
        table.add_row(name.into_iter().chain(moved_shown(m).map(number_cell)).collect::<Vec<Cell>>());
    }
    let mut text = pen.render(&table);
    for (what, names) in [("Only after", &comparison.added), ("Only before", &comparison.removed)] {
        if !names.is_empty() {
            text.push_str(&format!(" {what}: {}\n", printable_name(&names.join(", "))));
        }
    }
    text
}

/// Before, after, the change and its interval, or `none` where there is no interval.
pub(crate) fn difference_shown(d: &Difference, none: &str) -> [String; 4] {
    let interval = d.ci95_mm.map(|[low, high]| format!("{low:+.3} to {high:+.3}"));
    [
        format_mm(d.before_mm * 1e-3),
        format_mm(d.after_mm * 1e-3),
        format!("{:+.3}", d.difference_mm),
        interval.unwrap_or_else(|| none.to_owned()),
    ]
}

/// Before, after, the change, and that in half widths.
pub(crate) fn moved_shown(m: &Moved) -> [String; 4] {
    let [before, after] = [m.before, m.after].map(|v| format!("{v:.4}"));
    [before, after, format!("{:+.4}", m.after - m.before), format!("{:.1}", m.in_half_widths)]
}
