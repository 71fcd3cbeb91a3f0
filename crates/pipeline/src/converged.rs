//! From recordings to a calibration whose setup was looked at, and what a report needs of it.

use crate::diagnosed::{run_diagnosis, set_diagnosis};
use crate::refits::sized_by_refits;
use armcal_calibrate::Calibration;
use armcal_config::Pipeline;
use armcal_core::{Code, Observation, Rejection, SetupReport, Severity, Stage, Warning};
use armcal_diagnose::{Diagnosis, Knowledge, Verdict};
use armcal_model::{Model, Session};
use armcal_recording::Recording;
use armcal_result::{Conclusions, Grounds, RecordingRun, Run, Undiagnosed};
use armcal_setup as setup;
use armcal_stages::associated::Associated;
use armcal_stages::{Fitted, Inputs, RecordingData, Rounds, RunError, Steps, fit_places, frames, preprocess};
use armcal_table::Association;

/// Association and fit depend on each other; more rounds than this mean they do not settle.
const MAX_ROUNDS: usize = 4;

/// Recordings whose dwells have found their places, and the calibration on them.
pub struct Converged {
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
    /// What an earlier run concluded from just this calibration.
    pub concluded: Option<Conclusions>,
}

/// Reads the recordings, associates and calibrates in turn until every dwell stays in its place, and looks for mistakes
/// in the setup.
pub fn settle(pipeline: &Pipeline, progress: &dyn Steps) -> Result<Converged, RunError> {
    settle_again(pipeline, None, progress)
}

/// The same where a finished run may have concluded what takes longest to find out: if it was from just this calibration, it
/// is not looked for again.
pub fn settle_again(
    pipeline: &Pipeline,
    concluded: Option<Conclusions>,
    progress: &dyn Steps,
) -> Result<Converged, RunError> {
    let (model_texts, chain) = frames::nominal_chain(pipeline)?;
    // What `[diagnosis]` says of the effects of the arm is understood before hours of work.
    Knowledge::of(&pipeline.diagnosis, chain.joint_names())?;
    let board = frames::read_board(pipeline)?;
    let recordings = preprocess::open_all(pipeline, progress)?;
    let seen = preprocess::dwells_of_all(pipeline, &chain, &recordings, progress, &mut drop)?;
    let fingerprints: Vec<_> = seen.iter().map(|s| (s.name.as_str(), s.fingerprint.as_ref())).collect();
    preprocess::refuse_repeated(&fingerprints)?;
    let inputs = Inputs {
        pipeline: pipeline.clone(),
        chain,
        board,
        seen,
        changes: Vec::new(),
        most_rounds: MAX_ROUNDS,
        known: Associated::default(),
    };
    let fitted = fit_places(&inputs, &mut Told(progress));
    progress.step("checking the setup");
    let fitted = fitted.map_err(|source| without_setup(source, &inputs))?;
    let grounds = Grounds {
        pipeline_text: &pipeline.text,
        model_texts: &model_texts,
        board: inputs.board.as_ref(),
        observations: &fitted.observations,
        calibration: &fitted.calibration,
    };
    let concluded = concluded.filter(|earlier| earlier.are_of(&grounds));
    let setup = match &concluded {
        Some(earlier) => earlier.setup.clone(),
        None => examine_setup(pipeline, &inputs, &fitted, progress),
    };
    Ok(Converged { recordings, model_texts, inputs, setup, fitted, concluded })
}

/// What contradicts the data about the setup, and leaves less of the errors than any effect that has a name.
fn examine_setup(pipeline: &Pipeline, inputs: &Inputs, fitted: &Fitted, progress: &dyn Steps) -> SetupReport {
    let mut setup = setup::examine(inputs, fitted);
    if setup.may_give_way()
        && let Ok(physics) = run_diagnosis(pipeline, &fitted.calibrated(pipeline), progress)
    {
        give_way(&mut setup, physics.as_ref());
    }
    setup
}

/// Drops what an effect explains better, where it has one name.
fn give_way(setup: &mut SetupReport, physics: Option<&Diagnosis>) {
    if let Some(named) = physics.filter(|d| d.verdict == Verdict::Identified) {
        setup.outdone_by(named.holdout_mm.after);
    }
}

/// Tells which round begins.
struct Told<'a>(&'a dyn Steps);

impl Rounds for Told<'_> {
    fn begins(&mut self, round: usize) {
        self.0.step(&format!("calibrating (round {round})"));
    }
}

/// The error of inputs that cannot be calibrated, with the mistake of the setup that would explain it.
fn without_setup(source: RunError, inputs: &Inputs) -> RunError {
    let report = setup::examine_failed(inputs);
    let messages: Vec<String> = report.mistakes().map(|f| format!("[{}] {}", f.code, f.message)).collect();
    match messages.is_empty() {
        true => source,
        false => RunError::Setup { source: Box::new(source), mistakes: messages.join("; also, ") },
    }
}

impl Converged {
    /// Of a session whose setup contradicts its data, every further sentence would be about the mistake.
    ///
    /// # Errors
    /// The first mistake.
    pub fn refuse_mistakes(&self) -> Result<(), RunError> {
        self.setup.mistakes().next().map_or(Ok(()), |mistake| {
            Err(RunError::SetupFirst {
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
    pub fn diagnose(&self, pipeline: &Pipeline, progress: &dyn Steps) -> Result<Option<Diagnosis>, RunError> {
        self.refuse_mistakes()?;
        let calibrated = self.fitted.calibrated(pipeline);
        match &self.concluded {
            Some(earlier) => Ok(Some(earlier.diagnosis_of(&calibrated))),
            None => run_diagnosis(pipeline, &calibrated, progress),
        }
    }

    /// The same with the sizes that refits give: what was concluded earlier has them.
    ///
    /// # Errors
    /// As [`Converged::diagnose`].
    pub fn diagnose_and_refit(
        &self,
        pipeline: &Pipeline,
        progress: &dyn Steps,
    ) -> Result<Option<Diagnosis>, RunError> {
        let mut diagnosis = self.diagnose(pipeline, progress)?;
        if let Some(diagnosis) = diagnosis.as_mut().filter(|_| self.concluded.is_none()) {
            sized_by_refits(diagnosis, &self.fitted.calibrated(pipeline), progress)?;
        }
        Ok(diagnosis)
    }

    /// Everything for the report, with its diagnosis: whatever comes of that, the calibration stands. What it proposes is not
    /// fitted, which takes longer than all before: only a report shows it ([`add_refits`]).
    pub fn diagnosed(self, pipeline: &Pipeline, progress: &dyn Steps) -> (Run, Vec<Recording>) {
        let found = self.diagnose(pipeline, progress);
        let (mut run, recordings) = self.into_run(pipeline);
        set_diagnosis(&mut run, found);
        give_way(&mut run.setup, run.diagnosis.as_ref());
        (run, recordings)
    }

    /// Everything for the report, without a diagnosis.
    pub fn into_run(self, pipeline: &Pipeline) -> (Run, Vec<Recording>) {
        let Fitted { model, observations, session, calibration, places, rejections, rounds, .. } =
            self.fitted;
        let mut warnings = closing_warnings(rounds, places.iter().any(Option::is_some), &calibration);
        warnings.extend(frames::links_without_mass(pipeline, &self.inputs.chain));
        let run = Run {
            recordings: recording_runs(pipeline, self.inputs.seen, places, &rejections),
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
    let ties = frames::effect_ties(pipeline, &model);
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

/// Joins what was seen, where each dwell turned out to be, and what was rejected.
fn recording_runs(
    pipeline: &Pipeline,
    seen: Vec<RecordingData>,
    places: Vec<Option<Association>>,
    rejections: &[Rejection],
) -> Vec<RecordingRun> {
    seen.into_iter()
        .zip(places)
        .zip(&pipeline.recordings)
        .enumerate()
        .map(|(index, ((seen, association), entry))| RecordingRun {
            name: seen.name,
            paths: entry.paths.clone(),
            report: seen.report,
            clock: seen.clock,
            dwells: seen.dwells,
            association,
            earlier: None,
            rejections: rejections.iter().filter(|r| r.dwell.recording == index).cloned().collect(),
            warnings: seen.warnings,
        })
        .collect()
}

fn closing_warnings(rounds: usize, at_table: bool, calibration: &Calibration) -> Vec<Warning> {
    let mut warnings = Vec::new();
    // What has no table has no visiting order either.
    if at_table && rounds == MAX_ROUNDS {
        warnings.push(Warning::new(
            Severity::Inadequate,
            Stage::Table,
            Code::AssociationUnsettled,
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

pub(crate) fn holdout_worse(calibration: &Calibration) -> Option<Warning> {
    let fitted_mm = calibration.holdout.fitted.mean_m * 1e3;
    let nominal_mm = calibration.holdout.nominal.mean_m * 1e3;
    (calibration.holdout.fitted.n > 0 && fitted_mm > nominal_mm).then(|| {
        Warning::new(
            Severity::Inadequate,
            Stage::Calibrate,
            Code::HoldoutWorse,
            "hold-out",
            format!(
                "on held-out points the fit is worse than nominal ({fitted_mm:.3} against {nominal_mm:.3} mm): \
                 it does not generalise; free fewer parameters or record more varied dwells"
            ),
        )
    })
}
