//! `armcal pool`: one calibration of the results of many runs, without their recordings.
//!
//! results -> [`collect`] -> one model with what each recording has for itself -> calibration -> diagnosis -> [`Run`]. Where
//! the results are those of a cluster, shares of them answer what the calibration asks: [`map`], [`reduce`].

mod collect;
mod rounds;
mod shards;

pub use collect::{Collected, CollectedRecording, Start, collect};
pub use shards::{Mapped, Reduced, map, reduce};

/// Whether `out` is that of a pool in shards.
pub fn is_in_shards(out: &std::path::Path) -> bool {
    rounds::Rounds::are_in(out)
}

use crate::error::Error;
use crate::progress::Progress;
use armcal_calibrate::{CalibrateError, Calibration, FitConfig, HoldoutConfig, align_frames, calibrate};
use armcal_config::{BoardPose, FramePose, Pipeline};
use armcal_core::{Observation, Pose};
use armcal_model::{Chain, Frame, Frames, Knowledge, Model, RecordingStart};
use armcal_pipeline as story;
use armcal_report::{Run, Undiagnosed};
use armcal_stages::frames;
use armcal_stages::joined_tips::place_bases;
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
    let (model_texts, _) = frames::nominal_chain(pipeline)?;
    let board = frames::board(pipeline)?;
    let collected = collect(pipeline, &model_texts.concat(), board.as_ref(), folders)?;
    let fit = |model: &Model, observations: &[Observation], holdout: &HoldoutConfig| {
        // Shards end at the same bits.
        let config = FitConfig { every_step: true, ..pipeline.fit.clone() };
        calibrate(model, observations, &config, holdout)
    };
    let (mut run, geometry) = joint_run(pipeline, collected, &fit, progress)?;
    let free = run.model.parameters().iter().filter(|p| p.free).count();
    if free > DIAGNOSED_PARAMETERS && pipeline.diagnosis.enabled {
        run.undiagnosed = Some(Undiagnosed::TooLarge { free, most: DIAGNOSED_PARAMETERS });
    } else {
        story::diagnose_again(&mut run, pipeline, progress);
        armcal_pipeline::add_refits(&mut run, pipeline, progress)?;
    }
    Ok(Pooled { run, geometry })
}

/// How a model is calibrated to observations, here or elsewhere.
type Calibrate<'a> =
    dyn Fn(&Model, &[Observation], &HoldoutConfig) -> Result<Calibration, CalibrateError> + 'a;

/// The joint calibration, with the hold-out of the pipeline and with recordings held out in turn, and the nominal arm.
fn joint_run(
    pipeline: &Pipeline,
    collected: Collected,
    calibrate: &Calibrate<'_>,
    progress: &Progress,
) -> Result<(Run, Model), Error> {
    let (model_texts, chain) = frames::nominal_chain(pipeline)?;
    let geometry = geometry(pipeline, chain, &collected)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    let observations = collected.observations;
    let model = armcal_stages::with_effects(pipeline, &geometry, &effects, &observations)?;

    progress.step(&format!("calibrating {} recordings", collected.recordings.len()));
    let calibration = calibrate(&model, &observations, &pipeline.holdout);
    let turns = pipeline.pool.turns.min(collected.recordings.len());
    // Where observations are elsewhere, both are asked for in one round.
    let goes_on = matches!(calibration, Ok(_) | Err(CalibrateError::Unanswered));
    let transfer = if turns > 1 && goes_on {
        progress.step(&format!("holding recordings out in {turns} turns"));
        Some(calibrate(&model, &observations, &HoldoutConfig::RecordingFolds { k: turns }))
    } else {
        None
    };
    let (calibration, transfer) = (calibration?, transfer.transpose()?);
    let session = frames::session(pipeline, &observations);
    let run = Run {
        recordings: collected.recordings.into_iter().map(|r| r.run).collect(),
        board: frames::board(pipeline)?,
        transfer,
        warnings: collected.warnings,
        ..story::run_of(pipeline, model_texts, model, (observations, session), calibration)
    };
    Ok((run, geometry))
}

/// The nominal arm among the frames of all recordings, as one run of them together would have it.
fn geometry(pipeline: &Pipeline, chain: Chain, collected: &Collected) -> Result<Model, Error> {
    let starts: Vec<Start> = collected.recordings.iter().map(CollectedRecording::start).collect();
    if pipeline.closed_chain.is_none() {
        return geometry_of(pipeline, chain, &starts.iter().collect::<Vec<_>>());
    }
    let mut model = frames::nominal_model(pipeline, &chain, None, &[])?;
    let aligned = align_frames(&model, &collected.observations, &pipeline.fit)?;
    place_bases(&mut model, &aligned);
    let own = |start: Start| RecordingStart { name: start.name, base_in_world: None };
    model.ask_own(starts.into_iter().map(own).collect(), pipeline.pool.per_recording.clone());
    Ok(model)
}

/// The same of one arm, from where the frames of each recording started.
fn geometry_of(pipeline: &Pipeline, chain: Chain, starts: &[&Start]) -> Result<Model, Error> {
    let measured = pipeline.frames.base.pose == FramePose::Measured;
    let bases: Vec<Pose> = starts.iter().filter(|_| measured).map(|start| start.base).collect();
    let base = frames::base_frame(&pipeline.frames.base, &bases);
    let knowledge = pipeline.table.as_ref().map_or(Knowledge::Given, |table| match table.pose {
        BoardPose::Estimated => Knowledge::Estimated,
        BoardPose::Measured | BoardPose::Given => armcal_config::measured(table.sigma_mm, table.sigma_deg),
    });
    let board = |start: &&Start| {
        let name = format!("board.{}", start.name);
        start.board.map(|pose| Frame { name, pose, knowledge, free_rotation: true })
    };
    let tip = pipeline.frames.tip.frame("tip", pipeline.fit.use_orientation);
    let boards = starts.iter().filter_map(board).collect();
    let mut model = Model::new(chain, Frames { base, tip, markers: Vec::new(), boards })?;
    armcal_stages::declare(&mut model, pipeline)?;
    let own = |start: &&Start| {
        let base_in_world = measured.then_some(start.base);
        RecordingStart { name: start.name.clone(), base_in_world }
    };
    // Each recording knows its own board alone, so that work grows with their number and no faster.
    model.ask_own(starts.iter().map(own).collect(), pipeline.pool.per_recording.clone());
    Ok(model)
}
