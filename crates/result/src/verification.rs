//! What `armcal verify` found, as a value.

use crate::{Closing, Status, status_of};
use armcal_config::Published;
use armcal_core::Warning;
use armcal_iso9283::Assessment;
use armcal_model_file::Value;
use armcal_verify::{PathError, PathRow, PointsRow};
use nalgebra::Vector3;
use serde::Serialize;
use std::path::PathBuf;

/// A calibrated model against recordings it never saw.
#[derive(Debug, Clone)]
pub struct Verification {
    /// Name of the pipeline of the new recordings.
    pub pipeline: String,
    /// The result whose model was verified.
    pub result: PathBuf,
    /// Its effects beyond geometry that hold here.
    pub effects: Vec<String>,
    /// The new recordings.
    pub recordings: Vec<VerifiedRecording>,
    /// Those of them that the calibration saw.
    pub told: Vec<Told>,
    /// Whether the result would recognise a copy of a recording it was calibrated on, by its dwells; else by its bytes alone.
    pub recognises_copies: bool,
    /// How many of them are of tips that are joined: errors from tip to tip.
    pub closing: Closing,
    /// Errors at points (Table 4 of the source paper).
    pub points: Vec<PointsRow>,
    /// Errors along paths (Table 6, figures 6, 7 and 10).
    pub paths: Vec<PathRow>,
    /// The moving tip, frame by frame.
    pub samples: Vec<PathSample>,
    /// Criteria of ISO 9283.
    pub iso9283: IsoReport,
    /// Old and new parameters (Table 5), SI.
    pub parameters: Vec<Value>,
    /// Numbers of somebody else, to stand beside these.
    pub published: Vec<Published>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// A recording that the calibration saw, whole or in part.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Told {
    /// Its name among the new recordings.
    pub recording: String,
    /// Its dwells in the time that the calibration saw.
    pub dwells: usize,
    /// Of so many.
    pub all: usize,
}

/// Criteria of ISO 9283, against what each model says was commanded.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IsoReport {
    /// Whether commands are recorded set-points; else the encoder readings stand for them.
    pub commands_recorded: bool,
    /// Commands as the nominal model sees them: a controller without calibration.
    pub nominal: Assessment,
    /// Commands as the calibrated model sees them: a controller that compensates.
    pub calibrated: Assessment,
}

/// One new recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerifiedRecording {
    /// Its name.
    pub name: String,
    /// Pauses found.
    pub dwells: usize,
    /// Frames of the moving tip.
    pub moving_samples: usize,
    /// Offset of the sensor's clock [s], where there are two clocks.
    pub clock_offset_s: Option<f64>,
    /// Sensor time at which it holds [ns].
    pub clock_reference_ns: Option<i64>,
    /// Its standard error [s], as the motion tells it.
    pub clock_sigma_s: Option<f64>,
}

/// The moving tip at one moment, in the calibrated base frame [m].
#[derive(Debug, Clone, PartialEq)]
pub struct PathSample {
    /// Name of the recording.
    pub recording: String,
    /// Motion within it, from 0.
    pub motion: usize,
    /// Time on the robot's clock [ns].
    pub time_ns: i64,
    /// Where the sensor saw it.
    pub measured_m: Vector3<f64>,
    /// Where the nominal model puts it.
    pub nominal_m: Vector3<f64>,
    /// Where the calibrated model puts it.
    pub calibrated_m: Vector3<f64>,
}

impl PathSample {
    /// A moment with the name of its recording.
    pub fn of(e: &PathError, recordings: &[String]) -> PathSample {
        PathSample {
            recording: recordings.get(e.motion.recording).cloned().unwrap_or_default(),
            motion: e.motion.dwell,
            time_ns: e.time_ns,
            measured_m: e.measured_m,
            nominal_m: e.before_m,
            calibrated_m: e.after_m,
        }
    }
}

impl Verification {
    /// The gravest thing any warning says.
    pub fn status(&self) -> Status {
        status_of(self.warnings.iter())
    }
}
