//! Time series as columns. Each stream has one clock, strictly increasing in time.

use nalgebra::{UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// Joint readings; `joint_rad[j][i]` is joint `j` at `time_ns[i]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointSamples {
    /// Time of each row [ns].
    pub time_ns: Vec<i64>,
    /// Joint names in the order of the columns.
    pub names: Vec<String>,
    /// Angle of each joint [rad] (a prismatic joint: [m]), one column a joint.
    pub joint_rad: Vec<Vec<f64>>,
    /// Measured joint effort [N m], one column a joint; NaN where it is missing, `None` where all of it is.
    pub effort_nm: Option<Vec<Vec<f64>>>,
    /// How far the clock of the stamps is ahead of log time, typically [s]; none where they are not of the sender.
    pub ahead_of_log_s: Option<f64>,
}

impl JointSamples {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_ns.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.time_ns.is_empty()
    }

    /// All joints at row `i` [rad].
    pub fn row_rad(&self, i: usize) -> Vec<f64> {
        self.joint_rad.iter().map(|column| column[i]).collect()
    }
}

/// Clocks that are further apart by log time are of other epochs [s].
const EPOCH_S: f64 = 1.0;

/// Below this many rows a second, movements are lost between them.
pub const FEW_PER_S: f64 = 4.0;
/// Below this many no clock can be told from them: most moves have no row.
const NO_MOTION_PER_S: f64 = 1.0;

/// Poses of one tracked body in the frame of its sensor. Occluded frames are already removed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PoseSamples {
    /// Frame the poses are expressed in, as the recording names it.
    pub frame_id: String,
    /// The tracked body, as the recording names it.
    pub body: String,
    /// Time of each row [ns].
    pub time_ns: Vec<i64>,
    /// Position of the body [m].
    pub position_m: Vec<Vector3<f64>>,
    /// Orientation of the body, where the stream has one; same length as `position_m`.
    pub orientation: Option<Vec<UnitQuaternion<f64>>>,
    /// How far the clock of the stamps is ahead of log time, typically [s]; none where they are not of the sender.
    pub ahead_of_log_s: Option<f64>,
}

impl PoseSamples {
    /// Whether it has fewer rows than show how a body moves: one pose a stop, as of a camera that is triggered.
    pub fn is_one_a_stop(&self) -> bool {
        self.len() > 1 && self.rows_per_s() < FEW_PER_S
    }

    /// Whether moves go by between its rows, so that they show no clock.
    pub fn shows_no_motion(&self) -> bool {
        self.len() > 1 && self.rows_per_s() < NO_MOTION_PER_S
    }

    fn rows_per_s(&self) -> f64 {
        let span_ns = self.time_ns.last().zip(self.time_ns.first()).map_or(0, |(last, first)| last - first);
        (self.len() - 1) as f64 / (span_ns as f64 * 1e-9)
    }

    /// Stamps of a clock that runs so many times as fast as time, on one that does not; the first stays.
    pub fn slow_down(&mut self, rate: f64) {
        // How far ahead the clock was, was of what it no longer is.
        self.ahead_of_log_s = None;
        let first = self.time_ns.first().copied().unwrap_or_default();
        self.time_ns.iter_mut().for_each(|t| *t = first + ((*t - first) as f64 / rate).round() as i64);
    }

    /// How far its clock is ahead of that of the joints, if messages of both were logged as soon as they were stamped [s].
    pub fn clock_ahead_s(&self, joints: &JointSamples) -> Option<f64> {
        Some(self.ahead_of_log_s? - joints.ahead_of_log_s?)
    }

    /// The same where the clocks are of other epochs; 0 of clocks that are near each other.
    pub fn other_epoch_s(&self, joints: &JointSamples) -> f64 {
        self.clock_ahead_s(joints).filter(|s| s.abs() > EPOCH_S).unwrap_or(0.0)
    }

    /// How much later it begins than the joints do [s], where the two never overlap: made on two computers whose clocks nobody set;
    /// 0 of streams that overlap.
    pub fn apart_s(&self, joints: &JointSamples) -> f64 {
        let ends = |time_ns: &[i64]| Some((*time_ns.first()?, *time_ns.last()?));
        match ends(&self.time_ns).zip(ends(&joints.time_ns)) {
            Some((own, of)) if own.1 < of.0 || of.1 < own.0 => own.0.saturating_sub(of.0) as f64 * 1e-9,
            _ => 0.0,
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_ns.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.time_ns.is_empty()
    }
}

/// One scalar over time, such as a temperature [degC].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ScalarSamples {
    /// Time of each row [ns].
    pub time_ns: Vec<i64>,
    /// Value of each row, in the unit the stream is declared in.
    pub value: Vec<f64>,
}

/// Everything a pipeline reads out of one recording.
///
/// `joints` is on the robot's clock; the tracked bodies share the sensor's clock until
/// `armcal-dwell` has aligned them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Samples {
    /// Encoder readings.
    pub joints: JointSamples,
    /// What the controller asked of the joints, on the robot's clock.
    pub set_points: Option<JointSamples>,
    /// The tip (or the marker on the end effector).
    pub tip: Option<PoseSamples>,
    /// Markers on the arm, by name.
    pub bodies: BTreeMap<String, PoseSamples>,
    /// The robot's base.
    pub base: Option<PoseSamples>,
    /// The calibration table.
    pub table: Option<PoseSamples>,
    /// Temperature [degC].
    pub temperature: Option<ScalarSamples>,
    /// What instruments read [m], by name, on the robot's clock.
    pub gauges: BTreeMap<String, ScalarSamples>,
}
