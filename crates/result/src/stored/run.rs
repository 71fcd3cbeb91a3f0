//! A run read back from its `run.mcap`: what comparing and re-reading need, without the recordings it came from.

use crate::left_out::{INPUT_METADATA, OWN};
use crate::proto::parameter_message;
use crate::run::{RecordingRun, Run, effect_part_names};
use crate::{DwellMark, proto};
use armcal_calibrate::Residual;
use armcal_core::{Dwell, DwellId, Observation};
use armcal_recording::{RawMetadata, Recording, RecordingError, input};
use prost::Message as _;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Name of the file of a run that holds all the others.
pub const RUN: &str = "run.mcap";
/// Name of its summary.
pub const SUMMARY: &str = "summary.json";
/// Name of the page.
pub const REPORT: &str = "report.html";

/// Results of an earlier run.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredRun {
    /// The file; empty for a run that has not been written.
    pub path: PathBuf,
    /// Name of its pipeline.
    pub pipeline: String,
    /// Physical effects of its model beyond geometry.
    pub effects: Vec<String>,
    /// The recordings, by their index.
    pub recordings: Vec<StoredRecording>,
    /// One entry an observation, in the order of the file.
    pub residuals: Vec<StoredResidual>,
    /// All parameters, free and fixed.
    pub parameters: Vec<proto::Parameter>,
    /// Its `summary.json`; null for a run that has not been written.
    pub summary: serde_json::Value,
}

/// A recording that was calibrated on.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StoredRecording {
    /// Its name.
    pub name: String,
    /// What its files hold, as hashes.
    pub identities: Vec<String>,
    /// Its dwells, used or not.
    pub dwells: Vec<StoredDwell>,
}

/// When a dwell was, and what it is recognised by.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredDwell {
    /// Index in its recording.
    pub index: usize,
    /// Its beginning [ns], robot clock.
    pub start_ns: i64,
    /// Its end [ns].
    pub end_ns: i64,
    /// Its middle and what the joints read.
    pub mark: DwellMark,
}

/// The error of one observation after calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredResidual {
    /// Name of the recording.
    pub recording: String,
    /// Its dwell.
    pub dwell: DwellId,
    /// Cavity; empty when the tip was tracked.
    pub cavity: String,
    /// The marker that was measured; `None` of the tip.
    pub feature: Option<String>,
    /// Whether the fit that predicted it never saw it.
    pub held_out: bool,
    /// Norm of measured minus predicted [m].
    pub error_m: f64,
}

/// Why a result cannot be read back.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each message says what its fields are")]
pub enum StoredResultError {
    /// The file is not there or not an MCAP.
    #[error("reading the result {}: {source}", path.display())]
    Open { path: PathBuf, source: Box<RecordingError> },
    /// The file holds no results of armcal.
    #[error(
        "{} holds no results of armcal (no messages on {topic}); name the run.mcap that `armcal run` wrote, or its folder",
        path.display()
    )]
    NoResults { path: PathBuf, topic: &'static str },
    /// A result that cannot be used where it was named, or a folder without any.
    #[error("{} {problem}", path.display())]
    Unusable { path: PathBuf, problem: String },
    /// A file of the result is there and cannot be read.
    #[error("reading {}: {source}", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    /// There is no model in the result.
    #[error(
        "{} holds no calibrated model ({why}); name the results of `armcal run` (their folder, run.mcap or model.json), \
         and run an older result again",
        path.display()
    )]
    NoModel { path: PathBuf, why: String },
    /// The observations of the result are not what they should be.
    #[error("the observations in {}: {why}; run the pipeline again", path.display())]
    BadObservations { path: PathBuf, why: String },
    /// The model of the result is not what it should be.
    #[error("the calibrated model in {}: {why}; run the pipeline again", path.display())]
    BadModel { path: PathBuf, why: String },
}

/// The text of a file of a result; `absent` says what it means that it is not there.
pub fn stored_text(
    path: &Path,
    absent: impl FnOnce(String) -> StoredResultError,
) -> Result<String, StoredResultError> {
    input::read_to_string(path, input::Kind::Data).map_err(|source| match source.kind() {
        ErrorKind::NotFound => absent(source.to_string()),
        _ => StoredResultError::Unreadable { path: path.to_owned(), source },
    })
}

/// The `run.mcap` that a path means: itself, or that in the folder.
pub fn run_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join(RUN) } else { path.to_owned() }
}

/// The texts that armcal attached by these names to a `run.mcap`, which its folder may stand for.
///
/// # Errors
/// Results that cannot be read.
pub fn attached_texts<const N: usize>(
    results: &Path,
    names: [&str; N],
) -> Result<[Option<String>; N], StoredResultError> {
    let path = run_file(results);
    let at = |source| StoredResultError::Open { path: path.clone(), source: Box::new(source) };
    let recording = Recording::open(std::slice::from_ref(&path)).map_err(at)?;
    read_attached_texts(&recording, names).map_err(at)
}

/// The same of one that is open.
fn read_attached_texts<const N: usize>(
    recording: &Recording,
    names: [&str; N],
) -> Result<[Option<String>; N], RecordingError> {
    let mut found = [const { None }; N];
    recording.for_each_attachment(&mut |a| {
        for (text, name) in found.iter_mut().zip(names) {
            if text.is_none() && a.name.strip_prefix(OWN) == Some(name) {
                *text = Some(String::from_utf8_lossy(a.data).into_owned());
            }
        }
        Ok(())
    })?;
    Ok(found)
}

impl StoredRun {
    /// A run that has just finished, as it would be read back.
    pub fn of(run: &Run) -> StoredRun {
        let residual = |(o, r): (&Observation, &Residual)| StoredResidual {
            recording: run.recording_name(r.dwell).to_owned(),
            dwell: r.dwell,
            cavity: o.cavity().unwrap_or_default().to_owned(),
            feature: run.model.measured_name(o),
            held_out: r.held_out,
            error_m: r.fitted_m.norm(),
        };
        let recording = |r: &RecordingRun| StoredRecording {
            name: r.name.clone(),
            identities: r.files().into_iter().map(|f| f.identity).collect(),
            dwells: r.dwells.iter().map(StoredDwell::of).collect(),
        };
        StoredRun {
            recordings: run.recordings.iter().map(recording).collect(),
            path: PathBuf::new(),
            pipeline: run.pipeline_name.clone(),
            effects: effect_part_names(&run.calibration).into_iter().map(str::to_owned).collect(),
            residuals: run.observations.iter().zip(&run.calibration.residuals).map(residual).collect(),
            parameters: run.calibration.fit.estimates.iter().map(parameter_message).collect(),
            summary: serde_json::Value::Null,
        }
    }

    /// Reads `run.mcap`, given itself or the folder it is in.
    pub fn open(path: &Path) -> Result<StoredRun, StoredResultError> {
        let path = run_file(path);
        let at = |source| StoredResultError::Open { path: path.clone(), source: Box::new(source) };
        let recording = Recording::open(std::slice::from_ref(&path)).map_err(at)?;
        let mut residuals = Vec::new();
        let mut dwells = Vec::new();
        let mut parameters = Vec::new();
        let mut report = None;
        let each = &mut |message: armcal_recording::RawMessage<'_>| {
            // A message that cannot be decoded is not one of ours.
            match message.channel.topic.as_str() {
                "/armcal/residuals" => residuals.extend(proto::Residual::decode(message.data).ok()),
                "/armcal/dwells" => dwells.extend(proto::Dwell::decode(message.data).ok()),
                "/armcal/parameters" => parameters.extend(proto::Parameters::decode(message.data).ok()),
                "/armcal/report" => report = proto::Calibration::decode(message.data).ok().or(report.take()),
                _ => {}
            }
            Ok(())
        };
        recording.for_each_raw(each).map_err(at)?;
        let missing = |topic| StoredResultError::NoResults { path: path.clone(), topic };
        let report = report.ok_or_else(|| missing("/armcal/report"))?;
        if residuals.is_empty() {
            return Err(missing("/armcal/residuals"));
        }
        let [summary] = read_attached_texts(&recording, [SUMMARY]).map_err(at)?;
        let inputs = recording.metadata().map_err(at)?;
        Ok(StoredRun {
            recordings: stored_recordings(&inputs, &dwells),
            pipeline: report.pipeline,
            effects: report.effects,
            residuals: residuals.into_iter().map(StoredResidual::from).collect(),
            parameters: parameters.into_iter().flat_map(|p| p.parameters).collect(),
            summary: summary.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default(),
            path,
        })
    }
}

/// The recordings, put together from the names and hashes of the input and the dwells.
fn stored_recordings(metadata: &[RawMetadata], dwells: &[proto::Dwell]) -> Vec<StoredRecording> {
    let mut found: BTreeMap<usize, StoredRecording> = BTreeMap::new();
    let inputs = metadata.iter().filter(|(name, _)| name == INPUT_METADATA).flat_map(|(_, entries)| entries);
    for (key, value) in inputs {
        let Some((index, fact)) = key.strip_prefix("recording").and_then(|key| key.split_once('.')) else {
            continue;
        };
        let Ok(index) = index.parse() else { continue };
        let recording: &mut StoredRecording = found.entry(index).or_default();
        match fact {
            "name" => recording.name.clone_from(value),
            // Earlier versions wrote a SHA-256.
            file if file.ends_with(".identity") || file.ends_with(".sha256") => {
                recording.identities.push(value.clone())
            }
            _ => {}
        }
    }
    for d in dwells {
        let recording = found.entry(d.recording_index as usize).or_default();
        recording.name.clone_from(&d.recording);
        recording.dwells.extend(StoredDwell::read(d));
    }
    let count = found.keys().next_back().map_or(0, |last| last + 1);
    (0..count).map(|index| found.remove(&index).unwrap_or_default()).collect()
}

impl StoredDwell {
    fn of(d: &Dwell) -> StoredDwell {
        let mark = DwellMark::of(d.mid_ns(), &d.joint_rad);
        StoredDwell { index: d.id.dwell, start_ns: d.start_ns, end_ns: d.end_ns, mark }
    }

    /// None where a time is missing.
    fn read(d: &proto::Dwell) -> Option<StoredDwell> {
        let ns = |t: &Option<prost_types::Timestamp>| {
            let t = t.as_ref()?;
            t.seconds.checked_mul(1_000_000_000)?.checked_add(i64::from(t.nanos))
        };
        let mark = DwellMark::of(ns(&d.timestamp)?, &d.joint_rad);
        Some(StoredDwell { index: d.dwell as usize, start_ns: ns(&d.start)?, end_ns: ns(&d.end)?, mark })
    }
}

impl From<proto::Residual> for StoredResidual {
    fn from(r: proto::Residual) -> StoredResidual {
        StoredResidual {
            recording: r.recording,
            dwell: DwellId { recording: r.recording_index as usize, dwell: r.dwell as usize },
            cavity: r.cavity,
            feature: r.feature,
            held_out: r.held_out,
            error_m: r.fitted_norm_mm * 1e-3,
        }
    }
}
