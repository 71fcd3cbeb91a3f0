//! A verification for people, at most 100 columns wide.

use super::row::{Row, or_dash};
use super::{no_criteria, points_are};
use crate::pen::{Pen, TerminalStyle, number_cell};
use armcal_config::{On, Published};
use armcal_core::printable_name;
use armcal_core::units::format_mm;
use armcal_result::{Closing, Told, VERSION, Verification, VerifiedRecording};
use armcal_verify::{Against, By, Compared, PathRow, Plane};
use comfy_table::Cell;

const HEADER: [&str; 7] = ["n", "before", "± 95 %", "after", "± 95 %", "difference 95 %", "better by"];

/// The tables and one sentence, ending in a newline.
pub fn verification_text(v: &Verification, style: TerminalStyle) -> String {
    let pen = Pen { style };
    let name = printable_name(&v.pipeline);
    let effects = if v.effects.is_empty() { "geometry alone".into() } else { v.effects.join(", ") };
    let mut sections = vec![format!(
        "armcal {VERSION}   verifying {} on {name}\nmodel: {}\n",
        printable_name(&v.result.to_string_lossy()),
        printable_name(&effects)
    )];
    sections.push(pen.section("Recordings", recording_table(&pen, &v.recordings)));
    if !v.points.is_empty() {
        let rows = v.points.iter().map(Row::of_points);
        let published = v.published.iter().filter(|p| p.on == On::Points);
        sections.push(
            pen.section(&format!("{} [mm]", points_are(v)), error_table(&pen, "points", rows, published)),
        );
    }
    let of = |against| v.paths.iter().filter(move |r: &&PathRow| r.against == against);
    for (against, title) in [
        (Against::Encoders, "Error along paths, at each moment [mm]"),
        (Against::Planned, "Distance from the planned path [mm]"),
    ] {
        if of(against).next().is_some() {
            let published = v.published.iter().filter(|p| p.on == On::Paths && against == Against::Encoders);
            sections.push(
                pen.section(title, error_table(&pen, "path", of(against).map(Row::of_path), published)),
            );
        }
    }
    sections.push(super::iso::section(&pen, &v.iso9283, no_criteria(v)));
    if !v.warnings.is_empty() {
        let texts = v.warnings.iter().map(|w| (w.severity.word(), printable_name(&w.to_string())));
        sections.push(pen.section("Warnings", pen.list(texts)));
    }
    sections.push(pen.bold(&verification_conclusion(v)) + "\n");
    sections.join("\n")
}

/// What it comes to, in one sentence.
pub(super) fn verification_conclusion(v: &Verification) -> String {
    let what = if v.closing == Closing::All { "joined dwells" } else { "points" };
    let points = v.points.iter().find(|r| r.by == By::All).map(|r| (what, &r.errors));
    let along =
        |r: &&PathRow| r.subject == "all" && r.plane == Plane::Space && r.against == Against::Encoders;
    let path = v.paths.iter().find(along).map(|r| ("frames of moving paths", &r.errors));
    let parts: Vec<String> =
        [points, path].into_iter().flatten().map(|(what, c)| error_change_text(what, c)).collect();
    if parts.is_empty() {
        return "These recordings hold neither a dwell nor a motion of a tracked tip: nothing is verified."
            .into();
    }
    format!("{}: {}.", overlap_sentence(v), parts.join("; "))
}

/// What the calibration knew of the recordings that are judged.
fn overlap_sentence(v: &Verification) -> String {
    if v.told.is_empty() {
        return if v.recognises_copies {
            "No dwell of these recordings was in the calibration".into()
        } else {
            "No file of these recordings was in the calibration (an older result, which does not recognise copies)".into()
        };
    }
    let one = |t: &Told| {
        let name = printable_name(&t.recording);
        if t.dwells == t.all {
            format!("`{name}`")
        } else {
            format!("{} of {} dwells of `{name}`", t.dwells, t.all)
        }
    };
    let seen = v.told.iter().map(one).collect::<Vec<_>>().join(", ");
    let of = match v.recordings.len() {
        1 => String::new(),
        n => format!(" of these {n} recordings"),
    };
    format!("The calibration was made from {seen}{of}, so this is no verification on new ones")
}

fn error_change_text(what: &str, c: &Compared) -> String {
    let (before, after) = (format_mm(c.before.mean_m), format_mm(c.after.mean_m));
    let percent = 100.0 * c.improvement;
    let moved = if percent >= 0.0 { "falls" } else { "rises" };
    format!("on {} {what} the mean error {moved} from {before} to {after} mm ({percent:.1} %)", c.n)
}

fn recording_table(pen: &Pen, all: &[VerifiedRecording]) -> String {
    let mut table = pen.table(&["recording", "dwells", "moving frames", "clock offset [ms]"]);
    for r in all {
        let clock = r.clock_offset_s.zip(r.clock_sigma_s);
        let clock = clock.map_or("-".into(), |(o, s)| format!("{:.2} ± {:.2}", o * 1e3, s * 1e3));
        table.add_row(vec![
            Cell::new(printable_name(&r.name)),
            number_cell(r.dwells),
            number_cell(r.moving_samples),
            number_cell(clock),
        ]);
    }
    pen.render(&table)
}

fn error_table<'a>(
    pen: &Pen,
    what: &str,
    rows: impl Iterator<Item = Row>,
    published: impl Iterator<Item = &'a Published>,
) -> String {
    let mut table = pen.table(&[&[what][..], &HEADER].concat());
    table.add_rows(rows.map(row_cells).chain(published.map(published_cells)));
    pen.render(&table)
}

/// Somebody else's numbers, for comparison.
fn published_cells(p: &Published) -> Vec<Cell> {
    let mm = |value: Option<f64>| number_cell(value.map_or(String::new(), |mm| format_mm(mm * 1e-3)));
    let better = match (p.improvement_percent, p.before_mm.zip(p.after_mm)) {
        (Some(percent), _) => format!("{percent:.1} %"),
        (None, Some((before, after))) => format!("{:.1} %", 100.0 * (1.0 - after / before)),
        (None, None) => String::new(),
    };
    let empty = || Cell::new("");
    let label = Cell::new(printable_name(&p.label));
    vec![label, empty(), mm(p.before_mm), empty(), mm(p.after_mm), empty(), empty(), number_cell(better)]
}

fn row_cells(row: Row) -> Vec<Cell> {
    let [before, before_half] = row.before;
    let [after, after_half] = row.after;
    let [low, high] = row.difference;
    let difference = if low.is_empty() { "-".into() } else { format!("{low} .. {high}") };
    vec![
        Cell::new(printable_name(&row.subject)),
        number_cell(row.n),
        number_cell(before),
        number_cell(or_dash(before_half)),
        number_cell(after),
        number_cell(or_dash(after_half)),
        number_cell(difference),
        number_cell(row.better),
    ]
}
