//! A campaign for programs, and its page.

use super::describe::{change_meaning, change_sentence, repeat_sentence};
use super::page::CampaignPage;
use super::story::campaign_conclusion;
use crate::ReportError;
use crate::tables::Columns;
use crate::write::{commit_all, stage_file, stage_pieces};
use armcal_campaign::{Change, Row};
use armcal_core::Unit;
use armcal_result::{Campaign, FailedRecording, Repeat, Status, VERSION};
use askama::Template as _;
use serde::Serialize;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Version of the contract of `campaign.json`.
const SCHEMA: &str = "armcal.campaign/1";

#[derive(Serialize)]
struct File<'a> {
    schema: &'static str,
    version: &'static str,
    pipeline: &'a str,
    status: Status,
    conclusion: String,
    recordings: Vec<Recording<'a>>,
    failed: &'a [FailedRecording],
    repeated: Vec<Repeated<'a>>,
    changes: Vec<Told<'a>>,
}

#[derive(Serialize)]
struct Recording<'a> {
    folder: &'a str,
    #[serde(flatten)]
    row: &'a Row,
}

/// A recording that holds what an earlier one holds, with the words for it; both by their place in `recordings`.
#[derive(Serialize)]
struct Repeated<'a> {
    #[serde(flatten)]
    repeat: &'a Repeat,
    counts_once: bool,
    sentence: String,
}

/// A change, with the words for it; recordings by their place in `recordings`.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    change: &'a Change,
    sentence: String,
    meaning: Option<&'static str>,
}

/// `campaign.json`: every row in SI, what failed, what changed; indented, with a final newline.
pub fn campaign_json(campaign: &Campaign) -> String {
    let json = serde_json::to_string_pretty(&File::of(campaign));
    json.expect("strings, numbers and lists under literal names always serialise") + "\n"
}

impl<'a> File<'a> {
    fn of(campaign: &'a Campaign) -> File<'a> {
        let told = |change| Told {
            change,
            sentence: change_sentence(campaign, change),
            meaning: change_meaning(change),
        };
        File {
            schema: SCHEMA,
            version: VERSION,
            pipeline: &campaign.pipeline,
            status: campaign.status(),
            conclusion: campaign_conclusion(campaign),
            recordings: campaign
                .rows
                .iter()
                .zip(&campaign.folders)
                .map(|(row, folder)| Recording { folder, row })
                .collect(),
            failed: &campaign.failed,
            repeated: campaign
                .repeats
                .iter()
                .map(|repeat| Repeated {
                    repeat,
                    counts_once: repeat.counts_once(),
                    sentence: repeat_sentence(campaign, repeat),
                })
                .collect(),
            changes: campaign.changes.iter().map(told).collect(),
        }
    }
}

/// Writes `campaign.html`, `campaign.json`, and `campaign.parquet` with a row a recording and a column a quantity, into
/// `folder`; returns their paths. All are complete before the first one appears.
///
/// # Errors
/// A page or table that cannot be made, a file that cannot be written.
pub fn write_campaign(campaign: &Campaign, folder: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let [html, json, parquet] = campaign_files(folder);
    // What takes most memory comes before anything else is held.
    let table = campaign_columns(campaign).encode("campaign.parquet")?;
    let staged = vec![
        {
            let page = CampaignPage::of(campaign)?;
            stage_pieces(&html, |out| page.write_into(out))?
        },
        stage_pieces(&json, |out| {
            serde_json::to_writer_pretty(&mut *out, &File::of(campaign))?;
            out.write_all(b"\n")
        })?,
        stage_file(&parquet, &table)?,
    ];
    commit_all(staged)
}

/// The files that [`write_campaign`] writes into `folder`.
pub fn campaign_files(folder: &Path) -> [PathBuf; 3] {
    ["campaign.html", "campaign.json", "campaign.parquet"].map(|name| folder.join(name))
}

fn campaign_columns(campaign: &Campaign) -> Columns {
    let rows = &campaign.rows;
    let number = |f: fn(&Row) -> Option<f64>| rows.iter().map(f);
    let mut c = Columns::default();
    c.text("recording", rows.iter().map(|r| Some(r.recording.as_str())));
    c.text("folder", campaign.folders.iter().map(|f| Some(f.as_str())));
    c.text("status", rows.iter().map(|r| Some(r.status.word())));
    c.text("tilt", rows.iter().map(|r| Some(r.tilt.as_str())));
    c.number("load_kg", number(|r| Some(r.load_kg)));
    c.integer("start_ns", rows.iter().map(|r| r.start_ns));
    c.integer("end_ns", rows.iter().map(|r| r.end_ns));
    c.integer("bytes", rows.iter().map(|r| i64::try_from(r.bytes).unwrap_or(i64::MAX)));
    c.integer("dwells", rows.iter().map(|r| r.dwells as i64));
    c.integer("associated", rows.iter().map(|r| r.associated as i64));
    c.integer("rejected", rows.iter().map(|r| r.rejected as i64));
    c.number("nominal_mean_mm", number(|r| r.nominal.mean_m.map(|m| m * 1e3)));
    c.number("calibrated_mean_mm", number(|r| r.calibrated.mean_m.map(|m| m * 1e3)));
    c.number("calibrated_rms_mm", number(|r| r.calibrated.rms_m.map(|m| m * 1e3)));
    c.number("calibrated_p95_mm", number(|r| r.calibrated.p95_m.map(|m| m * 1e3)));
    c.number("calibrated_max_mm", number(|r| r.calibrated.max_m.map(|m| m * 1e3)));
    c.number("noise_floor_mm", number(|r| Some(r.noise_floor_m * 1e3).filter(|m| m.is_finite())));
    c.text("verdict", rows.iter().map(|r| Some(r.verdict.as_str())));
    let missing: Vec<String> = rows.iter().map(|r| r.missing.join("+")).collect();
    c.text("missing", missing.iter().map(|m| Some(m.as_str())));
    c.integer("warnings", rows.iter().map(|r| r.warnings.len() as i64));
    add_quantity_columns(&mut c, rows);
    c
}

/// Every quantity that a row has, determined or not, in the order of first appearance.
fn add_quantity_columns(c: &mut Columns, rows: &[Row]) {
    let mut names: Vec<(&str, Unit)> = Vec::new();
    let mut known = std::collections::BTreeSet::new();
    for q in rows.iter().flat_map(|r| &r.quantities) {
        if known.insert(&*q.name) {
            names.push((&q.name, q.unit));
        }
    }
    for (name, unit) in names {
        let find = |r: &Row| r.quantities.iter().find(|q| &*q.name == name).cloned();
        let symbol = unit.symbol();
        c.number(format!("{name} [{symbol}]"), rows.iter().map(|r| find(r).map(|q| q.value)));
        c.number(format!("{name} sigma [{symbol}]"), rows.iter().map(|r| find(r).and_then(|q| q.sigma)));
        let determined = |r: &Row| find(r).map(|q| f64::from(u8::from(q.determined)));
        c.number(format!("{name} determined"), rows.iter().map(determined));
    }
}
