//! One pool in shards: every share answers what the fit asks about its own results, round after round; whoever reduces asks.
//!
//! [`map`] answers the open round for one share. [`reduce`] runs the calibration of `armcal pool` on the answers that there are:
//! where one is missing it writes what is asked next, and otherwise the results. Both do the same when done again.

use super::collect::{Collected, Found, contained, results, together};
use super::rounds::Rounds;
use super::{Start, geometry_of, joint_run};
use crate::batch::Shard;
use crate::error::Error;
use crate::progress::Progress;
use armcal_calibrate::{Answer, CalibrateError, Elsewhere, Objective, Request, answer, calibrate_elsewhere};
use armcal_config::ConfigError;
use armcal_config::Pipeline;
use armcal_core::Observation;
use armcal_model::{Model, Session};
use armcal_recording::identity_of;
use armcal_report::{PastObservations, Run, Undiagnosed};
use armcal_stages::RunError;
use armcal_stages::frames;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// What a share tells of its results.
#[derive(Serialize, Deserialize)]
struct Survey {
    pipeline: PathBuf,
    /// Those of all shares.
    results: Vec<PathBuf>,
    found: Vec<Found>,
    /// Of the files that were read.
    identities: BTreeMap<PathBuf, String>,
}

/// What shares must know of all recordings.
#[derive(Serialize, Deserialize)]
struct Plan {
    recordings: Vec<Planned>,
    session: Session,
}

/// One recording of the pool.
#[derive(Serialize, Deserialize)]
struct Planned {
    start: Start,
    result: PathBuf,
    /// Of the file, when it was surveyed.
    identity: String,
    /// Its place in that file, and the dwells of it that count.
    number: usize,
    dwells: BTreeSet<usize>,
    /// Place of its first observation among all.
    first: usize,
}

/// What a round asks, and what is settled.
#[derive(Serialize, Deserialize)]
struct Questions {
    requests: Vec<Request>,
    settled: BTreeMap<String, Vec<f64>>,
}

/// What a share did.
pub struct Mapped {
    /// The round.
    pub round: usize,
    /// Results of the share.
    pub results: usize,
    /// Whether it was done before.
    pub skipped: bool,
}

/// What came of a reduction.
pub enum Reduced {
    /// Every share is asked again.
    Round {
        /// Number of the round.
        number: usize,
        /// How much it asks.
        questions: usize,
    },
    /// The pool.
    Done(Box<Run>),
}

/// Answers the open round for one share of the results in `folders`.
///
/// # Errors
/// Results that cannot be pooled, or that changed since they were surveyed; rounds of another pool.
pub fn map(
    path: &Path,
    folders: &[PathBuf],
    out: &Path,
    shard: Shard,
    progress: &Progress,
) -> Result<Mapped, Error> {
    let pipeline = poolable(path)?;
    let all: Vec<PathBuf> = results(folders)?.into_iter().collect();
    let rounds = Rounds::new(&pipeline, &all, out)?;
    let own: Vec<PathBuf> =
        all.iter().enumerate().filter(|(i, _)| shard.has(*i)).map(|(_, path)| path.clone()).collect();
    let round = rounds.latest();
    let target = rounds.answers(round, shard);
    let mapped = |skipped| Mapped { round, results: own.len(), skipped };
    if rounds.has(&target)? {
        return Ok(mapped(true));
    }
    progress.step(&format!("round {round}: {} results", own.len()));
    if round == 0 {
        let pipeline_path = std::path::absolute(path).map_err(|source| ConfigError::ReadFile {
            what: "pipeline",
            path: path.to_owned(),
            source,
        })?;
        let survey = survey(&pipeline, pipeline_path, all, &own)?;
        rounds.write(&target, &[survey])?;
        return Ok(mapped(false));
    }
    let plan: Plan = rounds.read(&rounds.plan(), 0)?;
    let Questions { requests, .. } = rounds.read(&rounds.questions(round), 0)?;
    let model = model_of(&pipeline, &plan)?;
    let own: BTreeSet<&PathBuf> = own.iter().collect();
    let held: Vec<(usize, usize, Vec<Observation>)> = plan
        .recordings
        .iter()
        .enumerate()
        .filter(|(_, planned)| own.contains(&planned.result))
        .map(|(index, planned)| Ok((index, planned.first, observed(planned, index)?)))
        .collect::<Result<_, Error>>()?;
    let answers = requests.iter().map(|request| {
        let of = |(index, first, observations): &(usize, usize, Vec<Observation>)| {
            Some((*index, answer(&model, *first, observations, &pipeline.fit, request)?))
        };
        held.par_iter().filter_map(of).collect::<Vec<(usize, Answer)>>()
    });
    rounds.write(&target, &answers.collect::<Vec<_>>())?;
    Ok(Mapped { round, results: own.len(), skipped: false })
}

/// Puts the shares of the open round together.
///
/// # Errors
/// Shares that are missing, doubled, or of another pool or version, each by name; and what can go wrong in a fit.
pub fn reduce(out: &Path, progress: &Progress) -> Result<(Pipeline, Reduced), Error> {
    let shards = Rounds::shards(out)?;
    let mut surveys: Vec<Survey> =
        shards.iter().map(|shard| Rounds::read_any(out, *shard)).collect::<Result<_, _>>()?;
    let pipeline = poolable(&surveys[0].pipeline)?;
    let rounds = Rounds::new(&pipeline, &surveys[0].results, out)?;
    let round = rounds.latest();
    for number in 0..=round {
        for shard in &shards {
            let path = rounds.answers(number, *shard);
            if !rounds.has(&path)? {
                let why = format!("is missing: map share {shard}, then reduce again");
                return Err(Error::Pool { path, why });
            }
        }
    }
    let identities: BTreeMap<PathBuf, String> =
        surveys.iter_mut().flat_map(|survey| std::mem::take(&mut survey.identities)).collect();
    let mut found: Vec<Found> = surveys.into_iter().flat_map(|survey| survey.found).collect();
    found.sort_by(|a, b| a.place().cmp(&b.place()));
    let collected = together(found)?;
    let plan = planned(&pipeline, &collected, &identities);
    if !rounds.has(&rounds.plan())? {
        rounds.write(&rounds.plan(), std::slice::from_ref(&plan))?;
    }
    let asked = Asked::new(&rounds, &shards, round, &plan)?;
    let fit = |model: &Model, observations: &[Observation], holdout: &_| {
        calibrate_elsewhere(model, observations, &pipeline.fit, holdout, &asked)
    };
    let run = joint_run(&pipeline, collected, &fit, progress);
    let Asked { open, settled, .. } = asked;
    match run {
        Err(Error::Run(RunError::Calibrate(CalibrateError::Unanswered))) => {
            let requests: Vec<Request> = inner(open).into_values().collect();
            let (number, questions) = (round + 1, requests.len());
            rounds.write(&rounds.questions(number), &[Questions { requests, settled: inner(settled) }])?;
            Ok((pipeline, Reduced::Round { number, questions }))
        }
        Err(e) => Err(e),
        Ok((mut run, _)) => {
            if pipeline.diagnosis.enabled {
                run.undiagnosed = Some(Undiagnosed::InShards);
            }
            Ok((pipeline, Reduced::Done(Box::new(run))))
        }
    }
}

/// The pipeline, if its results can be pooled share by share.
fn poolable(path: &Path) -> Result<Pipeline, Error> {
    let pipeline = Pipeline::load_for_others(path)?;
    let refused = |key: &str, problem: &str| {
        Err(ConfigError::Contradiction { path: path.to_owned(), key: key.into(), problem: problem.into() }
            .into())
    };
    if pipeline.closed_chain.is_some() {
        return refused("closed_chain", "of arms that are joined is pooled in one process: `armcal pool`");
    }
    if pipeline.fit.objective == Objective::Paper {
        return refused(
            "fit.objective",
            "= \"paper\" has no normal equations to add up: give \"robust\" or \"least-squares\"",
        );
    }
    Ok(pipeline)
}

fn survey(
    pipeline: &Pipeline,
    path: PathBuf,
    results: Vec<PathBuf>,
    own: &[PathBuf],
) -> Result<Survey, Error> {
    let (model_texts, _) = frames::nominal_chain(pipeline)?;
    let board = frames::board(pipeline)?;
    let identity = |path: &PathBuf| {
        let failed = |source| RunError::Recording { recording: path.display().to_string(), source };
        Ok((path.clone(), identity_of(path).map_err(failed)?))
    };
    // What is no result is refused before all of it is hashed.
    let mut found = contained(pipeline, &model_texts.concat(), board.as_ref(), own.iter().cloned())?;
    let identities = own.iter().map(identity).collect::<Result<_, Error>>()?;
    found.iter_mut().flat_map(Found::observations_mut).for_each(lighten);
    Ok(Survey { pipeline: path, results, found, identities })
}

/// Leaves who it is, where the arm stood and what was measured: what hold-outs, names and the start of frames need.
fn lighten(o: &mut Observation) {
    o.joint_sigma_rad = Vec::new();
    o.covariance_m2 = nalgebra::Matrix3::zeros();
    (o.path_memory_rad, o.pair_memory_rad) = (None, None);
    o.moved_rad = o.moved_rad.is_some().then(Vec::new);
}

fn planned(pipeline: &Pipeline, collected: &Collected, identities: &BTreeMap<PathBuf, String>) -> Plan {
    let mut first = 0;
    let of = |(index, recording): (usize, &super::CollectedRecording)| {
        let own = collected.observations[first..].iter().take_while(|o| o.dwell.recording == index);
        let own: Vec<usize> = own.map(|o| o.dwell.dwell).collect();
        let result = recording.run.earlier.as_ref().map(|earlier| earlier.path.clone()).unwrap_or_default();
        first += own.len();
        Planned {
            start: recording.start(),
            identity: identities.get(&result).cloned().unwrap_or_default(),
            result,
            number: recording.number,
            first: first - own.len(),
            dwells: own.into_iter().collect(),
        }
    };
    let recordings = collected.recordings.iter().enumerate().map(of).collect();
    Plan { recordings, session: frames::session(pipeline, &collected.observations) }
}

/// The model of the pool, as [`joint_run`] makes it.
fn model_of(pipeline: &Pipeline, plan: &Plan) -> Result<Model, Error> {
    let (_, chain) = frames::nominal_chain(pipeline)?;
    let starts: Vec<&Start> = plan.recordings.iter().map(|planned| &planned.start).collect();
    let geometry = geometry_of(pipeline, chain, &starts)?;
    let effects = frames::effect_specs(pipeline, &geometry)?;
    Ok(armcal_stages::with_session(&geometry, &effects, &plan.session)?)
}

/// The observations of a recording, read again.
fn observed(planned: &Planned, index: usize) -> Result<Vec<Observation>, Error> {
    let path = &planned.result;
    let failed = |source| RunError::Recording { recording: path.display().to_string(), source };
    if identity_of(path).map_err(failed)? != planned.identity {
        let problem = "changed since the first round: remove the folder `rounds` of the pool, and begin anew"
            .to_owned();
        return Err(Error::Result { path: path.clone(), problem });
    }
    let mut recordings = PastObservations::open(path)?.recordings;
    let mut observations = recordings.swap_remove(planned.number).observations;
    observations.retain(|o| planned.dwells.contains(&o.dwell.dwell));
    observations.iter_mut().for_each(|o| o.dwell.recording = index);
    Ok(observations)
}

/// The answers that there are, and the questions that are open.
struct Asked<'a> {
    rounds: &'a Rounds,
    shards: &'a [Shard],
    plan: &'a Plan,
    /// Round and place of every question that was answered.
    answered: BTreeMap<String, (usize, usize)>,
    open: Mutex<BTreeMap<String, Request>>,
    settled: Mutex<BTreeMap<String, Vec<f64>>>,
}

impl<'a> Asked<'a> {
    fn new(
        rounds: &'a Rounds,
        shards: &'a [Shard],
        round: usize,
        plan: &'a Plan,
    ) -> Result<Asked<'a>, Error> {
        let (mut answered, mut settled) = (BTreeMap::new(), BTreeMap::new());
        for number in 1..=round {
            let questions: Questions = rounds.read(&rounds.questions(number), 0)?;
            let keys = questions.requests.iter().map(key_of).enumerate();
            answered.extend(keys.map(|(place, key)| (key, (number, place))));
            settled = questions.settled;
        }
        Ok(Asked { rounds, shards, plan, answered, open: Mutex::default(), settled: settled.into() })
    }

    fn answers(&self, request: &Request, (round, place): (usize, usize)) -> Result<Vec<Answer>, Error> {
        let mut all: BTreeMap<usize, Answer> = BTreeMap::new();
        for shard in self.shards {
            let path = self.rounds.answers(round, *shard);
            let own: Vec<(usize, Answer)> = self.rounds.read(&path, place)?;
            for (index, answer) in own {
                if all.insert(index, answer).is_some() {
                    return Err(self.misplaced(path, index, "is in two shares"));
                }
            }
        }
        let ends = self.plan.recordings.iter().skip(1).map(|planned| planned.first).chain([usize::MAX]);
        for (index, (planned, end)) in self.plan.recordings.iter().zip(ends).enumerate() {
            let is_asked = request.of.iter().any(|run| run.start < end && run.end > planned.first);
            if is_asked != all.contains_key(&index) {
                let path = self.rounds.questions(round);
                return Err(self.misplaced(path, index, "is in no share, or answered what nobody asked"));
            }
        }
        Ok(all.into_values().collect())
    }

    fn misplaced(&self, path: PathBuf, index: usize, how: &str) -> Error {
        let name = self.plan.recordings.get(index).map_or("?", |planned| &planned.start.name);
        Error::Pool {
            path,
            why: format!("recording `{name}` {how}: remove the folder `rounds`, and map again"),
        }
    }
}

impl Elsewhere for Asked<'_> {
    fn ask(&self, request: &Request) -> Result<Vec<Answer>, CalibrateError> {
        let key = key_of(request);
        let Some(at) = self.answered.get(&key) else {
            locked(&self.open).insert(key, request.clone());
            return Err(CalibrateError::Unanswered);
        };
        self.answers(request, *at).map_err(|e| CalibrateError::Unreachable(e.to_string()))
    }

    fn found(&self, key: &[u8]) -> Option<Vec<f64>> {
        locked(&self.settled).get(&hex::encode(Sha256::digest(key))).cloned()
    }

    fn keep(&self, key: Vec<u8>, found: &[f64]) {
        locked(&self.settled).insert(hex::encode(Sha256::digest(key)), found.to_vec());
    }
}

/// What tells a question from every other.
fn key_of(request: &Request) -> String {
    // Numbers and lists of them can be written.
    hex::encode(Sha256::digest(rmp_serde::to_vec(request).unwrap_or_default()))
}

fn locked<T>(of: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

fn inner<T>(of: Mutex<T>) -> T {
    of.into_inner().unwrap_or_else(PoisonError::into_inner)
}
