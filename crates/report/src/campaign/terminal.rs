//! A campaign for people, at most 100 columns wide.

use super::describe::{cells, change_meaning, change_sentence, repeat_sentence};
use super::story::campaign_story;
use crate::pen::{Pen, TerminalStyle, number_cell};
use crate::terminal::{Detail, Shown, conclusion_sections};
use armcal_campaign::Row;
use armcal_core::printable_name;
use armcal_result::{Campaign, VERSION};
use comfy_table::Cell;

/// Recordings listed at most; all are in the page and in the table files.
const LISTED: usize = 25;

/// Tables and one sentence, ending in a newline.
pub fn campaign_text(campaign: &Campaign, style: TerminalStyle) -> String {
    let pen = Pen { style };
    let mut sections = vec![format!("armcal {VERSION}   pipeline {}\n", printable_name(&campaign.pipeline))];
    if !campaign.rows.is_empty() {
        sections.push(
            pen.section("Recordings, each calibrated by itself", recording_table(&pen, &campaign.rows)),
        );
    }
    if !campaign.repeats.is_empty() {
        let listed = campaign.repeats.iter().take(LISTED).map(|r| ("repeated", repeat_sentence(campaign, r)));
        let mut text = pen.list(listed);
        if let Some(more) = campaign.repeats.len().checked_sub(LISTED + 1) {
            text.push_str(&format!(" and {} more in campaign.html and campaign.json\n", more + 1));
        }
        sections.push(pen.section("The same readings twice", text));
    }
    if !campaign.changes.is_empty() {
        let changes = campaign.changes.iter().map(|c| {
            let meaning = change_meaning(c).map_or(String::new(), |m| format!(" ({m}?)"));
            ("changed", format!("{}{meaning}", change_sentence(campaign, c)))
        });
        sections.push(pen.section("What changed", pen.list(changes)));
    }
    if !campaign.failed.is_empty() {
        let failed = campaign
            .failed
            .iter()
            .map(|f| ("failed", format!("{}: {}", printable_name(&f.recording), printable_name(&f.why))));
        sections.push(pen.section("Not calibrated", pen.list(failed)));
    }
    sections.extend(conclusion_sections(&pen, &campaign_story(campaign), Detail::Everything, Shown::USUAL));
    sections.join("\n")
}

fn recording_table(pen: &Pen, rows: &[Row]) -> String {
    let mut table =
        pen.table(&["recording", "start (UTC)", "dwells", "used", "before", "after [mm]", "missing", ""]);
    for row in rows.iter().take(LISTED) {
        let [start, before, after, flag] = cells(row, "-");
        table.add_row(vec![
            Cell::new(printable_name(&row.recording)),
            Cell::new(start),
            number_cell(row.dwells),
            number_cell(row.associated),
            number_cell(before),
            number_cell(after),
            Cell::new(printable_name(&row.missing.join(", "))),
            Cell::new(flag),
        ]);
    }
    let mut text = pen.render(&table);
    if rows.len() > LISTED {
        text.push_str(&format!(" and {} more in campaign.html and campaign.parquet\n", rows.len() - LISTED));
    }
    text
}
