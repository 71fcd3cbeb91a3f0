//! The main job, top down: recordings -> samples -> dwells -> places -> observations -> fit -> setup -> diagnosis -> run.

use crate::error::Error;
use crate::pipeline::Pipeline;
use crate::progress::Progress;
use crate::refits::add_refits;
use crate::setup::{self, Inputs};
use crate::stages::associated::Associated;
use crate::stages::measures::Measures;
use crate::stages::observe::Observed;
use crate::stages::{frames, observe, perceive};
use armcal_calibrate::{Calibration, calibrate};
use armcal_core::{Observation, Rejection, SetupReport, Severity, Stage, Warning};
use armcal_diagnose::{Calibrated, Diagnosis, Knowledge, Nested, Verdict, diagnose, nested};
use armcal_model::{EffectSpec, Model, Session};
use armcal_recording::Recording;
use armcal_report::{Run, Undiagnosed};
use armcal_table::{Association, Place};

/// Association and fit depend on each other; more rounds than this mean they do not settle.
const MAX_ROUNDS: usize = 4;

/// Runs a pipeline up to its results in memory; nothing is written.
///
/// Returns the run and the opened recordings, which the writers pass through to the output.
pub fn run(pipeline: &Pipeline, progress: &Progress) -> Result<(Run, Vec<Recording>), Error> {
    let (mut run, recordings) = settle(pipeline, progress)?.diagnosed(pipeline, progress);
    add_refits(&mut run, pipeline, progress)?;
    Ok((run, recordings))
}

/// Code of the warning about a diagnosis that could not be made.
const DIAGNOSIS_FAILED: &str = "diagnosis-failed";

/// Recordings whose dwells have found their places, and the calibration on them.
pub struct Settled {
    /// The opened recordings.
    pub recordings: Vec<Recording>,
    /// Texts of the nominal model files: one an arm.
    pub model_texts: Vec<String>,
    /// What it was calibrated from.
    pub inputs: Inputs,
    /// What contradicts the data about the setup.
    pub setup: SetupReport,
    /// The calibration on them.
    pub fitted: Fitted,
}

/// Inputs with every dwell in its place, calibrated.
pub struct Fitted {
    /// The nominal arm in its frames, without effects.
    pub geometry: Model,
    /// The same with the pipeline's effects: what was calibrated.
    pub model: Model,
    /// What the fit saw.
    pub observations: Vec<Observation>,
    /// What effects know of all of it together.
    pub session: Session,
    /// The calibration.
    pub calibration: Calibration,
    /// Where every dwell is on the table, by recording.
    pub places: Vec<Option<Association>>,
    /// Dwells that are none, and why.
    pub rejections: Vec<Rejection>,
    /// Rounds of association and fit.
    pub rounds: usize,
}

impl Fitted {
    /// Where the dwells turned out to be, where there is a table.
    pub fn places(&self) -> impl Iterator<Item = &Place> {
        self.places.iter().flatten().flat_map(|a| &a.assignments).map(|a| &a.place)
    }

    /// What a diagnosis asks of it.
    pub fn calibrated<'a>(&'a self, pipeline: &'a Pipeline) -> Calibrated<'a> {
        let Fitted { model, calibration, observations, session, .. } = self;
        let (fit, holdout) = (&pipeline.fit, &pipeline.holdout);
        Calibrated { model, calibration, observations, session, fit, holdout }
    }
}

/// Reads the recordings, associates and calibrates in turn until every dwell stays in its place, and looks for mistakes
/// in the setup.
pub fn settle(pipeline: &Pipeline, progress: &Progress) -> Result<Settled, Error> {
    let (model_texts, chain) = frames::nominal_chain(pipeline)?;
    // What `[diagnosis]` says of the effects of the arm is understood before hours of work.
    Knowledge::of(&pipeline.diagnosis, chain.joint_names())?;
    let board = frames::board(pipeline)?;
    let recordings = perceive::open_all(pipeline, progress)?;
    let seen = perceive::dwells_of_all(pipeline, &chain, &recordings, progress, &mut drop)?;
    let fingerprints: Vec<_> = seen.iter().map(|s| (s.name.as_str(), s.fingerprint.as_ref())).collect();
    perceive::refuse_repeated(&fingerprints)?;
    let inputs = Inputs {
        pipeline: pipeline.clone(),
        chain,
        board,
        seen,
        changes: Vec::new(),
        most_rounds: MAX_ROUNDS,
        known: Associated::default(),
    };
    let fitted = fit_places(&inputs, &mut |round| progress.step(&format!("calibrating (round {round})")));
    progress.step("checking the setup");
    let fitted = fitted.map_err(|source| without_setup(source, &inputs))?;
    let setup = setup::examine(&inputs, &fitted);
    Ok(Settled { recordings, model_texts, inputs, setup, fitted })
}

/// The error of inputs that cannot be calibrated, with the mistake of the setup that would explain it.
fn without_setup(source: Error, inputs: &Inputs) -> Error {
    let report = setup::examine_failed(inputs);
    let messages: Vec<String> = report.mistakes().map(|f| format!("[{}] {}", f.code, f.message)).collect();
    match messages.is_empty() {
        true => source,
        false => Error::Setup { source: Box::new(source), mistakes: messages.join("; also, ") },
    }
}

/// Associates and calibrates in turn until every dwell stays in its place. `told` hears the number of each round.
pub fn fit_places(inputs: &Inputs, told: &mut dyn FnMut(usize)) -> Result<Fitted, Error> {
    let Inputs { pipeline, chain, board, seen, changes, known, .. } = inputs;
    let board = board.as_ref();
    let mut geometry = frames::nominal_model(pipeline, chain, board, seen)?;
    frames::change_nominals(&mut geometry, changes)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    let mut places =
        observe::associate_all(pipeline, board, &geometry, &geometry.nominal(), false, (seen, known))?;
    let measures = Measures::of(pipeline, seen);
    let near = match measures.is_empty() {
        true => Vec::new(),
        false => {
            let sure = observe::observations(pipeline, board, seen, &places).observations;
            measures.near(&mut geometry, &sure)?
        }
    };
    let mut measured = near.clone();
    let mut rounds = 0;
    loop {
        rounds += 1;
        told(rounds);
        frames::start_frames(pipeline, &mut geometry, &places);
        let mut observed = observe::observations(pipeline, board, seen, &places);
        measures.add(&mut observed, &measured)?;
        let Observed { observations, mut rejections } = observed.not_empty()?;
        let model = with_effects(pipeline, &geometry, &effects, &observations)?;
        let calibration = calibrate(&model, &observations, &pipeline.fit, &pipeline.holdout)?;
        let mut next = None;
        if rounds < inputs.most_rounds {
            let values = calibration.fit.values();
            let again = observe::associate_all(pipeline, board, &model, &values, true, (seen, known))?;
            let closing = measures.closing(&model, &calibration, &near);
            let settled = observe::same_places(&again, &places) && closing == measured;
            next = (!settled).then_some((again, closing));
        }
        match next {
            Some(again) => (places, measured) = again,
            None => {
                measures.explain(&mut rejections, &model, &calibration);
                let session = frames::session(pipeline, &observations);
                return Ok(Fitted {
                    geometry,
                    model,
                    observations,
                    session,
                    calibration,
                    places,
                    rejections,
                    rounds,
                });
            }
        }
    }
}

impl Settled {
    /// Of a session whose setup contradicts its data, every further sentence would be about the mistake.
    ///
    /// # Errors
    /// The first mistake.
    pub fn refuse_mistakes(&self) -> Result<(), Error> {
        self.setup.mistakes().next().map_or(Ok(()), |mistake| {
            Err(Error::SetupFirst {
                pipeline: self.inputs.pipeline.name.clone(),
                code: mistake.code,
                message: mistake.message.clone(),
            })
        })
    }

    /// Looks for the effect that the calibrated model is missing, if the pipeline wants to know.
    ///
    /// # Errors
    /// A mistake of the setup, which would get the name of an effect; a diagnosis that cannot be made.
    pub fn diagnose(&self, pipeline: &Pipeline, progress: &Progress) -> Result<Option<Diagnosis>, Error> {
        self.refuse_mistakes()?;
        diagnosis(pipeline, &self.fitted.calibrated(pipeline), progress)
    }

    /// Everything for the report, with its diagnosis: whatever comes of that, the calibration stands. What it proposes is not
    /// fitted, which takes longer than all before: only a report shows it ([`add_refits`]).
    pub fn diagnosed(self, pipeline: &Pipeline, progress: &Progress) -> (Run, Vec<Recording>) {
        let found = self.diagnose(pipeline, progress);
        let (mut run, recordings) = self.into_run(pipeline);
        set_diagnosis(&mut run, found);
        if let Some(named) = run.diagnosis.as_ref().filter(|d| d.verdict == Verdict::Identified) {
            run.setup.outdone_by(named.holdout_mm.after);
        }
        (run, recordings)
    }

    /// Everything for the report, without a diagnosis.
    pub fn into_run(self, pipeline: &Pipeline) -> (Run, Vec<Recording>) {
        let Fitted { model, observations, session, calibration, places, rejections, rounds, .. } =
            self.fitted;
        let mut warnings = closing_warnings(rounds, places.iter().any(Option::is_some), &calibration);
        warnings.extend(frames::links_without_mass(pipeline, &self.inputs.chain));
        let run = Run {
            recordings: perceive::recording_runs(pipeline, self.inputs.seen, places, &rejections),
            board: self.inputs.board,
            setup: self.setup,
            warnings,
            ..run_of(pipeline, self.model_texts, model, (observations, session), calibration)
        };
        (run, self.recordings)
    }
}

/// A run of these observations, and nothing else of it.
pub(crate) fn run_of(
    pipeline: &Pipeline,
    model_texts: Vec<String>,
    model: Model,
    (observations, session): (Vec<Observation>, Session),
    calibration: Calibration,
) -> Run {
    let ties = frames::ties(pipeline, &model);
    Run {
        pipeline_name: pipeline.name.clone(),
        pipeline_text: pipeline.text.clone(),
        model_texts,
        recordings: Vec::new(),
        board: None,
        model,
        session,
        observations,
        calibration,
        transfer: None,
        setup: SetupReport::default(),
        diagnosis: None,
        undiagnosed: Some(Undiagnosed::NotAsked),
        wanted_mm: pipeline.accuracy.wanted_mm,
        ties,
        steps: Vec::new(),
        alternatives: Vec::new(),
        warnings: Vec::new(),
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
    run.warnings.retain(|w| ![HOLDOUT_WORSE, DIAGNOSIS_FAILED].contains(&w.code));
    run.warnings.extend(holdout_worse(&run.calibration));
    if run.setup.mistakes().next().is_none() {
        diagnose_again(run, pipeline, progress);
    }
    run.ties = frames::ties(pipeline, &run.model);
    run.pipeline_name.clone_from(&pipeline.name);
    run.pipeline_text.clone_from(&pipeline.text);
    add_refits(run, pipeline, progress)
}

/// Looks for the effect that the model of a run is missing, if the pipeline wants to know.
pub fn diagnose_again(run: &mut Run, pipeline: &Pipeline, progress: &Progress) {
    let found = diagnosis(pipeline, &calibrated(run, pipeline), progress);
    set_diagnosis(run, found);
}

/// What a diagnosis asks of a run.
pub(crate) fn calibrated<'a>(run: &'a Run, pipeline: &'a Pipeline) -> Calibrated<'a> {
    let Run { model, calibration, observations, session, .. } = run;
    let (fit, holdout) = (&pipeline.fit, &pipeline.holdout);
    Calibrated { model, calibration, observations, session, fit, holdout }
}

fn diagnosis(
    pipeline: &Pipeline,
    calibrated: &Calibrated<'_>,
    progress: &Progress,
) -> Result<Option<Diagnosis>, Error> {
    if !pipeline.diagnosis.enabled {
        return Ok(None);
    }
    progress.step("diagnosing");
    Ok(Some(diagnose(calibrated, &pipeline.diagnosis)?))
}

/// What came of a diagnosis, or why there is none.
fn set_diagnosis(run: &mut Run, found: Result<Option<Diagnosis>, Error>) {
    (run.diagnosis, run.undiagnosed) = match found {
        Ok(Some(diagnosis)) => (Some(diagnosis), None),
        Ok(None) => (None, Some(Undiagnosed::NotAsked)),
        Err(Error::SetupFirst { .. }) => (None, Some(Undiagnosed::SetupFirst)),
        Err(e) => {
            let message = format!("what is missing could not be looked for: {e}; the calibration stands");
            let (severity, stage) = (Severity::Inadequate, Stage::Diagnose);
            run.warnings.push(Warning::new(severity, stage, DIAGNOSIS_FAILED, "diagnosis", message));
            (None, Some(Undiagnosed::Failed))
        }
    };
}

/// The choice of what was found, made again without each part of the hold-out.
pub(crate) fn chosen_again(
    pipeline: &Pipeline,
    calibrated: &Calibrated<'_>,
    found: &Diagnosis,
    progress: &Progress,
) -> Result<Option<Nested>, Error> {
    progress.step("choosing again without each part of the hold-out");
    Ok(nested(calibrated, found, &pipeline.diagnosis)?)
}

/// The geometry with effects, or as it is without any.
pub(crate) fn with_effects(
    pipeline: &Pipeline,
    geometry: &Model,
    effects: &[EffectSpec],
    observations: &[Observation],
) -> Result<Model, Error> {
    with_session(geometry, effects, &frames::session(pipeline, observations))
}

/// The same of observations of which this is known.
pub(crate) fn with_session(
    geometry: &Model,
    effects: &[EffectSpec],
    session: &Session,
) -> Result<Model, Error> {
    geometry.check_declared(session)?;
    Ok(geometry.with_effects(effects, session)?)
}

fn closing_warnings(rounds: usize, at_table: bool, calibration: &Calibration) -> Vec<Warning> {
    let mut warnings = Vec::new();
    // What has no table has no visiting order either.
    if at_table && rounds == MAX_ROUNDS {
        warnings.push(Warning::new(
            Severity::Inadequate,
            Stage::Table,
            "association-unsettled",
            "association",
            format!(
                "after {MAX_ROUNDS} rounds of fitting and associating, dwells still change cavities; \
                 give a visiting order, [table.association] visiting_order"
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
