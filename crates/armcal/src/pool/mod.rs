//! `armcal pool`: one calibration of the results of many runs, without their recordings.
//!
//! results -> [`collect`] -> one model with what each recording has for itself -> calibration -> diagnosis -> [`Run`].

mod collect;
mod section;

pub use collect::{Collected, CollectedRecording, collect};
pub use section::PoolSection;

use crate::error::Error;
use crate::pipeline::{BoardPose, FramePose, Pipeline};
use crate::progress::Progress;
use crate::stages::frames;
use crate::story;
use crate::two_arms::check::place_bases;
use armcal_calibrate::{HoldoutConfig, align_frames, calibrate};
use armcal_core::Pose;
use armcal_model::{Chain, Frame, Frames, Knowledge, Model, RecordingStart};
use armcal_report::{Run, Undiagnosed};
use std::path::PathBuf;

/// Free parameters up to which what is missing is looked for: the search works on all of them at once.
const DIAGNOSED_PARAMETERS: usize = 300;

/// A pool, and the nominal arm in it, without effects.
pub struct Pooled {
    /// The run of all results.
    pub run: Run,
    /// What effects are put on.
    pub geometry: Model,
}

/// Pools the results found in `folders` as the pipeline says; nothing is written.
///
/// # Errors
/// Results that are missing, or of another arm, board or setting than the pipeline's, each by name; and what can
/// go wrong in a fit.
pub fn run(pipeline: &Pipeline, folders: &[PathBuf], progress: &Progress) -> Result<Pooled, Error> {
    progress.step("reading results");
    let (model_texts, chain) = frames::nominal_chain(pipeline)?;

    let board = frames::board(pipeline)?;
    let collected = collect(pipeline, &model_texts.concat(), board.as_ref(), folders)?;
    let geometry = geometry(pipeline, chain, &collected)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    let observations = collected.observations;
    let model = story::with_effects(pipeline, &geometry, &effects, &observations)?;

    progress.step(&format!("calibrating {} recordings", collected.recordings.len()));
    let calibration = calibrate(&model, &observations, &pipeline.fit, &pipeline.holdout)?;
    let turns = pipeline.pool.turns.min(collected.recordings.len());
    let transfer = if turns > 1 {
        progress.step(&format!("holding recordings out in {turns} turns"));
        let holdout = HoldoutConfig::RecordingFolds { k: turns };
        Some(calibrate(&model, &observations, &pipeline.fit, &holdout)?)
    } else {
        None
    };
    let session = frames::session(pipeline, &observations);
    let mut run = Run {
        recordings: collected.recordings.into_iter().map(|r| r.run).collect(),
        board,
        transfer,
        warnings: collected.warnings,
        ..story::run_of(pipeline, model_texts, model, (observations, session), calibration)
    };
    let free = run.model.parameters().iter().filter(|p| p.free).count();
    if free > DIAGNOSED_PARAMETERS && pipeline.diagnosis.enabled {
        run.undiagnosed = Some(Undiagnosed::TooLarge { free, most: DIAGNOSED_PARAMETERS });
    } else {
        story::diagnose_again(&mut run, pipeline, progress);
        crate::refits::add_refits(&mut run, pipeline, progress)?;
    }
    Ok(Pooled { run, geometry })
}

/// The nominal arm among the frames of all recordings, as one run of them together would have it.
fn geometry(pipeline: &Pipeline, chain: Chain, collected: &Collected) -> Result<Model, Error> {
    let own =
        |r: &CollectedRecording, base_in_world| RecordingStart { name: r.run.name.clone(), base_in_world };
    let per_recording = pipeline.pool.per_recording.clone();
    if pipeline.closed_chain.is_some() {
        let mut model = frames::nominal_model(pipeline, &chain, None, &[])?;
        let aligned = align_frames(&model, &collected.observations, &pipeline.fit)?;
        place_bases(&mut model, &aligned);
        model.ask_own(collected.recordings.iter().map(|r| own(r, None)).collect(), per_recording);
        return Ok(model);
    }
    let measured = pipeline.frames.base.pose == FramePose::Measured;
    let bases: Vec<Pose> = collected.recordings.iter().filter(|_| measured).map(|r| r.base).collect();
    let base = frames::base_frame(&pipeline.frames.base, &bases);
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
    let start = |r: &CollectedRecording| own(r, measured.then_some(r.base));
    // Each recording knows its own board alone, so that work grows with their number and no faster.
    model.ask_own(collected.recordings.iter().map(start).collect(), per_recording);
    Ok(model)
}
