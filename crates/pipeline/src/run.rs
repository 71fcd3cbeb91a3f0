//! The main job, top down: recordings -> samples -> dwells -> places -> observations -> fit -> setup -> diagnosis -> run.

use crate::converged::{holdout_worse, settle};
use crate::diagnosed::diagnose_again;
use crate::refits::add_refits;
use armcal_calibrate::calibrate;
use armcal_config::Pipeline;
use armcal_core::Code;
use armcal_model::{EffectSpec, Model};
use armcal_recording::Recording;
use armcal_result::Run;
use armcal_stages::{RunError, Steps, frames, with_effects};

/// Runs a pipeline up to its results in memory; nothing is written.
///
/// Returns the run and the opened recordings, which the writers pass through to the output.
pub fn run(pipeline: &Pipeline, progress: &dyn Steps) -> Result<(Run, Vec<Recording>), RunError> {
    let (mut run, recordings) = settle(pipeline, progress)?.diagnosed(pipeline, progress);
    add_refits(&mut run, pipeline, progress)?;
    Ok((run, recordings))
}

/// Calibrates and diagnoses a run again, on the same observations, with these effects instead of its own.
pub fn recalibrate(
    run: &mut Run,
    pipeline: &Pipeline,
    geometry: &Model,
    effects: &[EffectSpec],
    progress: &dyn Steps,
) -> Result<(), RunError> {
    run.model = with_effects(pipeline, geometry, effects, &run.observations)?;
    run.calibration = calibrate(&run.model, &run.observations, &pipeline.fit, &pipeline.holdout)?;
    run.warnings.retain(|w| ![Code::HoldoutWorse, Code::DiagnosisFailed].contains(&w.code));
    run.warnings.extend(holdout_worse(&run.calibration));
    if run.setup.mistakes().next().is_none() {
        diagnose_again(run, pipeline, progress);
    }
    run.ties = frames::effect_ties(pipeline, &run.model);
    run.pipeline_name.clone_from(&pipeline.name);
    run.pipeline_text.clone_from(&pipeline.text);
    add_refits(run, pipeline, progress)
}
