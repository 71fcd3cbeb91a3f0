//! Results of two arms in a closed chain: the same tables, names and files as for one arm, with a prefix an arm.
//!
//! `ClosedRun -> write_closed -> files`: `run.mcap`, `report.html`, `summary.json`, `parameters.toml`, and each arm's calibrated model in the form it
//! came in. An error is a closing error here: how far the joined tips are from where each arm puts the other.

mod files;
mod page;
mod story;
mod terminal;

pub use files::{CLOSED_SCHEMA, closed_files, closed_summary_json, write_closed};
pub use terminal::closed_terminal;

use crate::channels::first_ns;
use crate::recording_names::RecordingNames;
use crate::run::{Status, status_of, without_repeats};
use armcal_calibrate::{Calibration, ClosedChain, ClosedObservation};
use armcal_core::{Dwell, Rejection, Warning};
use armcal_recording::RecordingReport;
use std::path::PathBuf;

/// A finished run of two arms.
#[derive(Debug, Clone)]
pub struct ClosedRun {
    /// Name of the pipeline.
    pub pipeline_name: String,
    /// Text of the pipeline, so that the result can be reproduced from itself.
    pub pipeline_text: String,
    /// Both arms with their nominal parameters, and how they are joined.
    pub chain: ClosedChain,
    /// Text of each arm's model file, in the order of the chain.
    pub model_texts: [String; 2],
    /// Recordings in the order of the pipeline.
    pub recordings: Vec<ClosedRecording>,
    /// Dwells with the tips joined.
    pub observations: Vec<ClosedObservation>,
    /// The calibration; its residuals are in the order of `observations`.
    pub calibration: Calibration,
    /// What concerns the run as a whole.
    pub warnings: Vec<Warning>,
}

/// One recording of two arms.
#[derive(Debug, Clone)]
pub struct ClosedRecording {
    /// Its name in the pipeline.
    pub name: String,
    /// Its files as given.
    pub paths: Vec<PathBuf>,
    /// What reading found; the streams are one an arm.
    pub report: RecordingReport,
    /// Dwells in which both arms stood still, the joints of the first arm before those of the second.
    pub dwells: Vec<Dwell>,
    /// Those in which the tips were not joined, and how that is known.
    pub open: Vec<Rejection>,
    /// What the user should know about it.
    pub warnings: Vec<Warning>,
}

impl ClosedRun {
    /// The gravest thing any warning says.
    pub fn status(&self) -> Status {
        status_of(
            self.recordings.iter().flat_map(ClosedRecording::all_warnings).chain(self.overall_warnings()),
        )
    }

    /// Warnings that are not about one recording, each once.
    pub fn overall_warnings(&self) -> Vec<&Warning> {
        without_repeats(self.warnings.iter().chain(&self.calibration.warnings))
    }
}

impl ClosedRun {
    /// Its recordings as sentences call them.
    pub(crate) fn recording_names(&self) -> RecordingNames {
        RecordingNames::new(self.recordings.iter().map(|r| r.name.clone()))
    }

    /// One arm's part of the joints of both.
    pub(crate) fn of_arm<'q>(&self, arm: usize, joint_rad: &'q [f64]) -> &'q [f64] {
        let first = self.chain.arms()[0].model.joint_count().min(joint_rad.len());
        if arm == 0 { &joint_rad[..first] } else { &joint_rad[first..] }
    }

    /// When the first recording begins [ns]: a viewer opens the file there, and draws nothing that comes later.
    pub(crate) fn start_ns(&self) -> i64 {
        self.recordings.iter().filter_map(|r| first_ns(&r.report, &r.dwells)).min().unwrap_or(0)
    }

    /// When the last dwell ends [ns].
    pub(crate) fn end_ns(&self) -> i64 {
        self.recordings.iter().flat_map(|r| &r.dwells).map(|d| d.end_ns).max().unwrap_or(0)
    }
}

impl ClosedRecording {
    /// Warnings of reading and of the stages after it, each once.
    pub fn all_warnings(&self) -> Vec<&Warning> {
        without_repeats(self.report.warnings.iter().chain(&self.warnings))
    }
}
