//! Everything a finished run knows. All outputs are views of this one value.

use crate::called::Called;
use crate::error::ResultError;
use crate::files::{ObservedFile, sha256};
use crate::recorded_time::RecordedTime;
use crate::recording_names::RecordingNames;
use armcal_calibrate::{Calibration, Residual};
use armcal_core::{Dwell, DwellId, ErrorStats, Observation, Rejection, Role, SetupReport, Warning};
use armcal_diagnose::Diagnosis;
use armcal_dwell::ClockAlignment;
use armcal_model::{Model, Session};
use armcal_recording::{FileReport, RecordingError, RecordingReport, sha256_of};
use armcal_table::{Assignment, Association, Board, Place};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind::NotFound;
use std::path::{Path, PathBuf};

/// Version of the tool, as every output states it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A finished run.
#[derive(Debug, Clone)]
pub struct Run {
    /// Name of the pipeline.
    pub pipeline_name: String,
    /// Text of the pipeline, so that the result can be reproduced from itself.
    pub pipeline_text: String,
    /// Text of the model file (DH table or URDF), which the calibrated model is written in the form of; of several arms one each.
    pub model_texts: Vec<String>,
    /// Recordings in the order of the pipeline; the index is [`DwellId::recording`].
    pub recordings: Vec<RecordingRun>,
    /// The calibration board, where the rig has one.
    pub board: Option<Board>,
    /// The model with its nominal parameters.
    pub model: Model,
    /// What the fit saw, and the dwells held out of it.
    pub observations: Vec<Observation>,
    /// What effects know of all observations: what drives them is worked out with it.
    pub session: Session,
    /// The calibration; its residuals are in the order of `observations`.
    pub calibration: Calibration,
    /// The same with whole recordings held out in turn: what the calibration is worth on a day it never saw. Of a run of
    /// several earlier results.
    pub transfer: Option<Calibration>,
    /// What contradicts the data about the setup, before any physics.
    pub setup: SetupReport,
    /// Which effect the calibrated model is missing; `None` where `undiagnosed` says why.
    pub diagnosis: Option<Diagnosis>,
    /// Why there is no diagnosis.
    pub undiagnosed: Option<Undiagnosed>,
    /// Mean error that its user wants at most [mm], where that was said.
    pub wanted_mm: Option<f64>,
    /// Effects of its model that stand for one of several: the name as a pipeline spells it, and all names that the data left when
    /// it was added.
    pub ties: Vec<(String, Vec<String>)>,
    /// What the diagnosis found, added one effect after the other (what has no name at once), fitted and held out anew.
    pub steps: Vec<Refit>,
    /// What the most probable candidates would do, each alone in the run's model; those that are no step already.
    pub alternatives: Vec<Refit>,
    /// What concerns the run as a whole.
    pub warnings: Vec<Warning>,
}

/// Why a run has no diagnosis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Undiagnosed {
    /// `[diagnosis] enabled = false`.
    NotAsked,
    /// The setup contradicts the data: no physical effect is looked for in such data.
    SetupFirst,
    /// The search works on all free parameters at once, and these are more than the `most` it is made for.
    TooLarge {
        /// How many are free.
        free: usize,
        /// How many may be.
        most: usize,
    },
    /// There are fewer equations than free parameters, which follow anything; a warning says how many.
    TooFewDwells,
    /// It could not be made; a warning says why.
    Failed,
}

/// The run's model with more effects, fitted to the same observations and judged on the same hold-out.
#[derive(Debug, Clone)]
pub struct Refit {
    /// Everything added to the run's model, as a pipeline names it, in the order of adding.
    pub effects: Vec<String>,
    /// The model with them.
    pub model: Model,
    /// Its calibration; its residuals are in the order of [`Run::observations`].
    pub calibration: Calibration,
}

impl Refit {
    /// Its parameters with the effects it adds to `base` taken out again. Residuals there are what these effects do (and
    /// what is left), in the geometry that was fitted with them: partial residuals (Larsen and McCleary 1972,
    /// Technometrics 14:781). The calibration of `base` has bent the geometry towards the effects and hides their shape.
    pub fn values_without_effects(&self, base: &Model) -> Vec<f64> {
        let mut values = self.calibration.fit.values();
        let added = base.parameters().len()..values.len();
        values[added.clone()].copy_from_slice(&self.model.nominal()[added]);
        values
    }
}

/// One recording and what every stage made of it.
#[derive(Debug, Clone)]
pub struct RecordingRun {
    /// Its name in the pipeline; also names its board frame, `board.<name>`.
    pub name: String,
    /// Its files as given.
    pub paths: Vec<PathBuf>,
    /// What reading found.
    pub report: RecordingReport,
    /// Relation of the sensor's clock to the robot's, where both were needed.
    pub clock: Option<ClockAlignment>,
    /// Pauses of the arm, in the order of time.
    pub dwells: Vec<Dwell>,
    /// Where the tip was during each dwell; `None` without a board.
    pub association: Option<Association>,
    /// Dwells that do not take part in the fit, and why.
    pub rejections: Vec<Rejection>,
    /// The result it comes from, where its files were not read: then dwells are those that were observed.
    pub earlier: Option<EarlierResult>,
    /// What the stages after reading want the user to know about this recording.
    pub warnings: Vec<Warning>,
}

/// What an earlier run observed of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct EarlierResult {
    /// Where its observations were read.
    pub path: PathBuf,
    /// The files of the recording.
    pub files: Vec<ObservedFile>,
    /// Dwells found.
    pub dwells: usize,
    /// Dwells that did not become an observation.
    pub rejected: usize,
}

/// Errors of one recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordingErrors {
    /// Nominal arm.
    pub nominal: ErrorStats,
    /// Calibrated; held out where the pipeline holds out.
    pub calibrated: ErrorStats,
    /// As a day that the calibration never saw.
    pub unseen: Option<ErrorStats>,
}

impl Run {
    /// Every other calibration of the observations: the steps, then the alternatives.
    pub fn refits(&self) -> impl Iterator<Item = &Refit> {
        self.steps.iter().chain(&self.alternatives)
    }

    /// Dwells of a recording that were seated in a cavity; without a board, those the fit could use.
    pub fn associated(&self, recording: &RecordingRun) -> usize {
        if self.board.is_some() && recording.earlier.is_none() {
            return recording
                .assignments()
                .iter()
                .filter(|a| matches!(a.place, Place::Seated { .. }))
                .count();
        }
        self.used(recording)
    }

    /// Dwells of a recording in which every joint of the model was read: what the arm can be drawn in.
    pub fn posed<'a>(&self, recording: &'a RecordingRun) -> impl Iterator<Item = &'a Dwell> + use<'a> {
        let joints = self.model.joint_count();
        recording.dwells.iter().filter(move |d| d.joint_rad.len() == joints)
    }

    /// The first of them all: what the arm is drawn in before anything moves.
    pub fn first_posed(&self) -> Option<&Dwell> {
        self.recordings.iter().find_map(|r| self.posed(r).next())
    }

    /// Dwells of a recording that the fit could use.
    pub fn used(&self, recording: &RecordingRun) -> usize {
        let observed = self.observed();
        recording.dwells.iter().filter(|d| observed.contains(&d.id)).count()
    }

    /// Dwells that are observations.
    pub fn observed(&self) -> BTreeSet<DwellId> {
        self.observations.iter().map(|o| o.dwell).collect()
    }

    /// Where each dwell of all recordings was.
    pub fn assigned(&self) -> BTreeMap<DwellId, &Assignment> {
        self.recordings.iter().flat_map(RecordingRun::assigned).collect()
    }

    /// What each of the steps adds to the one before.
    pub fn step_effects(&self) -> Vec<Vec<String>> {
        let before = std::iter::once(0).chain(self.steps.iter().map(|step| step.effects.len()));
        let added = |(step, before): (&Refit, usize)| step.effects[before.min(step.effects.len())..].to_vec();
        self.steps.iter().zip(before).map(added).collect()
    }

    /// Its recordings as sentences call them.
    pub fn recording_names(&self) -> RecordingNames {
        RecordingNames::new(self.recordings.iter().map(|r| r.name.clone()))
    }

    /// What its diagnosis is told with.
    pub fn called(&self) -> Called {
        let chain = self.model.chain();
        Called {
            recordings: self.recording_names(),
            branched_joints: if chain.is_branched() { chain.joint_names().to_vec() } else { Vec::new() },
            ties: self.ties.clone(),
            is_pool: self.is_pool(),
            is_refitted: self.diagnosis.as_ref().is_some_and(|d| d.refitted.is_some()),
        }
    }

    /// Indices of the parameters that no recording has for itself.
    pub fn shared_parameters(&self) -> Vec<usize> {
        let own: BTreeSet<usize> =
            (0..self.recordings.len()).flat_map(|at| self.model.own_parameters(at)).collect();
        (0..self.model.parameters().len()).filter(|index| !own.contains(index)).collect()
    }

    /// Whether it is of earlier results, without reading a recording.
    pub fn is_pool(&self) -> bool {
        self.recordings.iter().any(|r| r.earlier.is_some())
    }

    /// Errors of every recording.
    pub fn errors_by_recording(&self) -> Vec<RecordingErrors> {
        let own = |c: &Calibration, norm: fn(&Residual) -> f64| -> Vec<ErrorStats> {
            let mut norms = vec![Vec::new(); self.recordings.len()];
            for r in &c.residuals {
                norms.get_mut(r.dwell.recording).into_iter().for_each(|own| own.push(norm(r)));
            }
            norms.iter().map(|norms| ErrorStats::of_norms(norms)).collect()
        };
        let nominal = own(&self.calibration, |r| r.nominal_m.norm());
        let calibrated = own(&self.calibration, |r| r.fitted_m.norm());
        let unseen = self.transfer.as_ref().map(|c| own(c, |r| r.fitted_m.norm()));
        let of = |at: usize| RecordingErrors {
            nominal: nominal[at],
            calibrated: calibrated[at],
            unseen: unseen.as_ref().map(|unseen| unseen[at]),
        };
        (0..self.recordings.len()).map(of).collect()
    }

    /// Its recordings one after the other, without the time between them.
    pub fn recorded_time(&self) -> RecordedTime {
        RecordedTime::of(&self.observations, self.recordings.len())
    }

    /// A sentence about it with recordings and moments by their names.
    pub fn in_words(&self, sentence: &str) -> String {
        self.recording_names().in_words(sentence)
    }

    /// Where the base stood in a recording [m].
    pub fn base_m(&self, p: &[f64], recording: usize) -> Vector3<f64> {
        let (model, p) = self.model.in_recording(recording, p);
        model.base_in_world(&p).translation.vector
    }

    /// Name of the recording a dwell belongs to.
    pub fn recording_name(&self, dwell: DwellId) -> &str {
        self.recordings.get(dwell.recording).map_or("", |r| r.name.as_str())
    }
}

impl RecordingRun {
    /// Warnings of reading and of the stages after it, each once.
    pub fn all_warnings(&self) -> Vec<&Warning> {
        let of_association = self.association.iter().flat_map(|a| &a.warnings);
        without_repeats(self.report.warnings.iter().chain(&self.warnings).chain(of_association))
    }

    /// Where the tip was during each dwell; empty without a board.
    pub fn assignments(&self) -> &[Assignment] {
        self.association.as_ref().map_or(&[], |a| &a.assignments)
    }

    /// Where each of its dwells was.
    pub fn assigned(&self) -> BTreeMap<DwellId, &Assignment> {
        self.assignments().iter().map(|a| (a.dwell, a)).collect()
    }

    /// Why dwells did not become observations.
    pub fn why_not(&self) -> BTreeMap<DwellId, &str> {
        // Of several reasons the first.
        self.rejections.iter().rev().map(|r| (r.dwell, r.why.as_str())).collect()
    }

    /// Dwells found in it.
    pub fn found(&self) -> usize {
        self.earlier.as_ref().map_or(self.dwells.len(), |earlier| earlier.dwells)
    }

    /// Dwells that did not become an observation.
    pub fn rejected(&self) -> usize {
        self.earlier.as_ref().map_or(self.rejections.len(), |earlier| earlier.rejected)
    }

    /// Offset at its first stamp [ms] and drift [ppm] of the sensor's clock in words, where there is one.
    pub fn clock_shown(&self) -> Option<[String; 2]> {
        let c = self.clock.as_ref()?;
        let [offset_ms, offset_sigma_ms] = c.first_offset_s().map(|s| s * 1e3);
        let [drift_ppm, drift_sigma_ppm] = [c.drift, c.drift_sigma].map(|d| d * 1e6);
        Some(match c.declared {
            true => [format!("{offset_ms:.2} declared"), format!("{drift_ppm:.1} declared")],
            false => [
                format!("{offset_ms:.2} ± {offset_sigma_ms:.2}"),
                format!("{drift_ppm:.1} ± {drift_sigma_ppm:.1}"),
            ],
        })
    }

    /// Its files: paths as given, what identifies them, sizes.
    pub fn files(&self) -> Vec<ObservedFile> {
        let file = |f: &FileReport| ObservedFile {
            path: self.given_path(f).to_string_lossy().into_owned(),
            identity: f.identity.clone(),
            bytes: f.bytes,
        };
        let read = || self.report.files.iter().map(file).collect();
        self.earlier.as_ref().map_or_else(read, |earlier| earlier.files.clone())
    }

    /// Path of a file as the pipeline gives it; results do not depend on where the pipeline lies.
    fn given_path<'a>(&'a self, file: &'a FileReport) -> &'a Path {
        self.paths.iter().find(|given| file.path.ends_with(given)).unwrap_or(&file.path)
    }

    /// SHA-256 of the file, for whoever compares it with what `sha256sum` prints; of those of all files, one a line, for a
    /// split recording. Of an object, and of what an earlier result was made from, the identity stands for it.
    ///
    /// # Errors
    /// A file that is there and cannot be read.
    pub fn sha256(&self) -> Result<String, ResultError> {
        let local = |f: &FileReport| match sha256_of(&f.path) {
            // A file that is gone by now cannot be compared with anything.
            Err(RecordingError::Open { source, .. }) if source.kind() == NotFound => Ok(String::new()),
            hash => hash.map_err(|source| ResultError::Hash(Box::new(source))),
        };
        let hash = |f: &FileReport| if f.object.is_some() { Ok(f.identity.clone()) } else { local(f) };
        let hashes: Vec<String> = match &self.earlier {
            Some(earlier) => earlier.files.iter().map(|f| f.identity.clone()).collect(),
            None => self.report.files.iter().map(hash).collect::<Result<_, _>>()?,
        };
        Ok(match hashes.as_slice() {
            [] => String::new(),
            [hash] => hash.clone(),
            hashes => sha256(&hashes.iter().map(|hash| format!("{hash}\n")).collect::<String>()),
        })
    }
}

/// Names of the physical effects in the model: the parts that own [`Role::Effect`] parameters.
pub fn effect_part_names(calibration: &Calibration) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for estimate in &calibration.fit.estimates {
        let part = estimate.parameter.name.rsplit_once('.').map_or("", |(part, _)| part);
        if estimate.parameter.role == Role::Effect && !names.contains(&part) {
            names.push(part);
        }
    }
    names
}

/// How the iteration ended, as machine-readable output spells it.
pub fn status_word(status: armcal_calibrate::Status) -> &'static str {
    match status {
        armcal_calibrate::Status::Converged => "converged",
        armcal_calibrate::Status::IterationLimit => "iteration_limit",
    }
}

/// What a parameter belongs to, as machine-readable output spells it.
pub fn role_word(role: Role) -> &'static str {
    match role {
        Role::Robot => "robot",
        Role::EstimatedFrame => "estimated_frame",
        Role::KnownFrame => "known_frame",
        Role::Effect => "effect",
    }
}

/// Each warning once, in the order given.
pub fn without_repeats<'a>(warnings: impl Iterator<Item = &'a Warning>) -> Vec<&'a Warning> {
    let mut seen: Vec<&Warning> = Vec::new();
    for warning in warnings {
        if !seen.contains(&warning) {
            seen.push(warning);
        }
    }
    seen
}
