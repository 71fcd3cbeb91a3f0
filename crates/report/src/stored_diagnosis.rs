//! The diagnosis of results without [`crate::Conclusions`], from their `summary.json`.

use crate::diagnosis_text::{PASTE, PREDICTED, RANKED, score_gap_text};
use crate::pen::{Pen, TerminalStyle, number_cell};
use armcal_core::printable_name;
use armcal_result::{RecordingNames, StoredRun};
use comfy_table::Cell;
use serde_json::Value;

/// The diagnosis of an earlier run, from its summary: the answer, the ranking, and every number in a sentence.
pub fn stored_diagnosis(past: &StoredRun, style: TerminalStyle) -> String {
    let pen = Pen { style };
    let d = &past.summary["diagnosis"];
    let names = RecordingNames::new(past.recordings.iter().map(|r| r.name.clone()));
    let text = |v: &Value| v.as_str().map(printable_name).unwrap_or_default();
    let list = |v: &Value| v.as_array().into_iter().flatten().map(text).collect::<Vec<_>>();
    let told = |v: &Value| names.in_words(&text(v));
    let answer = told(&past.summary["answer_sentence"]);
    if d.is_null() {
        let answer = if answer.is_empty() { "It was not diagnosed.".to_owned() } else { answer };
        return format!("{}: {answer}\n", past.path.display());
    }
    let missing = list(&d["names"]).join(", ");
    let headline = match answer.is_empty() {
        true => format!("{} {missing}", text(&d["verdict"]).replace('_', " ")),
        false => answer,
    };
    let mut table = pen.table(&["explanation", "behind [nats]", "probability", "p", PREDICTED]);
    let three = |v: &Value| v.as_f64().map_or("-".to_owned(), |v| format!("{v:.3}"));
    for c in d["candidates"].as_array().into_iter().flatten().take(RANKED) {
        let h = &c["holdout_mm"];
        table.add_row(vec![
            Cell::new(told(&c["spec"])),
            number_cell(score_gap_text(c["behind_nats"].as_f64(), c["behind_se"].as_f64())),
            number_cell(three(&c["probability"])),
            number_cell(three(&c["p_adjusted"])),
            number_cell(format!("{} -> {}", three(&h["before"]), three(&h["after"]))),
        ]);
    }
    let sentences = d["explanations"].as_array().into_iter().flatten();
    let sentences = sentences
        .map(|e| ("-", format!("{}: {}", names.number_label(&text(&e["number"])), told(&e["sentence"]))));
    let next = list(&d["record_next"]).into_iter().map(|r| ("next:", names.in_words(&r)));
    let mut sections = vec![
        pen.section(headline.trim(), pen.list(next)),
        pen.section("Candidates, best first", pen.render(&table)),
    ];
    let unlisted = d["unlisted"].as_array().into_iter().flatten();
    let safe = |table: &str| table.lines().map(|l| printable_name(l) + "\n").collect::<String>();
    let tables: Vec<String> =
        unlisted.filter_map(|u| u["table"].as_str()).filter(|table| !table.is_empty()).map(safe).collect();
    if !tables.is_empty() {
        sections.push(pen.section(PASTE, tables.join("\n")));
    }
    sections.push(pen.section("The numbers, one by one", pen.list(sentences)));
    sections.join("\n")
}
