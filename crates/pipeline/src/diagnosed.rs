//! What is missing in the model of a run, looked for where the pipeline wants to know: whatever comes of it, the calibration stands.

use armcal_config::Pipeline;
use armcal_core::{Code, Severity, Stage, Warning};
use armcal_diagnose::{Calibrated, Diagnosis, Nested, diagnose, nested_validation};
use armcal_result::{Run, Undiagnosed};
use armcal_stages::{RunError, Steps};

/// Looks for the effect that the model of a run is missing, if the pipeline wants to know.
pub(crate) fn diagnose_again(run: &mut Run, pipeline: &Pipeline, progress: &dyn Steps) {
    let found = run_diagnosis(pipeline, &diagnosis_input(run, pipeline), progress);
    set_diagnosis(run, found);
}

/// What a diagnosis asks of a run.
pub(crate) fn diagnosis_input<'a>(run: &'a Run, pipeline: &'a Pipeline) -> Calibrated<'a> {
    let Run { model, calibration, observations, session, .. } = run;
    let (fit, holdout) = (&pipeline.fit, &pipeline.holdout);
    Calibrated { model, calibration, observations, session, fit, holdout }
}

pub(crate) fn run_diagnosis(
    pipeline: &Pipeline,
    calibrated: &Calibrated<'_>,
    progress: &dyn Steps,
) -> Result<Option<Diagnosis>, RunError> {
    if !pipeline.diagnosis.enabled {
        return Ok(None);
    }
    if let Some(few) = calibrated.calibration.fit.too_few_dwells() {
        return Err(RunError::TooFewDwells { why: few.message.clone() });
    }
    progress.step("diagnosing");
    Ok(Some(diagnose(calibrated, &pipeline.diagnosis)?))
}

/// What came of a diagnosis, or why there is none.
pub(crate) fn set_diagnosis(run: &mut Run, found: Result<Option<Diagnosis>, RunError>) {
    (run.diagnosis, run.undiagnosed) = match found {
        Ok(Some(diagnosis)) => (Some(diagnosis), None),
        Ok(None) => (None, Some(Undiagnosed::NotAsked)),
        Err(RunError::SetupFirst { .. }) => (None, Some(Undiagnosed::SetupFirst)),
        Err(RunError::TooFewDwells { .. }) => (None, Some(Undiagnosed::TooFewDwells)),
        Err(e) => {
            let message = format!("what is missing could not be looked for: {e}; the calibration stands");
            let (severity, stage) = (Severity::Inadequate, Stage::Diagnose);
            run.warnings.push(Warning::new(severity, stage, Code::DiagnosisFailed, "diagnosis", message));
            (None, Some(Undiagnosed::Failed))
        }
    };
}

/// The choice of what was found, made again without each part of the hold-out; as it was made, where it was.
pub fn chosen_again(
    pipeline: &Pipeline,
    calibrated: &Calibrated<'_>,
    found: &Diagnosis,
    progress: &dyn Steps,
) -> Result<Option<Nested>, RunError> {
    if found.nested.is_some() {
        return Ok(found.nested.clone());
    }
    progress.step("choosing again without each part of the hold-out");
    Ok(nested_validation(calibrated, found, &pipeline.diagnosis)?)
}
