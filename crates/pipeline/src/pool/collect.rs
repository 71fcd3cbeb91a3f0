//! Finding the results of earlier runs, and checking that they belong together.

use super::PoolError;
use armcal_config::ConfigError;
use armcal_config::{BoardPose, ClosedChainSection, ClosureKind, FramePose, ObservationsSection, Pipeline};
use armcal_core::{Against, Code, Dwell, Observation, Pose, Severity, Stage, Warning};
use armcal_recording::RecordingReport;
use armcal_result::{
    BoardFacts, DwellMark, EarlierResult, OBSERVATIONS_FILE, ObservedRecording, RecordingRun, StartFrame,
    StoredObservations, StoredResultError, also_in, sha256,
};
use armcal_stages::RunError;
use armcal_table::{Assignment, Association, Board, Place};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What the results hold together.
#[derive(Debug, Clone)]
pub(super) struct Collected {
    /// The recordings in the order of time.
    pub recordings: Vec<CollectedRecording>,
    /// Their observations, in the same order and with the index of the recording in it.
    pub observations: Vec<Observation>,
    /// What was left out, and what counts once.
    pub warnings: Vec<Warning>,
}

/// One recording.
#[derive(Debug, Clone)]
pub(super) struct CollectedRecording {
    /// For the report.
    pub run: RecordingRun,
    /// Where the base started (world_from_base).
    pub base: Pose,
    /// Where its board started (world_from_board).
    pub board: Option<Pose>,
}

/// A recording, and the file it was found in.
struct Found {
    result: PathBuf,
    recording: ObservedRecording,
}

/// Reads every `observations.json` in `folders` and below.
///
/// # Errors
/// A folder without any, a result of another arm, board or setting than the pipeline's.
pub(super) fn collect_results(
    pipeline: &Pipeline,
    model_text: &str,
    board: Option<&Board>,
    folders: &[PathBuf],
) -> Result<Collected, PoolError> {
    let facts = board.map(BoardFacts::of);
    let mut found = Vec::new();
    for result in result_files(folders)? {
        let past = StoredObservations::open(&result)?;
        if let Some(problem) = find_contradiction(pipeline, &sha256(model_text), facts.as_ref(), &past) {
            let problem = format!("cannot be pooled: {problem}");
            return Err(StoredResultError::Unusable { path: result, problem }.into());
        }
        let recordings = past.recordings.into_iter();
        found.extend(recordings.map(|recording| Found { result: result.clone(), recording }));
    }
    merge_recordings(found)
}

/// All of them in the order of time, each under a name of its own; what two hold counts once.
fn merge_recordings(mut found: Vec<Found>) -> Result<Collected, PoolError> {
    let mut warnings = Vec::new();
    found.retain(|f| {
        let empty = f.recording.observations.is_empty();
        if empty {
            warnings.push(left_out(f));
        }
        !empty
    });
    if found.is_empty() {
        let dwells = 0;
        let hint = "no result has an observation: look at what their runs rejected".to_owned();
        return Err(RunError::NoObservations { dwells, hint }.into());
    }
    let begins_ns = |f: &Found| f.recording.observations.iter().map(|o| o.time_ns).min();
    found.sort_by_cached_key(|f| (begins_ns(f), f.recording.name.clone(), f.result.clone()));
    let mut found = count_once(found, &mut warnings);
    // One that lost its first dwells to another may begin later now.
    found.sort_by_cached_key(|f| (begins_ns(f), f.recording.name.clone(), f.result.clone()));
    Ok(assemble_recordings(found, warnings))
}

/// Gives every recording its name and its place.
fn assemble_recordings(found: Vec<Found>, warnings: Vec<Warning>) -> Collected {
    let names = unique_names(&found);
    let mut collected = Collected { recordings: Vec::new(), observations: Vec::new(), warnings };
    for (index, (f, name)) in found.into_iter().zip(names).enumerate() {
        let ObservedRecording { files, dwells, rejected, base, board, lost, mut observations, .. } =
            f.recording;
        observations.iter_mut().for_each(|o| o.dwell.recording = index);
        let board = board.as_ref().map(StartFrame::pose);
        let earlier = EarlierResult { path: f.result, files, dwells, rejected };
        let lost = lost.into_iter().map(|why| {
            Warning::new(Severity::DataLost, Stage::Recording, Code::RecordingDamaged, name.clone(), why)
        });
        let warnings = lost.collect();
        collected.recordings.push(CollectedRecording {
            run: RecordingRun { warnings, ..recording_run(name, earlier, board, &observations) },
            base: base.pose(),
            board,
        });
        collected.observations.extend(observations);
    }
    collected
}

/// A recording as its result tells of it: what was observed, and nothing of its files.
fn recording_run(
    name: String,
    earlier: EarlierResult,
    board: Option<Pose>,
    observations: &[Observation],
) -> RecordingRun {
    let mut dwells: Vec<Dwell> = observations.iter().map(dwell_from_observation).collect();
    dwells.dedup_by_key(|d| d.id);
    let seated = |o: &Observation| {
        let place = match o.cavity() {
            Some(cavity) => Place::Seated { cavity: cavity.to_owned(), confidence: f64::NAN },
            None => Place::FreeSpace,
        };
        Assignment { dwell: o.dwell, place, distance_m: f64::NAN }
    };
    let association = board.map(|board_in_world| Association {
        assignments: observations.iter().map(seated).collect(),
        board_in_world,
        warnings: Vec::new(),
    });
    RecordingRun {
        name,
        paths: earlier.files.iter().map(|file| PathBuf::from(&file.path)).collect(),
        report: RecordingReport::default(),
        clock: None,
        dwells,
        association,
        rejections: Vec::new(),
        earlier: Some(earlier),
        warnings: Vec::new(),
    }
}

/// What an observation tells of its dwell; what it does not is not a number.
fn dwell_from_observation(o: &Observation) -> Dwell {
    Dwell {
        id: o.dwell,
        start_ns: o.time_ns,
        end_ns: o.time_ns,
        joint_rad: o.joint_rad.clone(),
        joint_spread_rad: vec![f64::NAN; o.joint_rad.len()],
        joint_sigma_rad: o.joint_sigma_rad.clone(),
        effort_nm: o.effort_nm.clone(),
        samples: 0,
        effective_samples: f64::NAN,
        arrival: o.arrival.clone(),
        path_memory_rad: o.path_memory_rad.clone().unwrap_or_default(),
        pair_memory_rad: o.pair_memory_rad.clone().unwrap_or_default(),
        moved_rad: o.moved_rad.clone(),
        markers: Default::default(),
        tip: None,
        temperature_c: o.temperature_c,
        gauges: Default::default(),
    }
}

/// Every file of observations in the folders and below, each once, in the order of the paths.
fn result_files(folders: &[PathBuf]) -> Result<BTreeSet<PathBuf>, PoolError> {
    let mut all = BTreeSet::new();
    for folder in folders {
        let mut here = BTreeSet::new();
        search_folder(folder, &mut here)?;
        if here.is_empty() {
            let problem = "holds no observations.json, in none of its folders: name the results of `armcal run`, and run older ones \
                           again";
            return Err(
                StoredResultError::Unusable { path: folder.clone(), problem: problem.to_owned() }.into()
            );
        }
        all.extend(here);
    }
    // One file by two paths is one result; the first path names it.
    let mut seen = BTreeSet::new();
    all.retain(|path| seen.insert(path.canonicalize().unwrap_or_else(|_| path.clone())));
    Ok(all)
}

fn search_folder(path: &Path, found: &mut BTreeSet<PathBuf>) -> Result<(), PoolError> {
    // What is no folder is a result, or is told why it is none by whoever reads it.
    if path.exists() && !path.is_dir() {
        found.insert(path.to_owned());
        return Ok(());
    }
    let failed = |source| ConfigError::ReadFile { what: "folder of results", path: path.to_owned(), source };
    for entry in std::fs::read_dir(path).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        // A link to a folder may lead in circles.
        if entry.file_type().map_err(failed)?.is_dir() {
            search_folder(&entry.path(), found)?;
        } else if entry.file_name() == OBSERVATIONS_FILE {
            found.insert(entry.path());
        }
    }
    Ok(())
}

/// What of a result contradicts the pipeline, if anything.
fn find_contradiction(
    pipeline: &Pipeline,
    model_sha256: &str,
    board: Option<&BoardFacts>,
    past: &StoredObservations,
) -> Option<String> {
    if past.model_sha256 != model_sha256 {
        return Some("it calibrated another nominal arm (the model file differs); name its [model]".into());
    }
    match (&past.board, board) {
        (Some(then), Some(now)) => {
            if let Some(difference) = then.difference(now) {
                return Some(format!("its board differs from the pipeline's: {difference}"));
            }
        }
        (None, None) => {}
        (Some(_), None) => return Some("it has a board and the pipeline has no [table]".into()),
        (None, Some(_)) => return Some("it has no board and the pipeline has a [table]".into()),
    }
    let then: ObservationsSection = match past.settings.clone().try_into() {
        Ok(settings) => settings,
        Err(e) => return Some(format!("its [observations] are not understood: {e}")),
    };
    if then != pipeline.observations {
        let now = &pipeline.observations;
        return Some(format!("its [observations] were {then:?}, the pipeline's are {now:?}"));
    }
    let mut observations = past.recordings.iter().flat_map(|recording| &recording.observations);
    if observations.any(|o| matches!(o.against(), Some(Against::Fixed(_)))) {
        return Some(
            "its tip was measured against places ([[measure]]), which a result does not keep for others: list its recordings in one \
             pipeline and run that"
                .into(),
        );
    }
    if let Some(difference) = joined_otherwise(pipeline.closed_chain.as_ref(), past) {
        return Some(difference);
    }
    let boards_estimated = pipeline.table.as_ref().is_some_and(|t| t.pose == BoardPose::Estimated);
    let base_estimated = pipeline.frames.base.pose == FramePose::Estimated;
    let differs = |frame: &StartFrame, estimated| frame.estimated != estimated;
    for recording in &past.recordings {
        if recording.board.is_some() != board.is_some() {
            return Some(format!("it does not say where the board of `{}` started", recording.name));
        }
        let what = if recording.board.as_ref().is_some_and(|board| differs(board, boards_estimated)) {
            "board (table.pose)"
        } else if differs(&recording.base, base_estimated) {
            "base (frames.base.pose)"
        } else {
            continue;
        };
        return Some(format!(
            "the {what} of `{}` is estimated in one of result and pipeline and known in the other",
            recording.name
        ));
    }
    None
}

/// What two results both hold counts once, as the earlier of `found`: whole recordings by their files, and, re-encoded or
/// cut, dwells by what their encoders read and when.
fn count_once(found: Vec<Found>, warnings: &mut Vec<Warning>) -> Vec<Found> {
    let mut kept: Vec<(Found, Vec<DwellMark>)> = Vec::new();
    for mut f in found {
        let all = f.recording.observations.len();
        for (first, marks) in &kept {
            let before = f.recording.observations.len();
            let in_first =
                |identity: &str| first.recording.files.iter().any(|file| file.identity == identity);
            if f.recording.files.iter().all(|file| in_first(&file.identity)) {
                f.recording.observations.clear();
            } else {
                let mut twice = also_in(&f.recording.marks(), marks).into_iter();
                f.recording.observations.retain(|_| twice.next() != Some(true));
            }
            let twice = before - f.recording.observations.len();
            if twice > 0 {
                warnings.push(counted_once(&f, first, twice, all));
            }
        }
        if !f.recording.observations.is_empty() {
            let marks = f.recording.marks();
            kept.push((f, marks));
        }
    }
    kept.into_iter().map(|(f, _)| f).collect()
}

fn counted_once(f: &Found, first: &Found, twice: usize, all: usize) -> Warning {
    let message = format!(
        "{twice} of its {all} dwells in {} are those of `{}` in {}: they count once",
        f.result.display(),
        first.recording.name,
        first.result.display()
    );
    Warning::new(Severity::Notice, Stage::Calibrate, Code::CountedOnce, f.recording.name.clone(), message)
}

fn left_out(f: &Found) -> Warning {
    let (dwells, rejected) = (f.recording.dwells, f.recording.rejected);
    let message = format!(
        "left out: none of its {dwells} dwells became an observation ({rejected} rejected); see the warnings of its run in {}",
        f.result.display()
    );
    Warning::new(
        Severity::DataLost,
        Stage::Calibrate,
        Code::RecordingLeftOut,
        f.recording.name.clone(),
        message,
    )
}

/// The names of the recordings; those of one name are told apart by the folders of their results, then by a number.
fn unique_names(found: &[Found]) -> Vec<String> {
    let count = |names: &[String], name: &String| names.iter().filter(|other| *other == name).count();
    let own: Vec<String> = found.iter().map(|f| f.recording.name.clone()).collect();
    let mut counts: BTreeMap<&String, usize> = BTreeMap::new();
    own.iter().for_each(|name| *counts.entry(name).or_default() += 1);
    let folder = |f: &Found| {
        let folder = f.result.parent().and_then(Path::file_name).unwrap_or_default();
        folder.to_string_lossy().into_owned()
    };
    let mut names: Vec<String> = Vec::with_capacity(own.len());
    for (f, name) in found.iter().zip(&own) {
        let wanted = if counts[name] > 1 { format!("{}-{name}", folder(f)) } else { name.clone() };
        let mut unique = wanted.clone();
        let mut number = 2;
        while count(&names, &unique) > 0 {
            unique = format!("{wanted}-{number}");
            number += 1;
        }
        names.push(unique);
    }
    names
}

/// Why observations of a result cannot be pooled under this.
fn joined_otherwise(closure: Option<&ClosedChainSection>, past: &StoredObservations) -> Option<String> {
    let all = past.recordings.iter().flat_map(|recording| &recording.observations);
    let joined = all.filter(|o| o.is_joined()).map(Observation::is_scalar);
    let said: BTreeSet<bool> = joined.collect();
    match (said.first(), closure) {
        (None, None) => None,
        (Some(_), None) => Some("its tips are joined and the pipeline has no [closed_chain]".into()),
        (None, Some(_)) => Some("none of its tips are joined and the pipeline has a [closed_chain]".into()),
        (Some(apart), Some(closure)) => (*apart != (closure.kind == ClosureKind::RigidLink))
            .then(|| "its tips are joined in another way (closed_chain.kind)".into()),
    }
}
