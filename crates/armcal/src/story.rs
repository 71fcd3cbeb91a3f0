//! The main job, top down: recordings -> samples -> dwells -> places -> observations -> fit -> diagnosis -> run.

use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::progress::Progress;
use crate::stages::perceive::Seen;
use crate::stages::{frames, observe, perceive};
use armcal_calibrate::{Calibration, calibrate};
use armcal_core::{Observation, Rejection, Severity, Stage, Warning};
use armcal_diagnose::{Diagnosis, diagnose};
use armcal_model::{EffectSpec, Model};
use armcal_recording::Recording;
use armcal_report::{Refit, Run};
use armcal_table::{Association, Board};
use rayon::prelude::*;

/// Association and fit depend on each other; more rounds than this mean they do not settle.
const MAX_ROUNDS: usize = 4;

/// Candidates that are refitted for the report, at most and at least.
const ALTERNATIVES: [usize; 2] = [8, 2];
/// Observations fitted for all of them together: thousands of poses make every refit slow.
const REFITTED_OBSERVATIONS: usize = 4000;

/// Runs a pipeline up to its results in memory; nothing is written.
///
/// Returns the run and the opened recordings, which the writers pass through to the output.
pub fn run(pipeline: &Pipeline, progress: &Progress) -> Result<(Run, Vec<Recording>), Error> {
    let (mut run, recordings) = diagnosed(settle(pipeline, progress)?, pipeline, progress)?;
    add_refits(&mut run, pipeline, progress)?;
    Ok((run, recordings))
}

/// What has settled, with its diagnosis. What that proposes is not fitted, which takes longer than all before: only a
/// report shows it ([`add_refits`]).
pub fn diagnosed(
    settled: Settled,
    pipeline: &Pipeline,
    progress: &Progress,
) -> Result<(Run, Vec<Recording>), Error> {
    let diagnosis = settled.diagnose(pipeline, progress)?;
    Ok(settled.into_run(pipeline, diagnosis))
}

/// Recordings whose dwells have found their places, and the calibration on them.
pub struct Settled {
    /// The opened recordings.
    pub recordings: Vec<Recording>,
    /// The calibration table, if there is one.
    pub board: Option<Board>,
    /// Text of the nominal model file.
    pub model_text: String,
    /// The nominal arm in its frames, without effects.
    pub geometry: Model,
    /// The same with the pipeline's effects: what was calibrated.
    pub model: Model,
    /// What the fit saw.
    pub observations: Vec<Observation>,
    /// The calibration.
    pub calibration: Calibration,
    /// What each recording showed by itself.
    pub seen: Vec<Seen>,
    places: Vec<Option<Association>>,
    rejections: Vec<Rejection>,
    rounds: usize,
}

/// Reads the recordings, and associates and calibrates in turn until every dwell stays in its place.
pub fn settle(pipeline: &Pipeline, progress: &Progress) -> Result<Settled, Error> {
    let (model_text, chain) = frames::nominal_chain(pipeline)?;
    let board = frames::board(pipeline)?;
    let recordings = perceive::open_all(pipeline, progress)?;
    let seen = perceive::dwells_of_all(pipeline, &chain, &recordings, progress, &mut drop)?;
    let fingerprints: Vec<_> = seen.iter().map(|s| (s.name.as_str(), &s.fingerprint)).collect();
    perceive::refuse_repeated(&fingerprints)?;

    let mut geometry = frames::nominal_model(pipeline, &chain, board.as_ref(), &seen)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    let mut places =
        observe::associate_all(pipeline, board.as_ref(), &geometry, &geometry.nominal(), false, &seen)?;
    let mut rounds = 0;
    loop {
        rounds += 1;
        progress.step(&format!("calibrating (round {rounds})"));
        frames::start_frames(pipeline, &mut geometry, &places);
        let observed = observe::observations(pipeline, board.as_ref(), &seen, &places)?;
        let (observations, rejections) = (observed.observations, observed.rejections);
        let model = with_effects(pipeline, &geometry, &effects, &observations)?;
        let calibration = calibrate(&model, &observations, &pipeline.fit, &pipeline.holdout)?;
        let values = calibration.fit.values();
        let again = observe::associate_all(pipeline, board.as_ref(), &model, &values, true, &seen)?;
        if observe::same_places(&again, &places) || rounds == MAX_ROUNDS {
            return Ok(Settled {
                recordings,
                board,
                model_text,
                geometry,
                model,
                observations,
                calibration,
                seen,
                places,
                rejections,
                rounds,
            });
        }
        places = again;
    }
}

impl Settled {
    /// Looks for the effect that the calibrated model is missing, if the pipeline wants to know.
    pub fn diagnose(&self, pipeline: &Pipeline, progress: &Progress) -> Result<Option<Diagnosis>, Error> {
        diagnosis(pipeline, &self.model, &self.calibration, &self.observations, progress)
    }

    /// Everything for the report.
    pub fn into_run(self, pipeline: &Pipeline, diagnosis: Option<Diagnosis>) -> (Run, Vec<Recording>) {
        let warnings = closing_warnings(self.rounds, &self.calibration);
        let run = Run {
            pipeline_name: pipeline.name.clone(),
            pipeline_text: pipeline.text.clone(),
            model_text: self.model_text,
            recordings: perceive::recording_runs(pipeline, self.seen, self.places, &self.rejections),
            board: self.board,
            model: self.model,
            session: frames::session(pipeline, &self.observations),
            observations: self.observations,
            calibration: self.calibration,
            diagnosis,
            steps: Vec::new(),
            alternatives: Vec::new(),
            warnings,
        };
        (run, self.recordings)
    }
}

/// Calibrates and diagnoses a run again, on the same observations, with these effects instead of its own.
pub fn recalibrate(
    run: &mut Run,
    pipeline: &Pipeline,
    geometry: &Model,
    effects: &[EffectSpec],
    progress: &Progress,
) -> Result<(), Error> {
    run.model = with_effects(pipeline, geometry, effects, &run.observations)?;
    run.calibration = calibrate(&run.model, &run.observations, &pipeline.fit, &pipeline.holdout)?;
    run.diagnosis = diagnosis(pipeline, &run.model, &run.calibration, &run.observations, progress)?;
    run.warnings.retain(|w| w.code != HOLDOUT_WORSE);
    run.warnings.extend(holdout_worse(&run.calibration));
    run.pipeline_name.clone_from(&pipeline.name);
    run.pipeline_text.clone_from(&pipeline.text);
    add_refits(run, pipeline, progress)
}

/// What the run's model would become: with what was found, and with each of the best candidates.
pub fn add_refits(run: &mut Run, pipeline: &Pipeline, progress: &Progress) -> Result<(), Error> {
    add_steps(run, pipeline, progress)?;
    progress.step("fitting the best candidates");
    run.alternatives = alternatives(run, pipeline);
    Ok(())
}

/// Adds what the diagnosis found to the model, each time fitted anew: one named effect after the other, then all that has
/// no name at once.
fn add_steps(run: &mut Run, pipeline: &Pipeline, progress: &Progress) -> Result<(), Error> {
    run.steps.clear();
    let Some(diagnosis) = &run.diagnosis else { return Ok(()) };
    let found = diagnosis.suggested(run.model.chain().joint_names())?;
    let named = diagnosis.effects.len().min(found.len());
    let mut counts: Vec<usize> = (1..=named).chain([found.len()]).collect();
    counts.dedup();
    for count in counts.into_iter().filter(|count| *count > 0) {
        progress.step(&format!("fitting what was found ({count} of {})", found.len()));
        match refit(run, pipeline, &found[..count]) {
            Ok(step) => run.steps.push(step),
            // The verdict stands without it; only the picture of this step is missing.
            Err(e) => {
                let message =
                    format!("the model with it cannot be fitted on this hold-out, so it is not shown: {e}");
                let name = found[count - 1].to_string();
                let code = "step-not-fitted";
                run.warnings.push(Warning::new(Severity::Notice, Stage::Calibrate, code, name, message));
                break;
            }
        }
    }
    Ok(())
}

/// The most probable candidates, each alone in the run's model; not those that are a step already.
///
/// One that cannot be fitted on this hold-out has no refit; the ranking says what is known about it.
fn alternatives(run: &Run, pipeline: &Pipeline) -> Vec<Refit> {
    let Some(diagnosis) = &run.diagnosis else { return Vec::new() };
    let members = |spec: &str| -> Vec<String> { spec.split('+').map(str::to_owned).collect() };
    let best = diagnosis.candidates.iter().map(|c| members(&c.spec));
    let [most, fewest] = ALTERNATIVES;
    let count = (REFITTED_OBSERVATIONS / run.observations.len().max(1)).clamp(fewest, most);
    let wanted: Vec<Vec<String>> =
        best.filter(|effects| run.steps.iter().all(|step| step.effects != *effects)).take(count).collect();
    let refit = |effects: &Vec<String>| {
        let specs = effects.iter().map(|spec| run.model.effect(spec)).collect::<Result<Vec<_>, _>>().ok()?;
        refit(run, pipeline, &specs).ok()
    };
    wanted.par_iter().filter_map(refit).collect()
}

/// The run's model with more effects, calibrated on its observations.
pub fn refit(run: &Run, pipeline: &Pipeline, effects: &[EffectSpec]) -> Result<Refit, Error> {
    let model = run.model.with_effects(effects, &run.session)?;
    let calibration = calibrate(&model, &run.observations, &pipeline.fit, &pipeline.holdout)?;
    Ok(Refit { effects: effects.iter().map(EffectSpec::to_string).collect(), model, calibration })
}

fn diagnosis(
    pipeline: &Pipeline,
    model: &Model,
    calibration: &Calibration,
    observations: &[Observation],
    progress: &Progress,
) -> Result<Option<Diagnosis>, Error> {
    if !pipeline.diagnosis.enabled {
        return Ok(None);
    }
    progress.step("diagnosing");
    let session = frames::session(pipeline, observations);
    let found = diagnose(model, calibration, observations, &session, &pipeline.fit, &pipeline.diagnosis)?;
    Ok(Some(found))
}

fn with_effects(
    pipeline: &Pipeline,
    geometry: &Model,
    effects: &[EffectSpec],
    observations: &[Observation],
) -> Result<Model, Error> {
    if effects.is_empty() {
        return Ok(geometry.clone());
    }
    Ok(geometry.with_effects(effects, &frames::session(pipeline, observations))?)
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
    warnings.extend(holdout_worse(calibration));
    warnings
}

/// Code of the warning about a fit that does not generalise.
const HOLDOUT_WORSE: &str = "holdout-worse";

fn holdout_worse(calibration: &Calibration) -> Option<Warning> {
    let fitted_mm = calibration.holdout.fitted.mean_m * 1e3;
    let nominal_mm = calibration.holdout.nominal.mean_m * 1e3;
    (calibration.holdout.fitted.n > 0 && fitted_mm > nominal_mm).then(|| {
        Warning::new(
            Severity::Inadequate,
            Stage::Calibrate,
            HOLDOUT_WORSE,
            "hold-out",
            format!(
                "on held-out points the fit is worse than nominal ({fitted_mm:.3} against {nominal_mm:.3} mm): \
                 it does not generalise; free fewer parameters or record more varied dwells"
            ),
        )
    })
}
