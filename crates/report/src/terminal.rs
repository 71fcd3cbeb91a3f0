//! The summary a person reads in the terminal, at most 100 columns wide.

use crate::diagnosis_text::brief;
use crate::run::{RecordingRun, Run, Status, VERSION};
use crate::text::{conclusion, in_display_unit, millimetres, printable};
use armcal_calibrate::{Calibration, Estimate};
use armcal_core::{ErrorStats, Warning};
use comfy_table::{Attribute, Cell, CellAlignment, Color, ContentArrangement, LineStyle, Table, TableStyle};

/// Widest line.
const COLUMNS: u16 = 100;

/// A thin rule below the header and nothing else: the numbers are the table.
pub const RULED: TableStyle = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// Whether colour codes may be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TerminalStyle {
    /// Text only.
    Plain,
    /// ANSI colours and bold.
    Colour,
}

/// The summary of a run, ending in a newline.
pub fn terminal(run: &Run, style: TerminalStyle) -> String {
    let pen = Pen { style };
    let mut sections = vec![format!("armcal {VERSION}   pipeline {}\n", printable(&run.pipeline_name))];
    let answer = run.answer();
    let leads = matches!(answer.word, "setup" | "unexplained");
    sections.extend(leads.then(|| pen.verdict(&answer.sentence, false)));
    sections.push(pen.section("Recordings", recordings(&pen, run)));
    sections.push(pen.section("Position errors [mm]", errors(&pen, &run.calibration)));
    sections.push(pen.section("Parameters", parameters(&pen, &run.calibration)));
    sections.extend(undetermined(&pen, &run.calibration));
    sections.extend(run.diagnosis.iter().map(|d| brief(&pen, d)));
    sections.extend(warnings(&pen, run));
    let conclusion = conclusion(&run.calibration);
    let last = if leads { format!("{conclusion} {}", answer.sentence) } else { conclusion };
    sections.push(pen.verdict(&last, run.status() == Status::Ok));
    sections.join("\n")
}

fn recordings(pen: &Pen, run: &Run) -> String {
    let mut table =
        pen.table(&["recording", "dwells", "associated", "rejected", "clock offset [ms]", "drift [ppm]"]);
    for recording in &run.recordings {
        table.add_row(vec![
            Cell::new(printable(&recording.name)),
            number(recording.dwells.len()),
            number(run.associated(recording)),
            number(recording.rejections.len()),
            number(clock_offset(recording)),
            number(clock_drift(recording)),
        ]);
    }
    pen.render(&table)
}

fn clock_offset(recording: &RecordingRun) -> String {
    match &recording.clock {
        Some(c) if c.declared => format!("{:.2} declared", c.offset_s * 1e3),
        Some(c) => format!("{:.2} ± {:.2}", c.offset_s * 1e3, c.offset_sigma_s * 1e3),
        None => "-".into(),
    }
}

fn clock_drift(recording: &RecordingRun) -> String {
    match &recording.clock {
        Some(c) if c.declared => format!("{:.1} declared", c.drift * 1e6),
        Some(c) => format!("{:.1} ± {:.1}", c.drift * 1e6, c.drift_sigma * 1e6),
        None => "-".into(),
    }
}

/// Nominal and calibrated errors on both sides of the hold-out.
pub(crate) fn errors(pen: &Pen, calibration: &Calibration) -> String {
    let mut table = pen.table(&["points", "n", "parameters", "mean", "rms", "p95", "max"]);
    for (label, side) in [("fitted", &calibration.train), ("held out", &calibration.holdout)] {
        if side.fitted.n == 0 {
            continue;
        }
        table.add_row(error_row(label, side.nominal.n.to_string(), "nominal", &side.nominal));
        table.add_row(error_row("", String::new(), "calibrated", &side.fitted));
    }
    let mut floor = vec![Cell::new("noise floor"), Cell::new(""), Cell::new("")];
    floor.push(number(millimetres(calibration.noise_floor_m)));
    table.add_row(floor);
    pen.render(&table)
}

fn error_row(label: &str, n: String, parameters: &str, stats: &ErrorStats) -> Vec<Cell> {
    let mut row = vec![Cell::new(label), number(n), Cell::new(parameters)];
    row.extend([stats.mean_m, stats.rms_m, stats.p95_m, stats.max_m].map(|m| number(millimetres(m))));
    row
}

/// Free parameters only; the fixed ones are counted below the table and listed in `parameters.toml`.
pub(crate) fn parameters(pen: &Pen, calibration: &Calibration) -> String {
    parameters_of(pen, &calibration.fit.estimates.iter().collect::<Vec<_>>())
}

/// The same of some parameters.
pub(crate) fn parameters_of(pen: &Pen, estimates: &[&Estimate]) -> String {
    let mut table = pen.table(&["parameter", "unit", "nominal", "value", "change", "± 95 %", ""]);
    let (free, fixed): (Vec<&Estimate>, Vec<&Estimate>) =
        estimates.iter().copied().partition(|e| e.parameter.free);
    for e in free {
        let unit = e.parameter.unit;
        let half = (e.ci95[1] - e.ci95[0]) / 2.0;
        table.add_row(vec![
            Cell::new(printable(&e.parameter.name)),
            Cell::new(unit.display_symbol()),
            number(in_display_unit(unit, e.parameter.nominal)),
            number(in_display_unit(unit, e.value)),
            number(in_display_unit(unit, e.value - e.parameter.nominal)),
            number(in_display_unit(unit, half)),
            pen.mark(Cell::new(marks(e))),
        ]);
    }
    let mut text = pen.render(&table);
    match fixed.len() {
        0 => {}
        1 => text.push_str(" 1 parameter is fixed.\n"),
        n => text.push_str(&format!(" {n} parameters are fixed.\n")),
    }
    text
}

fn marks(e: &Estimate) -> &'static str {
    match (e.determined, e.at_bound) {
        (true, false) => "",
        (true, true) => "at bound",
        (false, false) => "undetermined",
        (false, true) => "undetermined, at bound",
    }
}

/// What the data leave open, if anything.
pub(crate) fn undetermined(pen: &Pen, calibration: &Calibration) -> Option<String> {
    let directions = &calibration.fit.undetermined;
    let texts = directions.iter().map(|d| ("-", printable(&d.text)));
    (!directions.is_empty())
        .then(|| pen.section("What these data cannot determine (kept near nominal)", pen.list(texts)))
}

fn warnings(pen: &Pen, run: &Run) -> Option<String> {
    let of_recordings = run.recordings.iter().flat_map(|r| {
        r.all_warnings()
            .into_iter()
            .map(|w| (w.severity.word(), format!("{}: {}", printable(&r.name), text(w))))
    });
    let overall = run.overall_warnings().into_iter().map(|w| (w.severity.word(), text(&w)));
    let all: Vec<_> = of_recordings.chain(overall).collect();
    (!all.is_empty()).then(|| pen.section("Warnings", pen.list(all.into_iter())))
}

fn text(warning: &Warning) -> String {
    printable(&warning.to_string())
}

/// A table of text without colours: a thin rule below the header and nothing else.
pub fn plain_table() -> Table {
    let mut table = Table::new();
    table.load_style(RULED).force_no_tty();
    table
}

/// A table line by line, without the blanks that fill it up.
pub fn table_text(table: &Table) -> String {
    table.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// A cell set flush right.
pub fn number(value: impl ToString) -> Cell {
    Cell::new(value).set_alignment(CellAlignment::Right)
}

/// Draws tables in one style.
pub(crate) struct Pen {
    pub style: TerminalStyle,
}

impl Pen {
    pub fn table(&self, header: &[&str]) -> Table {
        let mut table = self.bare_table();
        table.load_style(RULED);
        table.set_header(header.iter().map(|h| Cell::new(h).add_attribute(Attribute::Dim)));
        table
    }

    fn bare_table(&self) -> Table {
        let mut table = Table::new();
        table.load_style(TableStyle::new());
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(COLUMNS);
        match self.style {
            TerminalStyle::Plain => table.force_no_tty(),
            TerminalStyle::Colour => table.enforce_styling(),
        };
        table
    }

    /// Sentences behind a short label, wrapped.
    pub fn list(&self, entries: impl Iterator<Item = (&'static str, String)>) -> String {
        let mut table = self.bare_table();
        for (label, text) in entries {
            table.add_row(vec![self.mark(Cell::new(label)), Cell::new(text)]);
        }
        self.render(&table)
    }

    fn mark(&self, cell: Cell) -> Cell {
        cell.fg(Color::Yellow)
    }

    pub fn render(&self, table: &Table) -> String {
        table_text(table)
    }

    pub fn section(&self, title: &str, body: String) -> String {
        format!("{}\n{body}", self.bold(title))
    }

    /// The result in one sentence, in the colour of whether it can be relied upon.
    pub fn verdict(&self, conclusion: &str, reliable: bool) -> String {
        let mut table = self.bare_table();
        let colour = if reliable { Color::Green } else { Color::Yellow };
        table.add_row(vec![Cell::new(conclusion).fg(colour).add_attribute(Attribute::Bold)]);
        self.render(&table)
    }

    pub fn bold(&self, text: &str) -> String {
        match self.style {
            TerminalStyle::Plain => text.to_owned(),
            TerminalStyle::Colour => format!("\u{1b}[1m{text}\u{1b}[0m"),
        }
    }
}
