//! A campaign for people, at most 100 columns wide.

use super::Campaign;
use super::date::minute;
use super::words::{meaning, repeated, sentence};
use crate::pen::{Pen, TerminalStyle, number};
use crate::run::{Status, VERSION};
use crate::text::{millimetres, printable};
use armcal_campaign::{ErrorFigures, Row};
use comfy_table::Cell;

/// Recordings listed at most; all are in the page and in the table files.
const LISTED: usize = 25;

/// Tables and one sentence, ending in a newline.
pub fn campaign_text(campaign: &Campaign, style: TerminalStyle) -> String {
    let pen = Pen { style };
    let mut sections = vec![format!("armcal {VERSION}   pipeline {}\n", printable(&campaign.pipeline))];
    if !campaign.rows.is_empty() {
        sections.push(pen.section("Recordings, each calibrated by itself", recordings(&pen, &campaign.rows)));
    }
    if !campaign.repeats.is_empty() {
        let listed = campaign.repeats.iter().take(LISTED).map(|r| ("repeated", repeated(campaign, r)));
        let mut text = pen.list(listed);
        if let Some(more) = campaign.repeats.len().checked_sub(LISTED + 1) {
            text.push_str(&format!(" and {} more in campaign.html and campaign.json\n", more + 1));
        }
        sections.push(pen.section("The same readings twice", text));
    }
    if !campaign.changes.is_empty() {
        let changes = campaign.changes.iter().map(|c| {
            let meaning = meaning(c).map_or(String::new(), |m| format!(" ({m}?)"));
            ("changed", format!("{}{meaning}", sentence(campaign, c)))
        });
        sections.push(pen.section("What changed", pen.list(changes)));
    }
    if !campaign.failed.is_empty() {
        let failed = campaign
            .failed
            .iter()
            .map(|f| ("failed", format!("{}: {}", printable(&f.recording), printable(&f.why))));
        sections.push(pen.section("Not calibrated", pen.list(failed)));
    }
    sections.push(pen.verdict(&conclusion(campaign), campaign.status() == Status::Ok));
    sections.join("\n")
}

fn recordings(pen: &Pen, rows: &[Row]) -> String {
    let mut table =
        pen.table(&["recording", "start (UTC)", "dwells", "used", "before", "after [mm]", "missing", ""]);
    for row in rows.iter().take(LISTED) {
        let mean = |e: &ErrorFigures| e.mean_m.map_or("-".into(), millimetres);
        table.add_row(vec![
            Cell::new(printable(&row.recording)),
            Cell::new(minute(row.start_ns)),
            number(row.dwells),
            number(row.associated),
            number(mean(&row.nominal)),
            number(mean(&row.calibrated)),
            Cell::new(printable(&row.missing.join(", "))),
            Cell::new(if row.status == armcal_campaign::RowStatus::Ok { "" } else { row.status.word() }),
        ]);
    }
    let mut text = pen.render(&table);
    if rows.len() > LISTED {
        text.push_str(&format!(" and {} more in campaign.html and campaign.parquet\n", rows.len() - LISTED));
    }
    text
}

/// What it comes to, in one sentence.
pub(super) fn conclusion(campaign: &Campaign) -> String {
    let (done, failed) = (campaign.rows.len(), campaign.failed.len());
    let of = done + failed;
    let median = |of: fn(&Row) -> &ErrorFigures| {
        let mut means: Vec<f64> = campaign.counted().filter_map(|r| of(r).mean_m).collect();
        means.sort_by(f64::total_cmp);
        means.get(means.len() / 2).map(|m| millimetres(*m))
    };
    let errors = match (median(|r| &r.nominal), median(|r| &r.calibrated)) {
        (Some(before), Some(after)) => format!(": mean error {before} mm before, {after} mm after (median)"),
        _ => String::new(),
    };
    let changes = match campaign.changes.len() {
        0 => "nothing changed beyond scatter".to_owned(),
        1 => "1 change".to_owned(),
        n => format!("{n} changes"),
    };
    let once = match done - campaign.counted().count() {
        0 => String::new(),
        1 => ", 1 of them a repetition that counts once".to_owned(),
        n => format!(", {n} of them repetitions that count once"),
    };
    format!("{done} of {of} recordings calibrated{once}{errors}; {changes}.")
}
