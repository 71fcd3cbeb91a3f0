//! `armcal verify`: what a calibrated model is worth on recordings that its calibration never saw.
//!
//! `StoredModel -> placed among the new recordings' frames -> points (dwells) + motion (everything between) -> Verification`

mod iso;
mod motion;
mod once;
mod point;
mod told;

use crate::error::HeldOutError;
use crate::stored::place_model;
use armcal_config::{BoardPose, Pipeline};
use armcal_core::{Code, Observation, Severity, Warning};
use armcal_model::Chain;
use armcal_result::{Closing, StoredModel, open_model};
use armcal_result::{PathSample, Verification, VerifiedRecording};
use armcal_stages::associated::Associated;
use armcal_stages::measures::Measures;
use armcal_stages::{Placed, RecordingData, RunError, Steps, frames, observe, preprocess};
use armcal_table::{Association, Board};
use armcal_verify::{ClockError, PathRow};
use motion::{Judge, Motion};
use once::Distinct;
use std::collections::BTreeMap;
use std::path::Path;

/// Warnings about a clock that the nominal arm judged.
const OF_NOMINAL_CLOCK: [Code; 4] =
    [Code::ClockNotLinear, Code::ClockUncertain, Code::ClockDriftUnknown, Code::ClockDriftLimited];

/// Verifies the result of an earlier run on the recordings of a pipeline.
pub fn verify(
    result: &Path,
    pipeline: &Pipeline,
    progress: &dyn Steps,
) -> Result<Verification, HeldOutError> {
    let past = open_model(result)?;
    let (_, chain) = frames::nominal_chain(pipeline)?;
    let board = frames::read_board(pipeline)?;
    let recordings = preprocess::open_all(pipeline, progress)?;
    let mut samples = Vec::new();
    let seen = preprocess::dwells_of_all(pipeline, &chain, &recordings, progress, &mut |s| samples.push(s))?;
    progress.step("comparing");
    let Distinct { pipeline, seen, samples, warnings: once } =
        once::distinct_recordings(pipeline, seen, samples);
    let pipeline = &pipeline;
    let surroundings =
        Surroundings { result, past: &past, pipeline, chain: &chain, board: board.as_ref(), seen: &seen };
    let (placed, observations, mut warnings) = surroundings.settle()?;
    let names: Vec<String> = seen.iter().map(|s| s.name.clone()).collect();
    let joints = placed.model.chain().joint_names().to_vec();
    let points = point::errors(&placed, &observations);
    let judge = Judge::new(pipeline, &placed);
    let motions = seen.iter().zip(&samples).enumerate();
    let motions = motions.map(|(r, (seen, samples))| judge.follow(r, seen, samples));
    let motions = motions.collect::<Result<Vec<Motion>, HeldOutError>>()?;
    let shown = iso::Shown {
        placed: &placed,
        base: placed.base(),
        seen: &seen,
        samples: &samples,
        motions: &motions,
    };
    let iso9283 = shown.assess()?;
    let recordings = seen.iter().zip(&motions).map(|(s, m)| verified_recording(s, m)).collect();
    let told = told::recordings_in_calibration(&past, &seen);
    warnings.extend(told.iter().map(told::not_held_out));
    warnings.extend(once);
    warnings.extend(told::beyond_calibrated(placed.model.chain(), &past.visited, &observations, &samples));
    warnings.extend(told::effort_unknown(&placed.model, &observations));
    warnings.extend(seen.iter().flat_map(of_recording));
    warnings.extend(placed.warnings.iter().cloned());
    Ok(Verification {
        pipeline: pipeline.name.clone(),
        result: result.to_owned(),
        effects: placed.model.effects().iter().map(|e| e.spec.to_string()).collect(),
        recordings,
        told,
        recognises_copies: past.recordings.iter().all(|r| r.dwells.is_some()),
        closing: Closing::of(&observations),
        points: armcal_verify::compare_points(&points, &names, &joints),
        samples: motions.iter().flat_map(|m| &m.errors).map(|e| PathSample::of(e, &names)).collect(),
        paths: path_rows(motions, &names),
        iso9283,
        parameters: past.parameters,
        published: pipeline.verify.published.clone(),
        warnings,
    })
}

fn verified_recording(seen: &RecordingData, motion: &Motion) -> VerifiedRecording {
    VerifiedRecording {
        name: seen.name.clone(),
        dwells: seen.dwells.len(),
        moving_samples: motion.errors.len(),
        clock_offset_s: motion.clock.as_ref().map(|c| c.offset_s),
        clock_reference_ns: motion.clock.as_ref().map(|c| c.reference_ns),
        clock_sigma_s: motion.clock.as_ref().map(|c| c.offset_sigma_s),
    }
}

/// Rows of the path table.
fn path_rows(motions: Vec<Motion>, names: &[String]) -> Vec<PathRow> {
    let clocks: Vec<Option<ClockError>> = motions.iter().map(|m| m.clock_error).collect();
    let (mut errors, mut planned) = (Vec::new(), BTreeMap::new());
    for motion in motions {
        errors.extend(motion.errors);
        planned.extend(motion.planned);
    }
    armcal_verify::compare_paths(&errors, names, &clocks, &planned)
}

/// Warnings of a recording, with its name.
fn of_recording(seen: &RecordingData) -> Vec<Warning> {
    let named = |w: &Warning| {
        let subject = format!("{}: {}", seen.name, w.subject);
        // Dwell detection knows the nominal arm only, whose errors look like those of a clock.
        if !OF_NOMINAL_CLOCK.contains(&w.code) {
            return Warning { subject, ..w.clone() };
        }
        let message = format!(
            "{} (as the nominal arm sees it; paths are compared by the clock that the calibrated arm finds)",
            w.message
        );
        Warning { severity: Severity::Notice, subject, message, ..w.clone() }
    };
    seen.warnings.iter().chain(&seen.report.warnings).map(named).collect()
}

/// The new recordings, and what is put among them.
struct Surroundings<'a> {
    result: &'a Path,
    past: &'a StoredModel,
    pipeline: &'a Pipeline,
    chain: &'a Chain,
    board: Option<&'a Board>,
    seen: &'a [RecordingData],
}

impl Surroundings<'_> {
    /// The calibrated model in its place, and the dwells in theirs.
    fn settle(&self) -> Result<(Placed, Vec<Observation>, Vec<Warning>), HeldOutError> {
        let mut model = frames::nominal_model(self.pipeline, self.chain, self.board, self.seen)?;
        let mut placed = place_model(self.past, self.result, self.pipeline, &model)?;
        let measures = Measures::of(self.pipeline, self.seen);
        if !measures.is_empty() {
            if self.pipeline.table.is_some() {
                let problem = "stands beside a [table]: verify the dwells of the table and those of the measurements apart";
                return Err(RunError::Measure { name: "all".to_owned(), problem: problem.to_owned() }.into());
            }
            let none = self.seen.iter().map(|_| None).collect::<Vec<_>>();
            let sure = observe::build_observations(self.pipeline, None, self.seen, &none).observations;
            let (observations, said) = measures.judged(&mut placed, &sure)?;
            return Ok((placed, observations, said));
        }
        let mut places = self.associate(&placed, false)?;
        if self.pipeline.table.as_ref().is_some_and(|t| t.pose == BoardPose::Estimated) {
            frames::start_frames(self.pipeline, &mut model, &places);
            placed = place_model(self.past, self.result, self.pipeline, &model)?;
        }
        let mut observations = self.observations(&places)?;
        let fitted = placed.fit_frames(self.pipeline, &observations)?;
        if fitted.iter().any(|w| w.code == Code::FrameFittedOnVerification) {
            places = self.associate(&placed, true)?;
            observations = self.observations(&places)?;
            placed.fit_frames(self.pipeline, &observations)?;
        }
        Ok((placed, observations, fitted))
    }

    fn associate(
        &self,
        placed: &Placed,
        boards_fitted: bool,
    ) -> Result<Vec<Option<Association>>, HeldOutError> {
        let p = &placed.calibrated;
        let seen = (self.seen, &Associated::default());
        Ok(observe::associate_all(self.pipeline, self.board, &placed.model, p, boards_fitted, seen)?)
    }

    fn observations(&self, places: &[Option<Association>]) -> Result<Vec<Observation>, HeldOutError> {
        Ok(observe::build_observations(self.pipeline, self.board, self.seen, places)
            .not_empty()?
            .observations)
    }
}
