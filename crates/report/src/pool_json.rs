//! `pool.json`: what programs need to know of a calibration of earlier results.
//!
//! The names are a contract (`armcal.pool/1`): fields are added, never renamed. Every number is finite or `null`.

use armcal_calibrate::Calibration;
use armcal_result::summary::{CovarianceSummary, ErrorsSummary, FitSummary, ParameterSummary, SideSummary};
use armcal_result::{RecordingErrors, RecordingRun, Run, VERSION};
use armcal_wording::{answer, conclusion};
use serde_json::{Value, json};

/// Version of the contract.
pub const POOL_SCHEMA: &str = "armcal.pool/1";
/// Its name in the folder of results.
pub(crate) const FILE: &str = "pool.json";

/// Of a run of earlier results: indented JSON with a final newline.
pub fn pool_json(run: &Run) -> String {
    let own: Vec<Vec<usize>> = (0..run.recordings.len()).map(|at| run.model.own_parameters(at)).collect();
    let estimates = &run.calibration.fit.estimates;
    let parameters = |index: &[usize]| -> Vec<ParameterSummary<'_>> {
        index.iter().map(|&index| (&estimates[index]).into()).collect()
    };
    let shared = run.shared_parameters();
    let of_fit = FitSummary { parameters: parameters(&shared), ..FitSummary::of(run) };
    let answer = answer(run);
    let recordings = run.recordings.iter().zip(run.errors_by_recording()).zip(&own);
    let transfer = |c: &Calibration| json!({ "noise_floor_mm": c.noise_floor_m * 1e3, "unseen": SideSummary::from(&c.holdout) });
    let summary = json!({
        "schema": POOL_SCHEMA,
        "version": VERSION,
        "pipeline": run.pipeline_name,
        "status": run.status(),
        "recordings": recordings
            .map(|((recording, errors), own)| summary_of(run, recording, &errors, own))
            .collect::<Value>(),
        // With the hold-out of the pipeline; its parameters are the shared ones.
        "fit": of_fit,
        // Whole recordings held out in turn; `null` with one recording.
        "transfer": run.transfer.as_ref().map(transfer),
        "conclusion": conclusion(&run.calibration),
        // As in `summary.json`, which has all of the diagnosis.
        "answer": answer.word,
        "answer_sentence": answer.sentence,
        "warnings": run.overall_warnings(),
    });
    format!("{summary:#}\n")
}

fn summary_of(run: &Run, recording: &RecordingRun, errors: &RecordingErrors, own: &[usize]) -> Value {
    let estimates = &run.calibration.fit.estimates;
    let result = recording.earlier.as_ref().map(|earlier| earlier.path.to_string_lossy());
    json!({
        "name": recording.name,
        "result": result.unwrap_or_default(),
        "files": recording.files(),
        "dwells": recording.found(),
        "rejected": recording.rejected(),
        "nominal_mm": ErrorsSummary::from(&errors.nominal),
        "fitted_mm": ErrorsSummary::from(&errors.calibrated),
        // By calibrations that never saw this recording.
        "unseen_mm": errors.unseen.as_ref().map(ErrorsSummary::from),
        // What this recording has for itself.
        "parameters": own.iter().map(|&index| ParameterSummary::from(&estimates[index])).collect::<Vec<_>>(),
        "covariance": CovarianceSummary::of(&run.calibration.fit, own),
    })
}
