//! The job for two arms, top down: recordings -> dwells of both -> which are joined -> fit -> run.

use super::joined::{check_moves, join, of_arm};
use super::pipeline::{ArmSection, ClosedPipeline, RecordingPaths};
use crate::error::Error;
use crate::progress::Progress;
use crate::stages::{frames, perceive};
use armcal_calibrate::{
    Calibration, ChainArm, ClosedChain, ClosedChainProblem, ClosedObservation, Closure, HoldoutConfig,
    calibrate_closed_chain, closed_chain_nominal, expected_norm_m,
};
use armcal_core::{JointSamples, Rejection, Samples};
use armcal_dwell::detect_dwells;
use armcal_model::{Frames, Model, Session};
use armcal_recording::{Fingerprint, JointStream, Recording, RecordingReport, Streams};
use armcal_report::{ClosedRecording, ClosedRun};
use std::path::PathBuf;

/// Which dwells are joined and where the other base is depend on each other; so do fit and outliers.
const MAX_ROUNDS: usize = 5;
/// A calibrated closing error this many times what the noise explains is that of tips that are not joined.
const OPEN_FACTOR: f64 = 10.0;
/// An arm none of whose joints moves by as much is not led through poses [rad]: 1 deg.
const LEAST_MOTION_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;

/// Runs a pipeline of two arms up to its results in memory; nothing is written. Returns the run and the opened recordings,
/// which the writers pass through to the output.
pub fn run(pipeline: &ClosedPipeline, progress: &Progress) -> Result<(ClosedRun, Vec<Recording>), Error> {
    let mut arms = Vec::new();
    for arm in &pipeline.arms {
        arms.push(nominal_arm(pipeline, arm)?);
    }
    let [(first, first_text), (second, second_text)] = <[(ChainArm, String); 2]>::try_from(arms)
        .map_err(|_| two_arms("there must be two [[arms]]".into()))?;
    let (mut seen, mut opened, mut fingerprints) = (Vec::new(), Vec::new(), Vec::new());
    for (index, entry) in pipeline.recordings.iter().enumerate() {
        progress.step(&format!("reading {}", entry.name()));
        let (recording, found, fingerprint) = seen_in(pipeline, index, entry)?;
        opened.push(recording);
        seen.push(found);
        fingerprints.push(fingerprint);
    }
    let named: Vec<_> = seen.iter().map(|s| s.name.as_str()).zip(&fingerprints).collect();
    perceive::refuse_repeated(&named)?;
    let count = [&first, &second].map(|arm| arm.model.joint_count());
    let all = observations(pipeline, &seen, count)?;

    let chain = ClosedChain::new([first, second], pipeline.closed_chain.closure())?;
    progress.step("placing the second base");
    let (chain, near) = placed(pipeline, chain, &all)?;
    progress.step("calibrating");
    let settled = settled(pipeline, with_effects(pipeline, chain, &all)?, &all, near)?;
    let recordings =
        seen.into_iter().enumerate().map(|(index, seen)| with_open(seen, index, &settled.open)).collect();
    let run = ClosedRun {
        pipeline_name: pipeline.name.clone(),
        pipeline_text: pipeline.text.clone(),
        chain: settled.chain,
        model_texts: [first_text, second_text],
        recordings,
        observations: settled.joined,
        calibration: settled.calibration,
        warnings: Vec::new(),
    };
    Ok((run, opened))
}

fn with_open(recording: ClosedRecording, index: usize, open: &[Rejection]) -> ClosedRecording {
    let open = open.iter().filter(|r| r.dwell.recording == index).cloned().collect();
    ClosedRecording { open, ..recording }
}

/// The arm before calibration, without effects, and the text of its file.
fn nominal_arm(pipeline: &ClosedPipeline, arm: &ArmSection) -> Result<(ChainArm, String), Error> {
    let (text, chain) = frames::chain_of(&arm.model, &pipeline.folder)?;
    let base = frames::frame("base", &arm.base, true);
    let tip = frames::frame("tip", &arm.tip, false);
    let mut model = Model::new(chain, Frames { base, tip, markers: Vec::new(), boards: Vec::new() })?;
    frames::override_parameters(&mut model, &arm.parameters)?;
    Ok((ChainArm { name: arm.name.clone(), model }, text))
}

/// One recording before any arm is involved.
fn seen_in(
    pipeline: &ClosedPipeline,
    index: usize,
    entry: &RecordingPaths,
) -> Result<(Recording, ClosedRecording, Fingerprint), Error> {
    let name = entry.name();
    let in_recording = |source| Error::Recording { recording: name.clone(), source };
    let paths: Vec<PathBuf> =
        entry.paths.iter().map(|p| armcal_recording::resolve(&pipeline.folder, p)).collect();
    let recording = Recording::open(&paths).map_err(in_recording)?;
    let (mut streams, mut warnings) = (Vec::new(), Vec::new());
    let mut joints: Vec<JointSamples> = Vec::new();
    for arm in &pipeline.arms {
        let (samples, of_arm, said) = recording.read(&joints_only(&arm.joints)).map_err(in_recording)?;
        joints.push(samples.joints);
        let named = |w: armcal_core::Warning| {
            let subject = format!("{}: {}", arm.name, w.subject);
            armcal_core::Warning { subject, ..w }
        };
        warnings.extend(said.into_iter().map(named));
        streams.extend(of_arm);
    }
    // What was read is known only now.
    let report = RecordingReport { streams, ..recording.report().clone() };
    let names = [0, 1].map(|i| pipeline.arms[i].name.as_str());
    let unjoined = |problem: String| two_arms(format!("recording `{name}`: {problem}"));
    let joints = <[JointSamples; 2]>::try_from(joints)
        .map_err(|_| unjoined("there must be two joint streams".into()))?;
    let joints = join(&joints, names).map_err(unjoined)?;
    let samples = Samples { joints, ..Samples::default() };
    let (dwells, said) = detect_dwells(index, &samples, None, &pipeline.dwell)
        .map_err(|source| Error::Dwell { recording: name.clone(), source })?;
    warnings.extend(said);
    let found =
        ClosedRecording { name, paths: entry.paths.clone(), report, dwells, open: Vec::new(), warnings };
    Ok((recording, found, Fingerprint::of(&samples)))
}

fn joints_only(joints: &JointStream) -> Streams {
    let joints = joints.clone();
    Streams { joints, ..Streams::default() }
}

/// Both arms in every dwell.
fn observations(
    pipeline: &ClosedPipeline,
    seen: &[ClosedRecording],
    count: [usize; 2],
) -> Result<Vec<ClosedObservation>, Error> {
    let contact_sigma_m = pipeline.closed_chain.sigma_mm * 1e-3;
    let all: Vec<ClosedObservation> = seen
        .iter()
        .flat_map(|s| &s.dwells)
        .map(|dwell| {
            let arms = [of_arm(dwell, 0, count[0]), of_arm(dwell, count[0], count[1])];
            ClosedObservation { arms, contact_sigma_m }
        })
        .collect();
    check_both_move(pipeline, &all)?;
    Ok(all)
}

fn check_both_move(pipeline: &ClosedPipeline, dwells: &[ClosedObservation]) -> Result<(), Error> {
    for (index, arm) in pipeline.arms.iter().enumerate() {
        let own: Vec<_> = dwells.iter().map(|o| o.arms[index].clone()).collect();
        check_moves(&arm.name, &own, LEAST_MOTION_RAD)?;
    }
    Ok(())
}

/// Places the base that nobody knows, and finds the dwells that the nominal arms may have closed: both together, because
/// an open dwell would pull the base away.
fn placed(
    pipeline: &ClosedPipeline,
    mut chain: ClosedChain,
    all: &[ClosedObservation],
) -> Result<(ClosedChain, Vec<bool>), Error> {
    let limit_m = pipeline.closed_chain.max_gap_mm * 1e-3;
    let mut near = vec![true; all.len()];
    for _ in 0..MAX_ROUNDS {
        let joined = chosen(all, &near);
        enough(&chain, &joined, all.len(), limit_m)?;
        chain.place_bases(&joined)?;
        // A link's length must not pull the base: the frames alone are fitted before a dwell is judged.
        let start = closed_chain_nominal(&chain, &joined, &pipeline.fit)?;
        let problem = ClosedChainProblem::new(&chain, all)?;
        let again: Vec<bool> =
            (0..all.len()).map(|i| problem.closing_error_m(i, &start).norm() <= limit_m).collect();
        if again == near {
            break;
        }
        near = again;
    }
    let joined = chosen(all, &near);
    enough(&chain, &joined, all.len(), limit_m)?;
    check_both_move(pipeline, &joined)?;
    Ok((chain, near))
}

fn with_effects(
    pipeline: &ClosedPipeline,
    chain: ClosedChain,
    all: &[ClosedObservation],
) -> Result<ClosedChain, Error> {
    let mut arms = chain.arms().clone();
    for (index, (arm, section)) in arms.iter_mut().zip(&pipeline.arms).enumerate() {
        if section.effects.is_empty() {
            continue;
        }
        let joints = arm.model.chain().joint_names();
        let specs = section.effects.iter().map(|table| table.spec(joints)).collect::<Result<Vec<_>, _>>()?;
        let own: Vec<_> = all.iter().map(|o| o.arms[index].clone()).collect();
        arm.model = arm.model.with_effects(&specs, &Session::of(&own))?;
    }
    Ok(ClosedChain::new(arms, chain.closure())?)
}

struct Settled {
    chain: ClosedChain,
    joined: Vec<ClosedObservation>,
    open: Vec<Rejection>,
    calibration: Calibration,
}

/// Calibrates, and leaves out what turns out not to have been joined, until every dwell stays where it is.
fn settled(
    pipeline: &ClosedPipeline,
    chain: ClosedChain,
    all: &[ClosedObservation],
    near: Vec<bool>,
) -> Result<Settled, Error> {
    let limit_m = pipeline.closed_chain.max_gap_mm * 1e-3;
    let mut is_joined = near.clone();
    let mut rounds = 0;
    loop {
        rounds += 1;
        let joined = chosen(all, &is_joined);
        enough(&chain, &joined, all.len(), limit_m)?;
        let last = rounds == MAX_ROUNDS;
        // Only the last fit is judged; those on the way to it need no hold-out.
        let search = calibrate_closed_chain(&chain, &joined, &pipeline.fit, &HoldoutConfig::None)?;
        let (p, scale) = (search.fit.values(), search.fit.sigma_scale.max(1.0));
        let problem = ClosedChainProblem::new(&chain, all)?;
        let error_m = |i: usize| problem.closing_error_m(i, &p).norm();
        let expected_m = |i: usize| expected_norm_m(&problem.closing_covariance_m2(i, &p)) * scale;
        let again: Vec<bool> =
            (0..all.len()).map(|i| near[i] && error_m(i) <= OPEN_FACTOR * expected_m(i)).collect();
        if again != is_joined && !last {
            is_joined = again;
            continue;
        }
        let why = |i: usize| {
            format!(
                "the tips are not joined: the calibrated arms are {:.1} mm from closing, the noise explains {:.2} mm",
                error_m(i) * 1e3,
                expected_m(i) * 1e3
            )
        };
        let open = (0..all.len())
            .filter(|&i| !is_joined[i])
            .map(|i| Rejection { dwell: all[i].dwell(), why: why(i) })
            .collect();
        let calibration = calibrate_closed_chain(&chain, &joined, &pipeline.fit, &pipeline.holdout)?;
        return Ok(Settled { chain, joined, open, calibration });
    }
}

fn chosen(all: &[ClosedObservation], which: &[bool]) -> Vec<ClosedObservation> {
    all.iter().zip(which).filter(|(_, chosen)| **chosen).map(|(o, _)| o.clone()).collect()
}

/// Three points place a base, six distances do; twice as many also show which dwells do not belong. A pose held twice
/// counts once.
fn enough(chain: &ClosedChain, joined: &[ClosedObservation], all: usize, limit_m: f64) -> Result<(), Error> {
    let least = match chain.closure() {
        Closure::SamePoint => 6,
        Closure::RigidLink { .. } => 12,
    };
    let poses = different_poses(joined);
    if poses >= least {
        return Ok(());
    }
    Err(two_arms(format!(
        "{} of {all} dwells of both arms have their tips within {:.0} mm of closing, in {poses} different poses; {least} are \
         the least that place one arm against the other and show which dwells do not belong: record more poses with the \
         tips joined, or check joint names, signs and units, arms.base, closed_chain.length_mm and closed_chain.max_gap_mm",
        joined.len(),
        limit_m * 1e3
    )))
}

/// Poses that differ from all earlier ones by [`LEAST_MOTION_RAD`] in some joint.
fn different_poses(joined: &[ClosedObservation]) -> usize {
    let joints =
        |o: &ClosedObservation| o.arms.iter().flat_map(|a| a.joint_rad.clone()).collect::<Vec<f64>>();
    let mut poses: Vec<Vec<f64>> = Vec::new();
    for q in joined.iter().map(joints) {
        let same = |pose: &Vec<f64>| pose.iter().zip(&q).all(|(a, b)| (a - b).abs() < LEAST_MOTION_RAD);
        if !poses.iter().any(same) {
            poses.push(q);
        }
    }
    poses.len()
}

fn two_arms(problem: String) -> Error {
    Error::TwoArms { problem }
}
