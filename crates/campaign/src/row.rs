//! One recording of a campaign, calibrated by itself.

use armcal_core::Unit;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What one recording gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name in the campaign.
    pub recording: String,
    /// Its files as given.
    pub paths: Vec<String>,
    /// Size of its files [bytes].
    pub bytes: u64,
    /// What identifies its files; two recordings with the same hold the same.
    pub identity: Vec<String>,
    /// What was declared about its board's tilt, in words; recordings of different tilts have different board poses.
    pub tilt: String,
    /// Load at the tip [kg].
    pub load_kg: f64,
    /// Middle of its first dwell [ns], robot clock.
    pub start_ns: i64,
    /// Middle of its last dwell [ns], robot clock.
    pub end_ns: i64,
    /// Pauses found.
    pub dwells: usize,
    /// Of these, seated in a cavity (without a board: used).
    pub associated: usize,
    /// Of these, rejected.
    pub rejected: usize,
    /// Whether the result can be relied upon.
    pub status: Status,
    /// Errors of the nominal arm where the fit did not look.
    pub nominal: ErrorFigures,
    /// Errors of the calibrated arm where the fit did not look.
    pub calibrated: ErrorFigures,
    /// Error that noise alone would leave [m].
    pub noise_floor_m: f64,
    /// What the diagnosis says, in one line; empty where nobody asked.
    pub verdict: String,
    /// Effects it names, as a pipeline writes them.
    pub missing: Vec<String>,
    /// Warnings, in words.
    pub warnings: Vec<String>,
    /// The severity of each of them, as outputs write it; empty in rows of earlier versions.
    #[serde(default)]
    pub severities: Vec<String>,
    /// What may change over months: parameters, the board's pose, errors.
    pub quantities: Vec<Quantity>,
}

impl Row {
    /// Takes the names of its quantities from those of other rows, and no more room than it needs: thousands of rows have few
    /// names.
    pub fn share_names(&mut self, names: &mut BTreeSet<Arc<str>>) {
        self.quantities.shrink_to_fit();
        for q in &mut self.quantities {
            match names.get(&q.name) {
                Some(known) => q.name = known.clone(),
                None => _ = names.insert(q.name.clone()),
            }
        }
    }
}

/// Whether a result can be relied upon; decides between exit codes 0 and 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Nothing speaks against the result.
    Ok,
    /// The model or the data are inadequate.
    Inadequate,
    /// Data of the input were damaged or could not be used.
    DataLost,
}

impl Status {
    /// The status as outputs write it.
    pub fn word(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::Inadequate => "inadequate",
            Status::DataLost => "data_lost",
        }
    }
}

/// Position errors [m]; null throughout where there are none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ErrorFigures {
    /// Positions.
    pub n: usize,
    /// Mean.
    pub mean_m: Option<f64>,
    /// Root mean square.
    pub rms_m: Option<f64>,
    /// 95th percentile.
    pub p95_m: Option<f64>,
    /// Largest.
    pub max_m: Option<f64>,
}

/// A number that can be followed from recording to recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// Its name, the same in every recording: `joint1.theta`, `board_in_base.x`, `error.mean`.
    pub name: Arc<str>,
    /// Unit of value and standard error.
    pub unit: Unit,
    /// Its value in this recording.
    pub value: f64,
    /// Standard error, where it is known.
    pub sigma: Option<f64>,
    /// Whether the recording determines it; what a prior keeps near nominal tells nothing.
    pub determined: bool,
    /// Whether it wants to go further than its bounds allow.
    pub at_bound: bool,
}
