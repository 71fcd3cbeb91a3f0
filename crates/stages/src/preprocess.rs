//! From files to dwells: open, read, align the clocks, find the pauses.

use crate::RunError;
use crate::Steps;
use crate::doubts::Doubts;
use crate::effort;
use crate::frames;
use crate::points;
use crate::readings::{self, Readings};
use crate::rigid;
use crate::seen::RecordingData;
use crate::unaligned::{Reading, what_would_align};
use armcal_config::{BoardPose, FramePose, Pipeline, RecordingEntry};
use armcal_core::robust::{median, percentile};
use armcal_core::{Code, FeatureId, JointSamples, PoseSamples, Samples, Severity, Stage, Warning};
use armcal_dwell::{ClockAlignment, MeanPose, align_clocks, detect_dwells, mean_pose};
use armcal_model::{Chain, Model};
use armcal_recording::{Fingerprint, Recording, SharedTime};
use nalgebra::Vector3;
use std::path::PathBuf;
use std::sync::Arc;

/// Two recordings that hold the same readings over some time.
pub struct Repeat {
    /// The earlier one in the pipeline.
    pub first: usize,
    /// The later one.
    pub second: usize,
    /// When.
    pub shared: SharedTime,
}

/// Opens every recording of the pipeline.
pub fn open_all(pipeline: &Pipeline, progress: &dyn Steps) -> Result<Vec<Recording>, RunError> {
    pipeline
        .recordings
        .iter()
        .map(|entry| {
            progress.step(&format!("opening {}", entry.name()));
            let paths: Vec<PathBuf> = entry.paths.iter().map(|p| pipeline.resolve(p)).collect();
            let failed = |source| RunError::Recording { recording: entry.name(), source };
            Recording::open(&paths).map_err(|source| failed(source).where_data_come_from(pipeline))
        })
        .collect()
}

/// Reads every recording and finds its dwells. `keep` gets the samples of each.
pub fn dwells_of_all(
    pipeline: &Pipeline,
    chain: &Chain,
    recordings: &[Recording],
    progress: &dyn Steps,
    keep: &mut dyn FnMut(Samples),
) -> Result<Vec<RecordingData>, RunError> {
    let speed_model = frames::bare_model(chain, frames::markers(pipeline))?;
    let entries = pipeline.recordings.iter().zip(recordings).enumerate();
    let mut all = entries
        .map(|(index, (entry, recording))| {
            progress.step(&format!("reading {}", entry.name()));
            let (samples, seen) = dwells_of_one(pipeline, &speed_model, index, entry, recording)?;
            keep(samples);
            Ok(seen)
        })
        .collect::<Result<Vec<RecordingData>, RunError>>()?;
    effort::warn_of_gaps(chain.joint_names(), &mut all);
    Ok(all)
}

/// Every two recordings that hold the same readings, in the order of the pipeline.
pub fn find_repeats(fingerprints: &[&Fingerprint]) -> Vec<Repeat> {
    let before = |second: usize| (0..second).map(move |first| (first, second));
    let pairs = (0..fingerprints.len()).flat_map(before);
    let repeat = |(first, second): (usize, usize)| {
        let shared = fingerprints[first].shared(fingerprints[second])?;
        Some(Repeat { first, second, shared })
    };
    pairs.filter_map(repeat).collect()
}

/// One recording counted twice would make every result look surer than it is.
///
/// # Errors
/// Two recordings with the same readings, by their names.
pub fn refuse_repeated(recordings: &[(&str, &Fingerprint)]) -> Result<(), RunError> {
    let fingerprints: Vec<&Fingerprint> = recordings.iter().map(|(_, fingerprint)| *fingerprint).collect();
    match find_repeats(&fingerprints).first() {
        None => Ok(()),
        Some(repeat) => Err(RunError::RecordedTwice {
            first: recordings[repeat.first].0.to_owned(),
            second: recordings[repeat.second].0.to_owned(),
            overlap_s: repeat.shared.duration_s(),
        }),
    }
}

fn dwells_of_one(
    pipeline: &Pipeline,
    speed_model: &Model,
    index: usize,
    entry: &RecordingEntry,
    recording: &Recording,
) -> Result<(Samples, RecordingData), RunError> {
    let name = &entry.name();
    let in_recording = |source| RunError::Recording { recording: name.to_owned(), source };
    let in_dwell = |source| RunError::Dwell { recording: name.to_owned(), source };

    let (mut samples, streams, mut warnings) = recording.read(&pipeline.streams).map_err(in_recording)?;
    let expected = speed_model.chain().joint_names().len();
    if samples.joints.joint_rad.len() != expected {
        let read = samples.joints.joint_rad.len();
        let problem = format!(
            "{read} joints are read for a model of {expected}; mend `names` in [streams.joints], or the rows of the model file: \
             the number of joints differs"
        );
        return Err(RunError::InRecording { recording: name.to_owned(), problem });
    }
    if pipeline.two_arms.is_none() && pipeline.streams.joints.len() > 1 {
        in_order_of(speed_model.chain(), &mut samples.joints, name)?;
    }
    // Readings that are held leap too: told once, by their cause.
    match readings::stale_warning(&samples.joints, name) {
        Some(stale) => warnings.push(stale),
        None => warnings.extend(readings::leap_warnings(&samples.joints, name)),
    }
    let clock = match alignment_feature(&samples, speed_model) {
        Some((feature, tip)) => {
            let doubts = Doubts::of(pipeline, speed_model, feature);
            let is_declared = pipeline.clock.known.is_some() || pipeline.clock.offset_ms.is_some();
            let of_stops = || Ok(clock_of_stops(&samples.joints, tip, pipeline.clock.initial_offset_s));
            let aligned = match tip.shows_no_motion() && !is_declared {
                true => of_stops(),
                false => match align_clocks(&samples.joints, tip, &doubts, &pipeline.clock) {
                    Err(_) if tip.is_one_a_stop() => of_stops(),
                    aligned => aligned,
                },
            };
            let (clock, said) = aligned.map_err(|source| {
                let with = |reading: &Reading| {
                    let arm = doubts.scaled(reading.lengths);
                    let aligned = align_clocks(&reading.joints, &reading.tip, &arm, &pipeline.clock);
                    aligned.ok().map(|(clock, _)| clock.correlation)
                };
                alignment_error(in_dwell(source), name, &samples, &with)
            })?;
            warnings.extend(said);
            Some(clock)
        }
        _ => None,
    };
    let (mut dwells, said) =
        detect_dwells(index, &samples, clock.as_ref(), &pipeline.dwell).map_err(in_dwell)?;
    warnings.extend(said);
    if let Some(points) = &entry.points {
        let path = pipeline.resolve(&points.csv);
        warnings.push(points::assign_to_dwells(points, (&path, name), speed_model, &mut dwells)?);
    }
    warnings.extend(rigid::reject_outliers(speed_model, &mut dwells));
    let (base, table) = static_bodies(pipeline, &samples, name, &mut warnings)?;
    let bodies = [("base", base.is_some(), &samples.base), ("table", table.is_some(), &samples.table)];
    let travels_m = bodies
        .into_iter()
        .filter(|(_, used, _)| *used)
        .filter_map(|(role, _, stream)| Some((role, travel_m(&stream.as_ref()?.position_m))))
        .collect();

    let repeated = streams.iter().filter(|s| s.role == "joints").map(|s| s.duplicate_stamps).sum();
    let mut report = recording.whole_report().map_err(in_recording)?.clone();
    report.streams = streams;
    let fingerprint = Arc::new(Fingerprint::of(&samples));
    let readings = Readings::of(&samples.joints, repeated, &dwells);
    let (load_kg, more_loads) = pipeline.loads_of(entry);
    let seen = RecordingData {
        name: name.clone(),
        load_kg,
        more_loads,
        report,
        clock,
        dwells,
        base,
        table,
        travels_m,
        warnings,
        fingerprint,
        readings,
    };
    Ok((samples, seen))
}

/// Puts the joints of several streams into the order of the chain, by their names: no list of the pipeline gives it.
fn in_order_of(chain: &Chain, joints: &mut JointSamples, recording: &str) -> Result<(), RunError> {
    let place = |name: &String| {
        joints.names.iter().position(|read| read == name).ok_or_else(|| {
            let problem = format!(
                "no [[streams.joints]] reads the joint `{name}` of the model; several streams are put together by the names of the \
                 model file: they read {}",
                joints.names.join(", ")
            );
            RunError::InRecording { recording: recording.to_owned(), problem }
        })
    };
    let order = chain.joint_names().iter().map(place).collect::<Result<Vec<usize>, RunError>>()?;
    let sorted = |columns: &Vec<Vec<f64>>| order.iter().map(|k| columns[*k].clone()).collect();
    (joints.joint_rad, joints.effort_nm) = (sorted(&joints.joint_rad), joints.effort_nm.as_ref().map(sorted));
    joints.names = chain.joint_names().to_vec();
    Ok(())
}

/// What the clocks are aligned by: the tip, or the first marker where nothing saw the tip.
fn alignment_feature<'s>(samples: &'s Samples, model: &Model) -> Option<(FeatureId, &'s PoseSamples)> {
    let seen = model.features().filter_map(|(feature, name)| match feature.is_tip() {
        true => Some((feature, samples.tip.as_ref()?)),
        false => Some((feature, samples.bodies.get(name)?)),
    });
    seen.into_iter().find(|(_, seen)| !seen.is_empty())
}

/// One pose a stop shows no motion: its clock is that of the joints, but for what log time tells of their epochs, or the pipeline.
fn clock_of_stops(
    joints: &JointSamples,
    tip: &PoseSamples,
    initial_s: f64,
) -> (ClockAlignment, Vec<Warning>) {
    let by_log_s = tip.other_epoch_s(joints);
    let offset_s = if by_log_s == 0.0 { initial_s } else { by_log_s };
    let first_ns = tip.time_ns.first().copied().unwrap_or_default();
    let clock = ClockAlignment {
        offset_s,
        offset_sigma_s: 0.0,
        drift: 0.0,
        drift_sigma: 0.0,
        reference_ns: first_ns,
        first_ns,
        correlation: f64::NAN,
        displacement_ratio: f64::NAN,
        declared: true,
    };
    let message = format!(
        "the tip was seen {} times, too rarely to show its movements: what was seen in a pause is one measurement each, on the clock \
         of the joints, and its noise is what `sensor_sigma_mm` under [observations] declares",
        tip.len()
    );
    (clock, vec![Warning::new(Severity::Notice, Stage::Dwell, Code::OneAStop, "clock", message)])
}

/// The error of clocks that cannot be aligned, with the reading that would align them.
fn alignment_error(
    source: RunError,
    name: &str,
    samples: &Samples,
    correlation: &(dyn Fn(&Reading) -> Option<f64> + Sync),
) -> RunError {
    match what_would_align(samples, correlation) {
        Some(mistakes) => {
            RunError::Setup { source: Box::new(source), mistakes: format!("recording `{name}`: {mistakes}") }
        }
        None => source,
    }
}

/// Distance from the median position that all but the worst hundredth of the frames keep [m].
fn travel_m(positions_m: &[Vector3<f64>]) -> f64 {
    let axis = |k: usize| median(&positions_m.iter().map(|p| p[k]).collect::<Vec<_>>());
    let centre_m = Vector3::new(axis(0), axis(1), axis(2));
    let distances_m: Vec<f64> = positions_m.iter().map(|p| (p - centre_m).norm()).collect();
    percentile(&distances_m, 0.99)
}

/// Mean poses of the base and the table, where the pipeline uses them.
fn static_bodies(
    pipeline: &Pipeline,
    samples: &Samples,
    name: &str,
    warnings: &mut Vec<Warning>,
) -> Result<(Option<MeanPose>, Option<MeanPose>), RunError> {
    let mut mean = |role: &str, stream: Option<&PoseSamples>, consequence: &str| {
        let unusable = |problem: String| RunError::InRecording { recording: name.to_owned(), problem };
        let empty = || {
            unusable(format!(
                "the {role} stream has no usable sample, so {consequence}; see `armcal inspect`"
            ))
        };
        let samples = stream.filter(|s| !s.is_empty()).ok_or_else(empty)?;
        let (pose, said) =
            mean_pose(samples).map_err(|source| RunError::Dwell { recording: name.to_owned(), source })?;
        if !pose.has_orientation {
            return Err(unusable(format!(
                "the {role} stream has positions but no orientations; name a topic with poses in [streams.{role}]"
            )));
        }
        // A stream that names no body would leave open which of the two moved.
        let subject =
            if samples.body.is_empty() { role.to_owned() } else { format!("{role} ({})", samples.body) };
        warnings.extend(said.into_iter().map(|w| Warning { subject: subject.clone(), ..w }));
        Ok::<MeanPose, RunError>(pose)
    };
    let base = match pipeline.frames.base.pose {
        FramePose::Measured => {
            Some(mean("base", samples.base.as_ref(), "the base's pose in the sensor's frame is unknown")?)
        }
        _ => None,
    };
    let table = match &pipeline.table {
        Some(t) if t.pose == BoardPose::Measured => {
            Some(mean("table", samples.table.as_ref(), "the board's pose is unknown")?)
        }
        _ => None,
    };
    Ok((base, table))
}
