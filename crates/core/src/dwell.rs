//! A dwell: an interval in which the arm stands still, summarised.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Names a dwell for ever: recording in the order of the pipeline, dwell in the order of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct DwellId {
    /// Index of the recording in the pipeline.
    pub recording: usize,
    /// Index of the dwell in its recording, from 0.
    pub dwell: usize,
}

impl std::fmt::Display for DwellId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "recording {} dwell {}", self.recording, self.dwell)
    }
}

/// Direction in which a joint moved last before it came to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Arrival {
    /// The joint arrived moving towards +q.
    Positive,
    /// The joint arrived moving towards -q.
    Negative,
    /// The recording does not show it. Never guessed.
    Unknown,
}

impl Arrival {
    /// +1, -1, or 0 when unknown.
    pub fn sign(self) -> f64 {
        match self {
            Arrival::Positive => 1.0,
            Arrival::Negative => -1.0,
            Arrival::Unknown => 0.0,
        }
    }

    /// Its sign in a table: `+`, `-`, or `.` when unknown.
    pub fn symbol(&self) -> char {
        match self {
            Arrival::Positive => '+',
            Arrival::Negative => '-',
            Arrival::Unknown => '.',
        }
    }
}

/// What the position sensor saw of the tip, or of a marker, during a dwell, in the sensor's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct TipMeasurement {
    /// Robust mean position [m].
    pub position_m: Vector3<f64>,
    /// Covariance of that mean [m^2], autocorrelation taken into account.
    pub covariance_m2: Matrix3<f64>,
    /// Mean orientation, where the stream has one.
    pub orientation: Option<UnitQuaternion<f64>>,
    /// Standard error of the mean orientation per axis [rad].
    pub orientation_sigma_rad: f64,
    /// Sensor frames used.
    pub samples: usize,
    /// Independent frames these are worth.
    pub effective_samples: f64,
}

/// What an instrument read during a dwell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaugeReading {
    /// Robust mean [m].
    pub mean_m: f64,
    /// Standard error of that mean [m], autocorrelation taken into account.
    pub sigma_m: f64,
}

/// One pause of the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Dwell {
    /// Its name.
    pub id: DwellId,
    /// Start on the robot's clock [ns].
    pub start_ns: i64,
    /// End on the robot's clock [ns].
    pub end_ns: i64,
    /// Robust mean of each joint [rad].
    pub joint_rad: Vec<f64>,
    /// Standard deviation of the readings of each joint within the dwell [rad].
    pub joint_spread_rad: Vec<f64>,
    /// Standard error of each mean [rad], autocorrelation and quantisation taken into account.
    pub joint_sigma_rad: Vec<f64>,
    /// Mean measured effort of each joint [N m]; NaN of one without, `None` where no joint has any.
    pub effort_nm: Option<Vec<f64>>,
    /// Encoder readings used.
    pub samples: usize,
    /// Independent readings these are worth.
    pub effective_samples: f64,
    /// Direction of arrival of each joint.
    pub arrival: Vec<Arrival>,
    /// Turning points of each joint's path that a gap in its gear still remembers, oldest first, the last being the
    /// rest itself [rad].
    pub path_memory_rad: Vec<Vec<f64>>,
    /// The same of the sum and of the difference `q_(k+1) + q_k`, `q_(k+1) - q_k` of every two neighbours [rad].
    pub pair_memory_rad: Vec<[Vec<f64>; 2]>,
    /// How far each joint is from where it was in the dwell before [rad]; `None` in the first.
    pub moved_rad: Option<Vec<f64>>,
    /// The tip as the position sensor saw it.
    pub tip: Option<TipMeasurement>,
    /// The markers that it saw, by name.
    pub markers: BTreeMap<String, TipMeasurement>,
    /// Mean temperature [degC].
    pub temperature_c: Option<f64>,
    /// What instruments read, by name.
    pub gauges: BTreeMap<String, GaugeReading>,
}

impl Dwell {
    /// The middle of the dwell [ns].
    pub fn mid_ns(&self) -> i64 {
        self.start_ns + (self.end_ns - self.start_ns) / 2
    }

    /// Duration [s].
    pub fn duration_s(&self) -> f64 {
        (self.end_ns - self.start_ns) as f64 * 1e-9
    }
}
