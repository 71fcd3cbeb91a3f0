//! From files to dwells: open, read, align the clocks, find the pauses.

use crate::error::Error;
use crate::pipeline::{FramePose, Pipeline};
use crate::progress::Progress;
use armcal_core::{Dwell, Rejection, Samples, Warning};
use armcal_dwell::{ClockAlignment, MeanPose, align_clocks, detect_dwells, mean_pose};
use armcal_model::{Chain, Frames, Model};
use armcal_recording::{Recording, RecordingReport};
use armcal_report::RecordingRun;
use armcal_table::Association;
use std::path::PathBuf;

/// What one recording showed before any table or fit is involved.
pub struct Seen {
    /// Name in the pipeline.
    pub name: String,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// Files, channels and streams.
    pub report: RecordingReport,
    /// Sensor clock against robot clock, where there is a tip stream.
    pub clock: Option<ClockAlignment>,
    /// The pauses.
    pub dwells: Vec<Dwell>,
    /// Mean pose of the base subject, where there is a stream.
    pub base: Option<MeanPose>,
    /// Mean pose of the table subject, where there is a stream.
    pub table: Option<MeanPose>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// Opens every recording of the pipeline.
pub fn open_all(pipeline: &Pipeline, progress: &Progress) -> Result<Vec<Recording>, Error> {
    pipeline
        .recordings
        .iter()
        .map(|entry| {
            progress.step(&format!("opening {}", entry.name()));
            let paths: Vec<PathBuf> = entry.paths.iter().map(|p| pipeline.resolve(p)).collect();
            let failed = |source| Error::Recording { recording: entry.name(), source };
            Recording::open(&paths).map_err(|source| pipeline.where_data_come_from(failed(source)))
        })
        .collect()
}

/// Reads every recording and finds its dwells. `keep` gets the samples of each.
pub fn dwells_of_all(
    pipeline: &Pipeline,
    chain: &Chain,
    recordings: &[Recording],
    progress: &Progress,
    keep: &mut dyn FnMut(Samples),
) -> Result<Vec<Seen>, Error> {
    let speed_model = Model::new(chain.clone(), Frames::of_bare_arm())?;
    let entries = pipeline.recordings.iter().zip(recordings).enumerate();
    entries
        .map(|(index, (entry, recording))| {
            progress.step(&format!("reading {}", entry.name()));
            let (samples, seen) =
                dwells_of_one(pipeline, &speed_model, index, entry.load_kg, &entry.name(), recording)?;
            keep(samples);
            Ok(seen)
        })
        .collect()
}

/// Joins what was seen, where each dwell turned out to be, and what was rejected.
pub fn recording_runs(
    pipeline: &Pipeline,
    seen: Vec<Seen>,
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
            rejections: rejections.iter().filter(|r| r.dwell.recording == index).cloned().collect(),
            warnings: seen.warnings,
        })
        .collect()
}

fn dwells_of_one(
    pipeline: &Pipeline,
    speed_model: &Model,
    index: usize,
    load_kg: f64,
    name: &str,
    recording: &Recording,
) -> Result<(Samples, Seen), Error> {
    let in_recording = |source| Error::Recording { recording: name.to_owned(), source };
    let in_dwell = |source| Error::Dwell { recording: name.to_owned(), source };

    let (samples, streams, mut warnings) = recording.read(&pipeline.streams).map_err(in_recording)?;
    let clock = match &samples.tip {
        Some(tip) if !tip.is_empty() => {
            let nominal = speed_model.nominal();
            let tip_of = |q: &[f64]| speed_model.tip_in_base(&nominal, q).translation.vector;
            let (clock, said) =
                align_clocks(&samples.joints, tip, &tip_of, &pipeline.clock).map_err(in_dwell)?;
            warnings.extend(said);
            Some(clock)
        }
        _ => None,
    };
    let (dwells, said) = detect_dwells(index, &samples, clock.as_ref(), &pipeline.dwell).map_err(in_dwell)?;
    warnings.extend(said);
    let (base, table) = static_bodies(pipeline, &samples, name, &mut warnings)?;

    let mut report = recording.report().clone();
    report.streams = streams;
    let seen = Seen { name: name.to_owned(), load_kg, report, clock, dwells, base, table, warnings };
    Ok((samples, seen))
}

/// Mean poses of the base and the table, where the pipeline uses them.
fn static_bodies(
    pipeline: &Pipeline,
    samples: &Samples,
    name: &str,
    warnings: &mut Vec<Warning>,
) -> Result<(Option<MeanPose>, Option<MeanPose>), Error> {
    let mut mean = |role, stream: Option<&armcal_core::PoseSamples>, consequence| {
        let empty = || Error::EmptyStream { recording: name.to_owned(), role, consequence };
        let samples = stream.filter(|s| !s.is_empty()).ok_or_else(empty)?;
        let (pose, said) =
            mean_pose(samples).map_err(|source| Error::Dwell { recording: name.to_owned(), source })?;
        if !pose.has_orientation {
            return Err(Error::NoOrientation { recording: name.to_owned(), role });
        }
        // A stream that names no body would leave open which of the two moved.
        let subject =
            if samples.body.is_empty() { role.to_owned() } else { format!("{role} ({})", samples.body) };
        warnings.extend(said.into_iter().map(|w| Warning { subject: subject.clone(), ..w }));
        Ok::<MeanPose, Error>(pose)
    };
    let base = match pipeline.frames.base.pose {
        FramePose::Measured => {
            Some(mean("base", samples.base.as_ref(), "the base's pose in the sensor's frame is unknown")?)
        }
        _ => None,
    };
    let table = match &pipeline.table {
        Some(t) if t.pose == crate::pipeline::BoardPose::Measured => {
            Some(mean("table", samples.table.as_ref(), "the board's pose is unknown")?)
        }
        _ => None,
    };
    Ok((base, table))
}
