//! The main job, top down: recordings -> samples -> dwells -> places -> observations -> fit -> run.

use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::progress::Progress;
use crate::stages::{frames, observe, perceive};
use armcal_calibrate::{Calibration, calibrate};
use armcal_core::{Severity, Stage, Warning};
use armcal_recording::Recording;
use armcal_report::Run;

/// Association and fit depend on each other; more rounds than this mean they do not settle.
const MAX_ROUNDS: usize = 4;

/// Runs a pipeline up to its results in memory; nothing is written.
///
/// Returns the run and the opened recordings, which the writers pass through to the output.
pub fn run(pipeline: &Pipeline, progress: &Progress) -> Result<(Run, Vec<Recording>), Error> {
    let (model_text, chain) = frames::nominal_chain(pipeline)?;
    let board = frames::board(pipeline)?;
    let recordings = perceive::open_all(pipeline, progress)?;
    let seen = perceive::dwells_of_all(pipeline, &chain, &recordings, progress)?;

    let mut model = frames::nominal_model(pipeline, &chain, board.as_ref(), &seen)?;
    let mut places = observe::associate_all(pipeline, board.as_ref(), &model, None, &seen)?;
    let mut rounds = 0;
    let (observed, calibration) = loop {
        rounds += 1;
        progress.step(&format!("calibrating (round {rounds})"));
        frames::start_frames(pipeline, &mut model, &places);
        let observed = observe::observations(pipeline, board.as_ref(), &seen, &places)?;
        let calibration = calibrate(&model, &observed.observations, &pipeline.fit, &pipeline.holdout)?;
        let again =
            observe::associate_all(pipeline, board.as_ref(), &model, Some(&calibration.fit.values()), &seen)?;
        if observe::same_places(&again, &places) || rounds == MAX_ROUNDS {
            break (observed, calibration);
        }
        places = again;
    };

    let warnings = closing_warnings(rounds, &calibration);
    let recording_runs = perceive::recording_runs(pipeline, seen, places, &observed.rejections);
    Ok((
        Run {
            pipeline_name: pipeline.name.clone(),
            pipeline_text: pipeline.text.clone(),
            model_text,
            recordings: recording_runs,
            board,
            model,
            observations: observed.observations,
            calibration,
            warnings,
        },
        recordings,
    ))
}

fn closing_warnings(rounds: usize, calibration: &Calibration) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if rounds == MAX_ROUNDS {
        warnings.push(Warning::new(
            Severity::Inadequate,
            Stage::Table,
            "association-unsettled",
            "association",
            format!(
                "after {MAX_ROUNDS} rounds of fitting and associating, dwells still change cavities; \
                 give a visiting order or check the board file"
            ),
        ));
    }
    let fitted_mm = calibration.holdout.fitted.mean_m * 1e3;
    let nominal_mm = calibration.holdout.nominal.mean_m * 1e3;
    if calibration.holdout.fitted.n > 0 && fitted_mm > nominal_mm {
        warnings.push(Warning::new(
            Severity::Inadequate,
            Stage::Calibrate,
            "holdout-worse",
            "hold-out",
            format!(
                "on held-out points the fit is worse than nominal ({fitted_mm:.3} against {nominal_mm:.3} mm): \
                 it does not generalise; free fewer parameters or record more varied dwells"
            ),
        ));
    }
    warnings
}
