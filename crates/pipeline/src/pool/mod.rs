//! `armcal pool`: one calibration of the results of many runs, without their recordings.
//!
//! results -> [`collect`] -> one model with what each recording has for itself -> calibration -> diagnosis -> [`Run`].

mod collect;
mod error;

pub use error::PoolError;

use crate::converged::run_of;
use crate::diagnosed::diagnose_again;
use crate::refits::add_refits;
use armcal_calibrate::{FitConfig, HoldoutConfig, align_frames, calibrate};
use armcal_config::{BoardPose, FramePose, Pipeline};
use armcal_core::Pose;
use armcal_model::{Chain, Frame, Frames, Knowledge, Model, RecordingStart};
use armcal_result::{Run, Undiagnosed};
use armcal_stages::joined_tips::place_bases;
use armcal_stages::{Steps, declare_parameters, frames, with_effects};
use collect::{Collected, CollectedRecording, collect_results};
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
pub fn calibrate_jointly(
    pipeline: &Pipeline,
    folders: &[PathBuf],
    progress: &dyn Steps,
) -> Result<Pooled, PoolError> {
    progress.step("reading results");
    let (model_texts, chain) = frames::nominal_chain(pipeline)?;
    let board = frames::read_board(pipeline)?;
    let collected = collect_results(pipeline, &model_texts.concat(), board.as_ref(), folders)?;
    let geometry = nominal_geometry(pipeline, chain, &collected)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    let observations = collected.observations;
    let model = with_effects(pipeline, &geometry, &effects, &observations)?;

    // Shorter ways end as near, but not at the bits that pools have ended at so far.
    let config = FitConfig { every_step: true, ..pipeline.fit.clone() };
    progress.step(&format!("calibrating {} recordings", collected.recordings.len()));
    let calibration = calibrate(&model, &observations, &config, &pipeline.holdout)?;
    let turns = pipeline.pool.turns.min(collected.recordings.len());
    let transfer = if turns > 1 {
        progress.step(&format!("holding recordings out in {turns} turns"));
        let holdout = HoldoutConfig::RecordingFolds { k: turns };
        Some(calibrate(&model, &observations, &config, &holdout)?)
    } else {
        None
    };
    let session = frames::session(pipeline, &observations);
    let mut run = Run {
        recordings: collected.recordings.into_iter().map(|r| r.run).collect(),
        board,
        transfer,
        warnings: collected.warnings,
        ..run_of(pipeline, model_texts, model, (observations, session), calibration)
    };
    let free = run.model.parameters().iter().filter(|p| p.free).count();
    if free > DIAGNOSED_PARAMETERS && pipeline.diagnosis.enabled {
        run.undiagnosed = Some(Undiagnosed::TooLarge { free, most: DIAGNOSED_PARAMETERS });
    } else {
        diagnose_again(&mut run, pipeline, progress);
        add_refits(&mut run, pipeline, progress)?;
    }
    Ok(Pooled { run, geometry })
}

/// The nominal arm among the frames of all recordings, as one run of them together would have it.
fn nominal_geometry(pipeline: &Pipeline, chain: Chain, collected: &Collected) -> Result<Model, PoolError> {
    let own =
        |r: &CollectedRecording, base_in_world| RecordingStart { name: r.run.name.clone(), base_in_world };
    let recordings = &collected.recordings;
    if pipeline.closed_chain.is_some() {
        let mut model = frames::nominal_model(pipeline, &chain, None, &[])?;
        let aligned = align_frames(&model, &collected.observations, &pipeline.fit)?;
        place_bases(&mut model, &aligned);
        let own = recordings.iter().map(|r| own(r, None)).collect();
        model.ask_own(own, pipeline.pool.per_recording.clone());
        return Ok(model);
    }
    let measured = pipeline.frames.base.pose == FramePose::Measured;
    let bases: Vec<Pose> = recordings.iter().filter(|_| measured).map(|r| r.base).collect();
    let base = frames::base_frame(&pipeline.frames.base, &bases);
    let knowledge = pipeline.table.as_ref().map_or(Knowledge::Given, |table| match table.pose {
        BoardPose::Estimated => Knowledge::Estimated,
        BoardPose::Measured | BoardPose::Given => {
            armcal_config::pose_knowledge(table.sigma_mm, table.sigma_deg)
        }
    });
    let board = |r: &CollectedRecording| {
        let name = format!("board.{}", r.run.name);
        r.board.map(|pose| Frame { name, pose, knowledge, free_rotation: true })
    };
    let tip = pipeline.frames.tip.frame("tip", pipeline.fit.use_orientation);
    let boards = recordings.iter().filter_map(board).collect();
    let mut model = Model::new(chain, Frames { base, tip, markers: Vec::new(), boards })?;
    declare_parameters(&mut model, pipeline)?;
    // Each recording knows its own board alone, so that work grows with their number and no faster.
    let own = recordings.iter().map(|r| own(r, measured.then_some(r.base))).collect();
    model.ask_own(own, pipeline.pool.per_recording.clone());
    Ok(model)
}
