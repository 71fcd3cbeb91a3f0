//! What one recording showed before any table or fit is involved.

use crate::readings::Readings;
use armcal_core::{Dwell, Load, Warning};
use armcal_dwell::{ClockAlignment, MeanPose};
use armcal_recording::{Fingerprint, RecordingReport};
use std::sync::Arc;

/// What one recording showed before any table or fit is involved.
#[derive(Clone)]
pub struct RecordingData {
    /// Name in the pipeline.
    pub name: String,
    /// Load at the tip, of several arms the first one's [kg].
    pub load_kg: f64,
    /// Loads at other points of the arm.
    pub more_loads: Vec<Load>,
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
    /// How far each body that should stand still was from its median position, by its role; all but the worst hundredth
    /// of its frames [m].
    pub travels_m: Vec<(&'static str, f64)>,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// What tells whether another recording holds the same readings.
    pub fingerprint: Arc<Fingerprint>,
    /// What the joints' readings look like by themselves.
    pub readings: Readings,
}
