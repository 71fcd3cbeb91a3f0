//! The checks for a person in the terminal.

use super::{Check, Judged};
use armcal_report::{number_cell, plain_table, table_text};
use comfy_table::{Cell, ContentArrangement};

/// Widest line.
const COLUMNS: u16 = 100;

/// A table, the causes of what is broken, and the answer as the last line.
pub fn text(judged: &Judged) -> String {
    let mut text = check_table(&judged.checks);
    for (checks, sentences) in causes(judged) {
        text.push_str(&format!("\n{checks}\n{}", bullet_list(&sentences)));
    }
    if !judged.doubts.is_empty() {
        text.push_str(&format!("\nWhat makes it doubtful\n{}", bullet_list(&judged.doubts)));
    }
    format!("{text}\n{}\n", judged.line)
}

fn check_table(checks: &[Check]) -> String {
    let mut table = plain_table();
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(COLUMNS);
    table.set_header(["check", "measured", "limit", ""]);
    for check in checks {
        table.add_row(vec![
            Cell::new(&check.name),
            number_cell(check.measured_text()),
            number_cell(check.limit_text()),
            Cell::new(if check.holds { "holds" } else { "BROKEN" }),
        ]);
    }
    table_text(&table)
}

/// Every sentence about what is broken once, under the checks that it is about: several limits are often broken by one
/// thing.
pub fn causes(judged: &Judged) -> Vec<(String, Vec<String>)> {
    let mut sentences: Vec<(Vec<&str>, &str)> = Vec::new();
    for check in judged.checks.iter().filter(|c| !c.holds) {
        for sentence in std::iter::once(&check.said).chain(&check.why) {
            match sentences.iter_mut().find(|(_, known)| known == sentence) {
                Some((checks, _)) => checks.push(&check.name),
                None => sentences.push((vec![&check.name], sentence)),
            }
        }
    }
    let mut causes: Vec<(String, Vec<String>)> = Vec::new();
    for (checks, sentence) in sentences {
        let checks = checks.join(", ");
        match causes.iter_mut().find(|(known, _)| *known == checks) {
            Some((_, all)) => all.push(sentence.to_owned()),
            None => causes.push((checks, vec![sentence.to_owned()])),
        }
    }
    causes
}

fn bullet_list(sentences: &[String]) -> String {
    let mut table = plain_table();
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(COLUMNS);
    for sentence in sentences {
        table.add_row(["-", sentence]);
    }
    table_text(&table)
}
