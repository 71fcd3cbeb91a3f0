//! The summary a person reads in the terminal: the story in one screen, or everything.

use crate::pen::{Pen, TerminalStyle, number_cell};
use armcal_calibrate::{Calibration, Estimate, SideErrors};
use armcal_core::units::format_mm;
use armcal_core::{ErrorStats, Severity, printable_name};
use armcal_result::by_marker::{MarkerErrors, by_marker};
use armcal_result::{Run, Status, VERSION};
use armcal_wording::{
    SHOWN, Story, ToldWarning, errors_are, estimate_remark, estimate_shown, joined_tips_text,
};
use comfy_table::Cell;

/// How much of a run is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// What was done, how well, what is missing, what to do next: one screen.
    Story,
    /// Every parameter and every notice too.
    Everything,
}

/// Names of parameters that stand for all that are not determined.
const NAMED: usize = 4;
/// Lines that the story may take, two less than forty: where the results went is said under it.
const SCREEN: usize = 37;
/// Recordings that are listed where all of them would take the screen.
const FEW: usize = 4;

/// How many entries of a list the story shows.
#[derive(Clone, Copy)]
pub(crate) struct Shown {
    recordings: usize,
    next: usize,
    found: usize,
}

impl Shown {
    /// All recordings, and as many of the rest as fit beside them.
    pub const USUAL: Shown = Shown { recordings: usize::MAX, next: SHOWN, found: SHOWN };
}

/// The summary of a run, ending in a newline. It ends with the verdict, the status and the next step.
pub fn run_text(run: &Run, style: TerminalStyle, detail: Detail) -> String {
    let text = summary_sections(run, style, detail, Shown::USUAL);
    let few = Shown { recordings: FEW, ..Shown::USUAL };
    let shorter = [few, Shown { next: 1, ..few }, Shown { next: 1, found: 1, ..few }];
    let fits = |text: &String| detail == Detail::Everything || text.lines().count() <= SCREEN;
    shorter.into_iter().fold(text, |text, shown| {
        if fits(&text) { text } else { summary_sections(run, style, detail, shown) }
    })
}

fn summary_sections(run: &Run, style: TerminalStyle, detail: Detail, shown: Shown) -> String {
    let pen = Pen { style };
    let pooled = run.is_pool().then(|| format!("{} recordings of one arm", run.recordings.len()));
    let about = joined_tips_text(run).or(pooled).map_or_else(String::new, |about| format!("   {about}"));
    let mut sections =
        vec![format!("armcal {VERSION}   pipeline {}{about}\n", printable_name(&run.pipeline_name))];
    let story = Story::of(run);
    let leads = matches!(story.lamp, "setup" | "unexplained");
    sections.extend(leads.then(|| pen.verdict(&story.missing, false)));
    sections.push(pen.section("Recordings", recording_table(&pen, run, shown.recordings)));
    let errors = match detail {
        Detail::Story => errors_that_count(&pen, &run.calibration),
        Detail::Everything => error_table(&pen, &run.calibration),
    };
    sections.push(pen.section(&format!("{} [mm]", errors_are(run)), errors));
    let markers = by_marker(run);
    let what = if run.model.places().next().is_some() { "measurement" } else { "marker" };
    sections.extend(
        (!markers.is_empty())
            .then(|| pen.section(&format!("Mean errors by {what} [mm]"), of_markers(&pen, &markers, what))),
    );
    match detail {
        Detail::Everything => {
            sections.push(pen.section("Parameters", parameter_table(&pen, &run.calibration)));
            sections.extend(undetermined_section(&pen, &run.calibration));
            sections.extend(warning_section(&pen, story.warnings.iter().collect(), 0));
        }
        Detail::Story => sections.extend(brief_sections(&pen, parameter_sentence(&run.calibration), &story)),
    }
    sections.extend(conclusion_sections(&pen, &story, detail, shown));
    sections.join("\n")
}

/// What is said of the `parameters`, notices by their number, the gravest warnings by their words.
pub(crate) fn brief_sections(pen: &Pen, parameters: Option<String>, story: &Story) -> Vec<String> {
    let (notices, mut grave): (Vec<_>, Vec<_>) =
        story.warnings.iter().partition(|w| w.severity == Severity::Notice);
    // What the answer says already is not said once more.
    grave.retain(|w| !story.missing.contains(&w.message));
    let left_out = [parameters, notice_count_text(notices.len())];
    let left_out: Vec<String> = left_out.into_iter().flatten().collect();
    let brief = (!left_out.is_empty()).then(|| format!("{} (`-v` lists them)", left_out.join("; ")));
    let counted = brief.map(|brief| pen.list(std::iter::once(("-", brief))));
    let more = grave.len().saturating_sub(SHOWN);
    grave.truncate(SHOWN);
    counted.into_iter().chain(warning_section(pen, grave, more)).collect()
}

/// What it came to, what is missing, the status and the next step.
pub(crate) fn conclusion_sections(pen: &Pen, story: &Story, detail: Detail, shown: Shown) -> [String; 2] {
    let verdict = |text: &str| pen.verdict(text, story.status == Status::Ok);
    let list = |label, entries: &[String], most: usize| match detail {
        Detail::Everything => pen.list(entries.iter().map(|e| (label, e.clone()))),
        Detail::Story => pen.list(first_ones(entries, most).into_iter().map(|e| (label, e))),
    };
    let missing = if story.missing.is_empty() { String::new() } else { verdict(&story.missing) };
    let found = if detail == Detail::Story { &story.found_briefly } else { &story.found };
    [
        verdict(&story.calibration) + &missing + &list("-", found, shown.found),
        verdict(&format!("Status: {}", story.status_sentence())) + &list("next:", &story.next, shown.next),
    ]
}

/// So many at most, and how many more there are.
fn first_ones(entries: &[String], most: usize) -> Vec<String> {
    let more = entries.len().saturating_sub(most);
    let rest = (more > 0).then(|| format!("and {more} more (`-v` lists them)"));
    entries.iter().take(most).cloned().chain(rest).collect()
}

/// The parameters in one sentence; none where none is free.
pub(crate) fn parameter_sentence(calibration: &Calibration) -> Option<String> {
    let free = || calibration.fit.estimates.iter().filter(|e| e.parameter.free);
    let open: Vec<String> =
        free().filter(|e| !e.determined).map(|e| printable_name(&e.parameter.name)).collect();
    let named = open.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more = if open.len() > NAMED { ", .." } else { "" };
    let undetermined = match open.len() {
        0 => "all determined by these data".to_owned(),
        n => format!("{n} of them not determined by these data and kept near nominal ({named}{more})"),
    };
    (free().count() > 0).then(|| format!("{} parameters fitted, {undetermined}", free().count()))
}

fn notice_count_text(n: usize) -> Option<String> {
    (n > 0).then(|| if n == 1 { "1 notice".to_owned() } else { format!("{n} notices") })
}

fn recording_table(pen: &Pen, run: &Run, most: usize) -> String {
    let pool = run.is_pool();
    let mut table = pen.table(match pool {
        true => &["recording", "dwells", "rejected", "nominal [mm]", "calibrated", "as a new day"],
        false => &["recording", "dwells", "associated", "rejected", "clock offset [ms]", "drift [ppm]"],
    });
    let errors = if pool { run.errors_by_recording() } else { Vec::new() };
    // One that is left out for a line that says so saves none.
    let most = if run.recordings.len() == most.saturating_add(1) { most + 1 } else { most };
    for (at, recording) in run.recordings.iter().enumerate().take(most) {
        let (dwells, rejected) = (recording.found().to_string(), recording.rejected().to_string());
        let numbers = match errors.get(at) {
            Some(e) => {
                let unseen = e.unseen.map_or("-".into(), |unseen| format_mm(unseen.mean_m));
                [dwells, rejected, format_mm(e.nominal.mean_m), format_mm(e.calibrated.mean_m), unseen]
            }
            None => {
                let associated = run.associated(recording).to_string();
                let [offset_ms, drift_ppm] = recording.clock_shown().unwrap_or(["-", "-"].map(str::to_owned));
                [dwells, associated, rejected, offset_ms, drift_ppm]
            }
        };
        let name = [Cell::new(printable_name(&recording.name))];
        table.add_row(name.into_iter().chain(numbers.map(number_cell)).collect::<Vec<Cell>>());
    }
    let more = run.recordings.len().saturating_sub(most);
    let rest = format!("and {more} more (`-v` lists them)");
    let rest = if more > 0 { pen.list([("-", rest)].into_iter()) } else { String::new() };
    pen.render(&table) + &rest
}

fn of_markers(pen: &Pen, markers: &[MarkerErrors<'_>], what: &str) -> String {
    let mut table = pen.table(&[what, "n", "nominal", "calibrated", "declared noise"]);
    for of in markers {
        let mut row = vec![Cell::new(printable_name(&of.marker)), number_cell(of.n)];
        row.extend(of.shown().map(number_cell));
        table.add_row(row);
    }
    pen.render(&table)
}

/// Nominal and calibrated errors on both sides of the hold-out.
pub(crate) fn error_table(pen: &Pen, calibration: &Calibration) -> String {
    errors_on(pen, calibration, &[("fitted", &calibration.train), ("held out", &calibration.holdout)])
}

/// The same on the held-out side alone, where there is one.
fn errors_that_count(pen: &Pen, calibration: &Calibration) -> String {
    match calibration.held_out() {
        true => errors_on(pen, calibration, &[("held out", &calibration.holdout)]),
        false => error_table(pen, calibration),
    }
}

fn errors_on(pen: &Pen, calibration: &Calibration, sides: &[(&str, &SideErrors)]) -> String {
    let mut table = pen.table(&["points", "n", "parameters", "mean", "rms", "p95", "max"]);
    for (label, side) in sides {
        if side.fitted.n == 0 {
            continue;
        }
        table.add_row(error_row(label, side.nominal.n.to_string(), "nominal", &side.nominal));
        table.add_row(error_row("", String::new(), "calibrated", &side.fitted));
    }
    let mut floor = vec![Cell::new("declared noise"), Cell::new(""), Cell::new("")];
    floor.push(number_cell(format_mm(calibration.noise_floor_m)));
    table.add_row(floor);
    pen.render(&table)
}

fn error_row(label: &str, n: String, parameters: &str, stats: &ErrorStats) -> Vec<Cell> {
    let mut row = vec![Cell::new(label), number_cell(n), Cell::new(parameters)];
    row.extend([stats.mean_m, stats.rms_m, stats.p95_m, stats.max_m].map(|m| number_cell(format_mm(m))));
    row
}

/// Free parameters only; the fixed ones are counted below the table and listed in `parameters.toml`.
pub(crate) fn parameter_table(pen: &Pen, calibration: &Calibration) -> String {
    parameters_of(pen, &calibration.fit.estimates.iter().collect::<Vec<_>>())
}

/// The same of some parameters.
pub(crate) fn parameters_of(pen: &Pen, estimates: &[&Estimate]) -> String {
    let mut table = pen.table(&["parameter", "unit", "nominal", "value", "change", "± 95 %", ""]);
    let (free, fixed): (Vec<&Estimate>, Vec<&Estimate>) =
        estimates.iter().copied().partition(|e| e.parameter.free);
    for e in free {
        let mut row =
            vec![Cell::new(printable_name(&e.parameter.name)), Cell::new(e.parameter.unit.display_symbol())];
        row.extend(estimate_shown(e).map(number_cell));
        row.push(pen.mark(Cell::new(estimate_remark(e))));
        table.add_row(row);
    }
    let mut text = pen.render(&table);
    match fixed.len() {
        0 => {}
        1 => text.push_str(" 1 parameter is fixed.\n"),
        n => text.push_str(&format!(" {n} parameters are fixed.\n")),
    }
    text
}

/// What the data leave open, if anything.
pub(crate) fn undetermined_section(pen: &Pen, calibration: &Calibration) -> Option<String> {
    let directions = &calibration.fit.undetermined;
    let texts = directions.iter().map(|d| ("-", printable_name(&d.text)));
    (!directions.is_empty())
        .then(|| pen.section("What these data cannot determine (kept near nominal)", pen.list(texts)))
}

/// Warnings, and that there are more of them.
pub(crate) fn warning_section(pen: &Pen, warnings: Vec<&ToldWarning>, more: usize) -> Option<String> {
    let entries = warnings.iter().map(|w| (w.severity.word(), w.text()));
    let rest = (more > 0).then(|| ("", format!("and {more} more (`-v` lists them)")));
    (!warnings.is_empty()).then(|| pen.section("Warnings", pen.list(entries.chain(rest))))
}
