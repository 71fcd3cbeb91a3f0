//! The files of a run of two arms.
//!
//! The names in `summary.json` are a contract (`armcal.closed-chain/1`): fields are added, never renamed.

use super::page::closed_html;
use super::{ClosedRecording, ClosedRun};
use crate::ReportError;
use crate::channels::closed_messages;
use crate::layouts::closed_layouts;
use crate::mcap_file::{Attachment, write_results};
use crate::model_file::calibrated;
use crate::parameters::{Entry, FrameEntry, entry, frame_entry};
use crate::run::{Status, VERSION};
use crate::summary::{FitSummary, fit};
use crate::text::conclusion_about;
use crate::write::{LAYOUT, LAYOUT_LEGACY, REPORT, RUN, at, commit_all, stage};
use armcal_calibrate::Residual;
use armcal_core::Warning;
use armcal_recording::Recording;
use armcal_recording::atomic::AtomicFile;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Version of the contract.
pub const CLOSED_SCHEMA: &str = "armcal.closed-chain/1";

const HEADER: &str = "\
# Parameters of two arms in a closed chain. value, nominal, sigma and ci95 (the 95 % interval) are in `unit`.
# determined = false: the data say nothing about it and the prior keeps it near nominal.
# Frames: where `frame` lies in `parent`; roll, pitch, yaw about the fixed x, y, z of the parent.

";

#[derive(Serialize)]
struct Summary<'a> {
    schema: &'static str,
    version: &'static str,
    pipeline: &'a str,
    status: Status,
    arms: [&'a str; 2],
    closure: &'static str,
    /// After the fit; `null` for tips in one point.
    link_length_mm: Option<f64>,
    recordings: Vec<RecordingSummary<'a>>,
    /// Errors in it are closing errors.
    fit: FitSummary<'a>,
    frames: Vec<FrameEntry>,
    dwells: Vec<DwellSummary>,
    conclusion: String,
    warnings: Vec<&'a Warning>,
}

#[derive(Serialize)]
struct RecordingSummary<'a> {
    name: &'a str,
    path: String,
    files: Vec<FileSummary>,
    dwells: usize,
    open: Vec<OpenDwell<'a>>,
    warnings: Vec<&'a Warning>,
}

#[derive(Serialize)]
struct FileSummary {
    sha256: String,
    bytes: u64,
}

#[derive(Serialize)]
struct OpenDwell<'a> {
    dwell: usize,
    why: &'a str,
}

/// The closing error of one dwell, in the world.
#[derive(Serialize)]
struct DwellSummary {
    recording: usize,
    dwell: usize,
    time_ns: i64,
    held_out: bool,
    nominal_mm: [f64; 3],
    fitted_mm: [f64; 3],
    expected_mm: f64,
    weight: f64,
}

#[derive(Serialize)]
struct Parameters<'a> {
    pipeline: &'a str,
    version: &'static str,
    conclusion: String,
    undetermined: Vec<&'a str>,
    parameters: Vec<Entry<'a>>,
    frames: Vec<FrameEntry>,
}

/// Writes `run.mcap` (the messages of `recordings` and the result channels), `report.html`, `summary.json`, `parameters.toml`, Foxglove layouts
/// and the calibrated model of each arm (`<arm>.toml` or `<arm>.urdf`) into `out_dir`, which is made if need be; returns their
/// paths. Files of an earlier run are replaced, each at once.
///
/// # Errors
/// A folder or file that cannot be written, a model that its form cannot express.
pub fn write_closed(
    run: &ClosedRun,
    recordings: &[Recording],
    out_dir: &Path,
) -> Result<Vec<PathBuf>, ReportError> {
    let layouts = closed_layouts(run);
    let mut texts = vec![
        ("summary.json".to_owned(), closed_summary_json(run)?),
        ("parameters.toml".to_owned(), parameters_toml(run)?),
        (LAYOUT.to_owned(), layouts.current),
        (LAYOUT_LEGACY.to_owned(), layouts.legacy),
        (REPORT.to_owned(), closed_html(run)?),
    ];
    let values = run.calibration.fit.values();
    for (index, (arm, text)) in run.chain.arms().iter().zip(&run.model_texts).enumerate() {
        let file = calibrated(&arm.model, text, run.chain.of_arm(index, &values))?;
        let form = file.name.rsplit_once('.').map_or("toml", |(_, form)| form);
        texts.push((format!("{}.{form}", arm.name), file.text));
    }
    std::fs::create_dir_all(out_dir)
        .map_err(|source| ReportError::Folder { path: out_dir.to_owned(), source })?;
    let staged = texts.iter().map(|(name, text)| stage(&out_dir.join(name), text.as_bytes()));
    let mut staged = staged.collect::<Result<Vec<_>, ReportError>>()?;
    // The last to get its name, as in `write_all`.
    staged.push(stage_run(run, recordings, &texts, out_dir)?);
    commit_all(staged)
}

/// The files that [`write_closed`] writes into `out_dir`, of arms by name, each with a URDF or a DH file.
pub fn closed_files<'a>(out_dir: &Path, arms: impl IntoIterator<Item = (&'a str, bool)>) -> Vec<PathBuf> {
    let models = arms.into_iter().map(|(arm, urdf)| format!("{arm}.{}", if urdf { "urdf" } else { "toml" }));
    let fixed = [RUN, "summary.json", "parameters.toml", LAYOUT, LAYOUT_LEGACY, REPORT].map(str::to_owned);
    fixed.into_iter().chain(models).map(|name| out_dir.join(name)).collect()
}

/// Writes `run.mcap` with the other files attached.
fn stage_run(
    run: &ClosedRun,
    recordings: &[Recording],
    texts: &[(String, String)],
    out_dir: &Path,
) -> Result<AtomicFile, ReportError> {
    let attachment = |(name, text): &'_ (String, String)| {
        let media_type = match name.rsplit_once('.').map(|(_, form)| form) {
            Some("json") => "application/json",
            Some("urdf") => "application/xml",
            Some("html") => "text/html",
            _ => "application/toml",
        };
        (name.clone(), media_type, text.clone())
    };
    let mut files: Vec<(String, &str, String)> = texts.iter().map(attachment).collect();
    files.push(("pipeline.toml".into(), "application/toml", run.pipeline_text.clone()));
    let attachments: Vec<Attachment<'_>> =
        files.iter().map(|(name, media_type, text)| Attachment { name, media_type, text }).collect();
    let about = [("version", VERSION), ("pipeline", &run.pipeline_name), ("summary_schema", CLOSED_SCHEMA)];
    let about = about.map(|(key, value)| (key.to_owned(), value.to_owned())).into_iter().collect();
    let path = out_dir.join(RUN);
    let about = [("armcal/run", about)];
    write_results(closed_messages(run), recordings, &attachments, run.end_ns(), &about, &path)
        .map_err(at(&path))
}

/// The summary of a run: indented JSON with a final newline.
pub fn closed_summary_json(run: &ClosedRun) -> Result<String, ReportError> {
    let calibration = &run.calibration;
    let [first, second] = run.chain.arms();
    let link_length_m = run.chain.link_length_m(&calibration.fit.values());
    let summary = Summary {
        schema: CLOSED_SCHEMA,
        version: VERSION,
        pipeline: &run.pipeline_name,
        status: run.status(),
        arms: [&first.name, &second.name],
        closure: run.chain.closure().word(),
        link_length_mm: link_length_m.map(|m| m * 1e3),
        recordings: run.recordings.iter().map(recording).collect(),
        fit: fit(calibration),
        frames: frames(run),
        dwells: run
            .observations
            .iter()
            .zip(&calibration.residuals)
            .map(|(o, r)| dwell(o.arms[0].time_ns, r))
            .collect(),
        conclusion: conclusion_about(calibration, "closing error"),
        warnings: run.overall_warnings(),
    };
    Ok(serde_json::to_string_pretty(&summary).map_err(ReportError::Page)? + "\n")
}

fn recording(r: &ClosedRecording) -> RecordingSummary<'_> {
    RecordingSummary {
        name: &r.name,
        path: r.paths.first().map(|p| p.to_string_lossy().into_owned()).unwrap_or_default(),
        files: r.report.files.iter().map(|f| FileSummary { sha256: f.identity(), bytes: f.bytes }).collect(),
        dwells: r.dwells.len(),
        open: r.open.iter().map(|o| OpenDwell { dwell: o.dwell.dwell, why: &o.why }).collect(),
        warnings: r.all_warnings(),
    }
}

fn dwell(time_ns: i64, r: &Residual) -> DwellSummary {
    DwellSummary {
        recording: r.dwell.recording,
        dwell: r.dwell.dwell,
        time_ns,
        held_out: r.held_out,
        nominal_mm: (r.nominal_m * 1e3).into(),
        fitted_mm: (r.fitted_m * 1e3).into(),
        expected_mm: r.expected_norm_m * 1e3,
        weight: r.weight,
    }
}

fn parameters_toml(run: &ClosedRun) -> Result<String, ReportError> {
    let fit = &run.calibration.fit;
    let file = Parameters {
        pipeline: &run.pipeline_name,
        version: VERSION,
        conclusion: conclusion_about(&run.calibration, "closing error"),
        undetermined: fit.undetermined.iter().map(|u| u.text.as_str()).collect(),
        parameters: fit.estimates.iter().map(entry).collect(),
        frames: frames(run),
    };
    Ok(format!("{HEADER}{}", toml::to_string(&file)?))
}

/// Base and tip of both arms, as calibrated.
fn frames(run: &ClosedRun) -> Vec<FrameEntry> {
    let values = run.calibration.fit.values();
    let of_arm = |(index, arm): (usize, &armcal_calibrate::ChainArm)| {
        let (p, name) = (run.chain.of_arm(index, &values), &arm.name);
        [
            frame_entry(format!("{name}.base"), "world", &arm.model.base_in_world(p)),
            frame_entry(format!("{name}.tip"), "last link", &arm.model.tip_in_last_link(p)),
        ]
    };
    run.chain.arms().iter().enumerate().flat_map(of_arm).collect()
}
