//! `pool.json`: what programs need to know of a calibration of earlier results.
//!
//! The names are a contract (`armcal.pool/1`): fields are added, never renamed. Every number is finite or `null`.

use crate::past_observations::ObservedFile;
use crate::run::{RecordingErrors, RecordingRun, Run, Status, VERSION};
use crate::summary::{
    ErrorSummary, FitSummary, ParameterSummary, SideSummary, error_summary, fit, parameter, side,
};
use crate::text::conclusion;
use armcal_core::Warning;
use serde::Serialize;

/// Version of the contract.
pub const POOL_SCHEMA: &str = "armcal.pool/1";
/// Its name in the folder of results.
pub(crate) const FILE: &str = "pool.json";

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
    /// As in `summary.json`, which has all of the diagnosis.
    answer: &'static str,
    answer_sentence: String,
    warnings: Vec<Warning>,
}

#[derive(Serialize)]
struct RecordingSummary<'a> {
    name: &'a str,
    result: String,
    files: Vec<ObservedFile>,
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

/// Of a run of earlier results: indented JSON with a final newline.
pub fn pool_json(run: &Run) -> String {
    let own: Vec<Vec<usize>> = (0..run.recordings.len()).map(|at| run.model.own_parameters(at)).collect();
    let is_shared = |index: &usize| !own.iter().any(|own| own.contains(index));
    let estimates = &run.calibration.fit.estimates;
    let shared: Vec<usize> = (0..estimates.len()).filter(is_shared).collect();
    let mut of_fit = fit(&run.calibration);
    of_fit.parameters = shared.iter().map(|&index| parameter(&estimates[index])).collect();
    let answer = run.answer();
    let recordings = run.recordings.iter().zip(run.errors_by_recording()).zip(&own);
    let summary = Summary {
        schema: POOL_SCHEMA,
        version: VERSION,
        pipeline: &run.pipeline_name,
        status: run.status(),
        recordings: recordings
            .map(|((recording, errors), own)| summary_of(run, recording, &errors, own))
            .collect(),
        fit: of_fit,
        covariance: covariance(run, &shared),
        transfer: run
            .transfer
            .as_ref()
            .map(|c| TransferSummary { noise_floor_mm: c.noise_floor_m * 1e3, unseen: side(&c.holdout) }),
        conclusion: conclusion(&run.calibration),
        answer: answer.word,
        answer_sentence: answer.sentence,
        warnings: run.overall_warnings(),
    };
    let json = serde_json::to_string_pretty(&summary);
    json.expect("strings, numbers and lists under literal names always serialise") + "\n"
}

fn summary_of<'a>(
    run: &'a Run,
    recording: &'a RecordingRun,
    errors: &RecordingErrors,
    own: &[usize],
) -> RecordingSummary<'a> {
    let estimates = &run.calibration.fit.estimates;
    let result = recording.earlier.as_ref().map(|earlier| earlier.path.to_string_lossy().into_owned());
    RecordingSummary {
        name: &recording.name,
        result: result.unwrap_or_default(),
        files: recording.files(),
        dwells: recording.found(),
        rejected: recording.rejected(),
        nominal_mm: error_summary(&errors.nominal),
        fitted_mm: error_summary(&errors.calibrated),
        unseen_mm: errors.unseen.as_ref().map(error_summary),
        parameters: own.iter().map(|&index| parameter(&estimates[index])).collect(),
        covariance: covariance(run, own),
    }
}

/// Of those that are free.
fn covariance<'a>(run: &'a Run, index: &[usize]) -> CovarianceSummary<'a> {
    let fit = &run.calibration.fit;
    let free: Vec<usize> = index.iter().copied().filter(|&i| fit.estimates[i].parameter.free).collect();
    let block = fit.covariance.block(&free);
    CovarianceSummary {
        names: free.iter().map(|&i| fit.estimates[i].parameter.name.as_str()).collect(),
        rows: block.row_iter().map(|row| row.iter().copied().collect()).collect(),
    }
}
