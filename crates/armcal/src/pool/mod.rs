//! `armcal pool`: one calibration of the results of many runs, without their recordings.
//!
//! results -> [`collect`] -> one model with what each recording has for itself -> calibration -> [`PooledRun`].

mod collect;
mod section;

pub use collect::{Collected, CollectedRecording, collect};
pub use section::PoolSection;

use crate::error::Error;
use crate::pipeline::{BoardPose, FramePose, Pipeline};
use crate::progress::Progress;
use crate::stages::frames;
use armcal_calibrate::{HoldoutConfig, calibrate};
use armcal_core::{Observation, Pose};
use armcal_model::{Chain, Frame, Frames, Knowledge, Model, RecordingStart, Session};
use armcal_report::PooledRun;
use std::path::PathBuf;

/// Pools the results found in `folders` as the pipeline says; nothing is written.
///
/// # Errors
/// Results that are missing, or of another arm, board or setting than the pipeline's, each by name; and what can
/// go wrong in a fit.
pub fn run(pipeline: &Pipeline, folders: &[PathBuf], progress: &Progress) -> Result<PooledRun, Error> {
    progress.step("reading results");
    pipeline.one_arm("`armcal pool` pools the recordings of one arm")?;
    let (model_texts, chain) = frames::nominal_chain(pipeline)?;
    let model_text = model_texts.concat();
    let board = frames::board(pipeline)?;
    let collected = collect(pipeline, &model_text, board.as_ref(), folders)?;
    let session = frames::session(pipeline, &collected.observations);
    let model = pooled_model(pipeline, chain, &collected, &session)?;

    progress.step(&format!("calibrating {} recordings", collected.recordings.len()));
    let observations: &[Observation] = &collected.observations;
    let calibration = calibrate(&model, observations, &pipeline.fit, &pipeline.holdout)?;
    let turns = pipeline.pool.turns.min(collected.recordings.len());
    let transfer = if turns > 1 {
        progress.step(&format!("holding recordings out in {turns} turns"));
        let holdout = HoldoutConfig::RecordingFolds { k: turns };
        Some(calibrate(&model, observations, &pipeline.fit, &holdout)?)
    } else {
        None
    };
    Ok(PooledRun {
        pipeline_name: pipeline.name.clone(),
        pipeline_text: pipeline.text.clone(),
        model_text,
        recordings: collected.recordings.into_iter().map(|r| r.run).collect(),
        model,
        observations: collected.observations,
        session,
        calibration,
        transfer,
        warnings: collected.warnings,
    })
}

/// The nominal arm among the frames of all recordings, as one run of them together would have it.
fn pooled_model(
    pipeline: &Pipeline,
    chain: Chain,
    collected: &Collected,
    session: &Session,
) -> Result<Model, Error> {
    let mut base = frames::frame("base", &pipeline.frames.base, true);
    let measured = pipeline.frames.base.pose == FramePose::Measured;
    let bases: Vec<Pose> = collected.recordings.iter().filter(|_| measured).map(|r| r.base).collect();
    base.pose = frames::mean_of(&bases).unwrap_or(base.pose);
    let knowledge = pipeline.table.as_ref().map_or(Knowledge::Given, |table| match table.pose {
        BoardPose::Estimated => Knowledge::Estimated,
        BoardPose::Measured | BoardPose::Given => frames::measured(table.sigma_mm, table.sigma_deg),
    });
    let board = |r: &CollectedRecording| {
        let name = format!("board.{}", r.run.name);
        r.board.map(|pose| Frame { name, pose, knowledge, free_rotation: true })
    };
    let tip = frames::frame("tip", &pipeline.frames.tip, pipeline.fit.use_orientation);
    let boards = collected.recordings.iter().filter_map(board).collect();
    let mut model = Model::new(chain, Frames { base, tip, markers: Vec::new(), boards })?;
    frames::declare(&mut model, pipeline)?;
    model.check_declared(session)?;
    let effects = frames::effect_specs(pipeline, &model)?;
    let model = model.with_effects(&effects, session)?;
    let recording = |r: &CollectedRecording| RecordingStart {
        name: r.run.name.clone(),
        base_in_world: measured.then_some(r.base),
    };
    let recordings: Vec<RecordingStart> = collected.recordings.iter().map(recording).collect();
    Ok(model.with_own(&recordings, &pipeline.pool.per_recording)?)
}
