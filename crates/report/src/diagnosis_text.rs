//! What is missing, for a person in the terminal.

use crate::pen::{Pen, TerminalStyle, number_cell};
use armcal_core::printable_name;
use armcal_diagnose::Diagnosis;
use armcal_result::{Called, Conclusions, Run};
use armcal_wording::{
    all_found, answer, candidate_sizes, explanations, headline, next_steps, shown_unlisted, unlisted_toml,
};
use comfy_table::Cell;

/// Rows of the ranking.
pub(crate) const RANKED: usize = 8;
/// Heading of errors that no calibration gave.
pub(crate) const PREDICTED: &str = "linearised, left out [mm]";
/// Heading of the tables that add what is unlisted.
pub(crate) const PASTE: &str = "To paste into the pipeline";

/// The diagnosis of a run in full, ending in a newline; says so where there is none.
pub fn diagnosis_text(run: &Run, style: TerminalStyle) -> String {
    match &run.diagnosis {
        None => answer(run).sentence + "\n",
        Some(d) => full_text(&run.called(), d, style),
    }
}

/// That of a run from its results, as the run told it.
pub fn concluded_text(conclusions: &Conclusions, style: TerminalStyle) -> String {
    full_text(&conclusions.called, &conclusions.diagnosis, style)
}

fn full_text(called: &Called, d: &Diagnosis, style: TerminalStyle) -> String {
    diagnosis_sections(&Pen { style }, called, d)
}

/// What is missing: the answer, what was found, what to do next.
fn answer_section(pen: &Pen, called: &Called, d: &Diagnosis) -> String {
    let list = |label, entries: Vec<String>| pen.list(entries.into_iter().map(|entry| (label, entry)));
    pen.section(&headline(called, d), list("-", all_found(called, d)) + &list("next:", next_steps(called, d)))
}

fn diagnosis_sections(pen: &Pen, called: &Called, d: &Diagnosis) -> String {
    let told = |said: &str| called.in_words(&printable_name(said));
    let mut sections = vec![answer_section(pen, called, d)];
    sections.push(pen.section("Candidates, best first", candidate_table(pen, called, d)));
    if !d.cannot_tell_apart.is_empty() {
        let pairs = d.cannot_tell_apart.iter().map(|[a, b]| ("-", told(&format!("{a} and {b}"))));
        sections.push(pen.section("The same to these data", pen.list(pairs)));
    }
    if !d.not_testable.is_empty() {
        let rows = d.not_testable.iter().map(|n| {
            let text = format!(
                "{}: smallest size seen {}, typical {} ({})",
                n.effect, n.smallest_seen, n.typical, n.why
            );
            ("-", told(&text))
        });
        sections.push(pen.section("What these data could not have shown", pen.list(rows)));
    }
    let tables: Vec<String> = shown_unlisted(d).map(unlisted_toml).filter(|t| !t.is_empty()).collect();
    if !tables.is_empty() {
        sections.push(pen.section(PASTE, tables.join("\n")));
    }
    let sentences = explanations(d).into_iter().map(|e| {
        (
            "-",
            format!("{}: {}", called.recordings.number_label(&printable_name(&e.number)), told(&e.sentence)),
        )
    });
    sections.push(pen.section("The numbers, one by one", pen.list(sentences)));
    sections.join("\n")
}

fn candidate_table(pen: &Pen, called: &Called, d: &Diagnosis) -> String {
    let mut table = pen.table(&[
        "explanation",
        "size",
        "behind [nats]",
        "probability",
        "p",
        PREDICTED,
        "absorbed",
        "also",
    ]);
    for c in d.candidates.iter().take(RANKED) {
        table.add_row(vec![
            Cell::new(called.in_words(&printable_name(&c.spec))),
            Cell::new(candidate_sizes(c)),
            number_cell(score_gap_text(c.standing.map(|s| s.behind_nats), c.standing.map(|s| s.behind_se))),
            number_cell(c.standing.map_or("-".into(), |s| format!("{:.3}", s.probability))),
            number_cell(format!("{:.3}", c.p_adjusted)),
            number_cell(c.holdout_mm.map_or("-".into(), |h| format!("{:.3} -> {:.3}", h.before, h.after))),
            number_cell(format!("{:.0} %", c.absorbed * 100.0)),
            Cell::new(called.in_words(&printable_name(&c.same_to_the_data.join(", ")))),
        ]);
    }
    pen.render(&table)
}

/// How far behind the answer, with its standard error.
pub(crate) fn score_gap_text(nats: Option<f64>, se: Option<f64>) -> String {
    nats.zip(se).map_or("-".into(), |(nats, se)| format!("{nats:.1} ± {se:.1}"))
}
