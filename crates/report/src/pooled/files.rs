//! The files of a pooled calibration.
//!
//! The names in `pool.json` are a contract (`armcal.pool/1`): fields are added, never renamed. Every number is finite or
//! `null`.

use super::page::pooled_html;
use super::{PooledRecordingRun, PooledRun, RecordingErrors};
use crate::ReportError;
use crate::parameters::{Entry, FrameEntry, entry, frame_entry};
use crate::past_model::{self, Calibrated, PastModel, chain_text};
use crate::past_observations::ObservedFile;
use crate::run::{Status, VERSION};
use crate::summary::{
    ErrorSummary, FitSummary, ParameterSummary, SideSummary, error_summary, fit, parameter, side,
};
use crate::text::conclusion;
use crate::write::{REPORT, commit_all, stage};
use armcal_core::{Pose, Warning};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Version of the contract.
pub const POOL_SCHEMA: &str = "armcal.pool/1";

const HEADER: &str = "\
# Parameters of an arm calibrated on many recordings at once. value, nominal, sigma and ci95 (the 95 % interval) are in `unit`.
# <recording>.<parameter> and board.<recording>.* are that recording's own; everything else is shared.
# determined = false: the data say nothing about it and the prior keeps it near nominal.
# Frames: where `frame` lies in `parent`; roll, pitch, yaw about the fixed x, y, z of the parent.

";

#[derive(Serialize)]
struct Summary<'a> {
    schema: &'static str,
    version: &'static str,
    pipeline: &'a str,
    status: Status,
    recordings: Vec<RecordingSummary<'a>>,
    /// With the hold-out of the pipeline; its parameters are the shared ones.
    fit: FitSummary<'a>,
    /// Covariance of the shared parameters that are free, SI.
    covariance: CovarianceSummary<'a>,
    /// Whole recordings held out in turn; `null` with one recording.
    transfer: Option<TransferSummary>,
    conclusion: String,
    warnings: Vec<&'a Warning>,
}

#[derive(Serialize)]
struct RecordingSummary<'a> {
    name: &'a str,
    result: String,
    files: &'a [ObservedFile],
    dwells: usize,
    rejected: usize,
    nominal_mm: ErrorSummary,
    fitted_mm: ErrorSummary,
    /// By calibrations that never saw this recording.
    unseen_mm: Option<ErrorSummary>,
    /// What this recording has for itself.
    parameters: Vec<ParameterSummary<'a>>,
    covariance: CovarianceSummary<'a>,
}

#[derive(Serialize)]
struct CovarianceSummary<'a> {
    names: Vec<&'a str>,
    rows: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct TransferSummary {
    noise_floor_mm: f64,
    unseen: SideSummary,
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

/// Writes `pool.json`, `parameters.toml`, `model.json` and `report.html` into `out_dir`, which is made if need be; returns their paths.
/// Files of an earlier run are replaced, each at once.
///
/// The model is the arm as it was last: what each recording has for itself is taken from the last one.
///
/// # Errors
/// A folder or file that cannot be written.
pub fn write_pooled(run: &PooledRun, out_dir: &Path) -> Result<Vec<PathBuf>, ReportError> {
    let texts = [pooled_json(run)?, parameters_toml(run)?, model(run).json()?, pooled_html(run)?];
    std::fs::create_dir_all(out_dir)
        .map_err(|source| ReportError::Folder { path: out_dir.to_owned(), source })?;
    let staged =
        pooled_files(out_dir).into_iter().zip(&texts).map(|(path, text)| stage(&path, text.as_bytes()));
    commit_all(staged.collect::<Result<Vec<_>, ReportError>>()?)
}

/// The files that [`write_pooled`] writes into `out_dir`.
pub fn pooled_files(out_dir: &Path) -> [PathBuf; 4] {
    ["pool.json", "parameters.toml", past_model::FILE, REPORT].map(|name| out_dir.join(name))
}

/// The summary of a pool: indented JSON with a final newline.
pub fn pooled_json(run: &PooledRun) -> Result<String, ReportError> {
    let shared = run.shared();
    let of_shared: Vec<usize> = (0..shared.len()).filter(|&index| shared[index]).collect();
    let estimates = &run.calibration.fit.estimates;
    let mut of_fit = fit(&run.calibration);
    of_fit.parameters = of_shared.iter().map(|&index| parameter(&estimates[index])).collect();
    let summary = Summary {
        schema: POOL_SCHEMA,
        version: VERSION,
        pipeline: &run.pipeline_name,
        status: run.status(),
        recordings: run
            .recordings
            .iter()
            .zip(run.errors())
            .enumerate()
            .map(|(at, (recording, errors))| summary_of(run, at, recording, &errors))
            .collect(),
        fit: of_fit,
        covariance: covariance(run, &of_shared),
        transfer: run
            .transfer
            .as_ref()
            .map(|c| TransferSummary { noise_floor_mm: c.noise_floor_m * 1e3, unseen: side(&c.holdout) }),
        conclusion: conclusion(&run.calibration),
        warnings: run.all_warnings(),
    };
    Ok(serde_json::to_string_pretty(&summary).map_err(ReportError::Page)? + "\n")
}

fn summary_of<'a>(
    run: &'a PooledRun,
    at: usize,
    recording: &'a PooledRecordingRun,
    errors: &RecordingErrors,
) -> RecordingSummary<'a> {
    let own = run.model.own_parameters(at);
    let estimates = &run.calibration.fit.estimates;
    RecordingSummary {
        name: &recording.name,
        result: recording.result.to_string_lossy().into_owned(),
        files: &recording.files,
        dwells: recording.dwells,
        rejected: recording.rejected,
        nominal_mm: error_summary(&errors.nominal),
        fitted_mm: error_summary(&errors.calibrated),
        unseen_mm: errors.unseen.as_ref().map(error_summary),
        parameters: own.iter().map(|&index| parameter(&estimates[index])).collect(),
        covariance: covariance(run, &own),
    }
}

/// Of those that are free.
fn covariance<'a>(run: &'a PooledRun, index: &[usize]) -> CovarianceSummary<'a> {
    let fit = &run.calibration.fit;
    let free: Vec<usize> = index.iter().copied().filter(|&i| fit.estimates[i].parameter.free).collect();
    let block = fit.covariance.block(&free);
    CovarianceSummary {
        names: free.iter().map(|&i| fit.estimates[i].parameter.name.as_str()).collect(),
        rows: block.row_iter().map(|row| row.iter().copied().collect()).collect(),
    }
}

fn parameters_toml(run: &PooledRun) -> Result<String, ReportError> {
    let fit = &run.calibration.fit;
    let file = Parameters {
        pipeline: &run.pipeline_name,
        version: VERSION,
        conclusion: conclusion(&run.calibration),
        undetermined: fit.undetermined.iter().map(|u| u.text.as_str()).collect(),
        parameters: fit.estimates.iter().map(entry).collect(),
        frames: frames(run),
    };
    Ok(format!("{HEADER}{}", toml::to_string(&file)?))
}

/// Base and tip of the last recording, and the board of every recording, as calibrated.
fn frames(run: &PooledRun) -> Vec<FrameEntry> {
    let p = run.calibration.fit.values();
    let (base, tip) = last_base_and_tip(run, &p);
    let mut frames =
        vec![frame_entry("base".into(), "world", &base), frame_entry("tip".into(), "last link", &tip)];
    for (index, recording) in run.recordings.iter().enumerate() {
        if let Some(board) = run.model.board_in_world(&p, index) {
            frames.push(frame_entry(format!("board.{}", recording.name), "world", &board));
        }
    }
    frames
}

fn last_base_and_tip(run: &PooledRun, p: &[f64]) -> (Pose, Pose) {
    let (model, p) = run.model.in_recording(run.recordings.len().saturating_sub(1), p);
    (model.base_in_world(&p), model.tip_in_last_link(&p))
}

/// The calibrated model as it was in the last recording.
fn model(run: &PooledRun) -> PastModel {
    let hashes = |r: &PooledRecordingRun| r.files.iter().map(|f| f.sha256.clone()).collect();
    PastModel::of_calibrated(&Calibrated {
        pipeline: &run.pipeline_name,
        chain: chain_text(run.model.chain(), std::slice::from_ref(&run.model_text), &run.pipeline_text),
        model: &run.model,
        calibration: &run.calibration,
        recordings: run.recordings.iter().map(|r| (r.name.as_str(), hashes(r))).collect(),
        observations: &run.observations,
        session: &run.session,
        missing: &[],
    })
}
