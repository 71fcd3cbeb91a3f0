//! The virtual laboratory: the paper's rig, or another arm, at work, and what a recorder saw of it.
//!
//! `LabConfig -> Rig -> Session (Plan, Engine) -> Log -> recording and sealed Truth`, one seed, the same bytes.
//!
//! | step | module | physics |
//! |---|---|---|
//! | build the rig | [`rig`], [`arm`], [`board`] | joint axes as lines in space, cavities off by their tolerance |
//! | carry out the task | [`plan`], [`session`], [`commands`] | cavities forward, backward, at random; pauses; free poses; set-points from a file |
//! | move | [`engine`], [`spline`], [`servo`], [`hand`] | cubic splines, inverse kinematics, PID against inertia and gravity; a guiding hand |
//! | hide something | [`mechanism`], [`mechanisms`] | gaps, springs, growing links, slipping pulleys: `[[mechanisms]]` |
//! | watch | [`sensors`] | counts, camera noise, occlusion, clocks, transport |
//! | write | [`record`], [`truth`] | ROS 2 messages in MCAP; what was true, for assertions only |
//!
//! [`observe`] goes the same way without streams, one reading a dwell, in milliseconds. [`planted`] draws rigs with
//! one thing hidden, and seals them: recordings in one folder, the truth in another. [`pair`] joins the tips of two arms.
//!
//! The lab shares no formula with the models that are fitted to its recordings: it lays joint axes out as
//! lines and turns points about them, where the models multiply matrices.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::print_stdout))]
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod arm;
pub mod board;
mod checks;
pub mod commands;
pub mod config;
pub mod engine;
mod error;
pub mod hand;
pub mod mechanism;
pub mod mechanisms;
pub mod pair;
pub mod plan;
pub mod planted;
pub mod quick;
pub mod random;
pub mod record;
pub mod rig;
pub mod scenario;
pub mod screw;
pub mod sensors;
pub mod servo;
pub mod session;
pub mod spline;
pub mod trace;
pub mod truth;

pub use config::LabConfig;
pub use error::LabError;
pub use mechanism::{Body, Mechanism, MechanismFactory, Named, RigState, nothing_hidden};
pub use quick::{Nominal, NominalBoard, Observed, observe, observe_from};
pub use trace::RestKind;
pub use truth::{DwellTruth, RecordingTruth, SetPointTruth, Truth};

use armcal_recording::input;
use engine::Pace;
use rig::Rig;
use sensors::Log;
use session::Session;
use std::path::{Path, PathBuf};

/// What a simulation left on disk.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated<T = Truth> {
    /// One file a recording, in the order of the session.
    pub recordings: Vec<PathBuf>,
    /// The truth file.
    pub truth: PathBuf,
    /// What it says.
    pub facts: T,
}

/// Simulates a session with what `[[mechanisms]]` hides in it, and writes `<recording>.mcap` and `truth.json` into
/// `out_dir`, made if need be. Relative paths of the configuration start at `base_dir`.
pub fn simulate(config: &LabConfig, base_dir: &Path, out_dir: &Path) -> Result<Simulated, LabError> {
    simulate_with(config, base_dir, out_dir, &nothing_hidden)
}

/// The same with more mechanisms hidden in the rig.
pub fn simulate_with(
    config: &LabConfig,
    base_dir: &Path,
    out_dir: &Path,
    mechanisms: &MechanismFactory<'_>,
) -> Result<Simulated, LabError> {
    note_inputs(config, base_dir);
    may_write(config.recordings.iter().map(|r| r.name.as_str()), out_dir, &out_dir.join(TRUTH))?;
    let (truth, logs) = simulate_in_memory(config, base_dir, mechanisms)?;
    let recordings = write_recordings(&truth, &logs, out_dir)?;
    let path = out_dir.join(TRUTH);
    truth::write_json(&truth, &path)?;
    Ok(Simulated { recordings, truth: path, facts: truth })
}

/// Name of the truth beside its recordings.
pub(crate) const TRUTH: &str = "truth.json";

/// The file of a recording.
pub(crate) fn recording_file(name: &str) -> String {
    format!("{name}.mcap")
}

/// The files that a configuration names are inputs, before anything is written.
fn note_inputs(config: &LabConfig, base_dir: &Path) {
    input::register_path(&base_dir.join(&config.board.file));
    config.task.set_points.iter().for_each(|told| input::register_path(&base_dir.join(&told.file)));
}

/// Whether recordings of these names and their truth may be written, before they are made.
pub(crate) fn may_write<'a>(
    recordings: impl Iterator<Item = &'a str>,
    folder: &Path,
    truth: &Path,
) -> Result<(), LabError> {
    let recordings = recordings.map(|name| folder.join(recording_file(name)));
    Ok(armcal_recording::may_write_all(recordings.chain([truth.to_owned()]))?)
}

/// Writes the recordings of a session into a folder, made if need be.
pub(crate) fn write_recordings(truth: &Truth, logs: &[Log], folder: &Path) -> Result<Vec<PathBuf>, LabError> {
    make_folder(folder)?;
    let write = |(recording, log): (&RecordingTruth, &Log)| {
        let path = folder.join(&recording.file);
        record::write(&path, &truth.config.name, &recording.name, log).map(|()| path)
    };
    truth.recordings.iter().zip(logs).map(write).collect()
}

pub(crate) fn make_folder(path: &Path) -> Result<(), LabError> {
    Ok(armcal_recording::make_folder(path)?)
}

/// Simulates a session without writing anything: the truth, and one log a recording.
pub fn simulate_in_memory(
    config: &LabConfig,
    base_dir: &Path,
    mechanisms: &MechanismFactory<'_>,
) -> Result<(Truth, Vec<Log>), LabError> {
    config.check()?;
    let rig = Rig::build(config, base_dir)?;
    // Recordings have random streams of their own, so the threads cannot disturb each other.
    let simulate = |recording| {
        let hidden = hidden_in(config).chain(mechanisms(recording)).collect();
        simulate_recording(config, &rig, recording, hidden)
    };
    let made: Vec<Result<(RecordingTruth, Log), LabError>> = std::thread::scope(|scope| {
        let start = |recording| {
            let thread = std::thread::Builder::new().spawn_scoped(scope, move || simulate(recording));
            // Where the system refuses a thread, this one does its work.
            thread.map_err(|_| recording)
        };
        let threads: Vec<_> = (0..config.recordings.len()).map(start).collect();
        let end = |thread: Result<std::thread::ScopedJoinHandle<'_, _>, usize>| match thread {
            Ok(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(recording) => simulate(recording),
        };
        threads.into_iter().map(end).collect()
    });
    let (mut truth, mut logs) = (Truth::of_rig(config, &rig), Vec::new());
    for result in made {
        let (recording, log) = result?;
        truth.recordings.push(recording);
        logs.push(log);
    }
    Ok((truth, logs))
}

/// The mechanisms of the configuration, in their initial state.
fn hidden_in(config: &LabConfig) -> impl Iterator<Item = Box<dyn Mechanism>> {
    config.mechanisms.iter().map(|m| m.mechanism())
}

fn simulate_recording(
    config: &LabConfig,
    rig: &Rig,
    recording: usize,
    mechanisms: Vec<Box<dyn Mechanism>>,
) -> Result<(RecordingTruth, Log), LabError> {
    let session = Session::perform(config, rig, recording, mechanisms, Pace::Full)?;
    if session.trace.duration_s() > config.interval_s && recording + 1 < config.recordings.len() {
        let took_s = session.trace.duration_s().ceil();
        let why = format!("is {}, but a recording takes {took_s} s", config.interval_s);
        return Err(checks::value_error("interval_s", why));
    }
    let log = sensors::record_session(config, recording, &session);
    let occlusions = log.occlusions.clone();
    let truth = RecordingTruth::of_session(config, rig, recording, &session, log.clock, occlusions);
    Ok((truth, log))
}

#[cfg(test)]
mod tests;
