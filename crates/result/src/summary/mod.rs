//! `summary.json` as a value: what a script, a CI job or a campaign table needs to know about a run.
//!
//! The names are a contract ([`SCHEMA`]): fields are added, never renamed. `docs/summary.schema.json` is made of these types.
//! A number that is none is `null`; a length is in millimetres where the name says `_mm`, a parameter in its `unit`.

mod diagnosis;
mod of_run;
mod schema;

pub use diagnosis::{AmplitudeSummary, CandidateSummary, DiagnosisSummary, Explanation, UnlistedSummary};
pub use schema::summary_schema;

use crate::by_marker::MarkerErrors;
use crate::{ObservedFile, Status, TwoArms};
use armcal_core::{SetupReport, Unit, Visited, Warning};
use schemars::JsonSchema;
use serde::Serialize;

/// Version of the contract.
pub const SCHEMA: &str = "armcal.summary/1";

/// A run in brief.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Summary<'a> {
    /// Version of the contract.
    pub schema: &'static str,
    /// Version of armcal.
    pub version: &'static str,
    /// Name of the pipeline.
    pub pipeline: &'a str,
    /// The gravest thing any warning says.
    pub status: Status,
    /// Of two arms whose tips are joined; an error is a closing error then.
    #[serde(flatten)]
    pub joined: Option<TwoArms<'a>>,
    /// In the order of the pipeline.
    pub recordings: Vec<RecordingSummary<'a>>,
    /// What the fit says.
    pub fit: FitSummary<'a>,
    /// Errors by marker, the tip among them; absent of an arm without markers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub markers: Vec<MarkerErrors<'a>>,
    /// What each joint visited in the dwells that were calibrated or held out.
    pub joints: Vec<JointSummary<'a>>,
    /// Base, tip and boards as calibrated.
    pub frames: Vec<FrameEntry>,
    /// The same observations and hold-out with more effects in the model: what was found, step by step, then the best
    /// candidates, each alone.
    pub refits: Vec<RefitSummary<'a>>,
    /// What contradicts the data about the setup, before any physics.
    pub setup: &'a SetupReport,
    /// The answer in one word: a verdict, `setup` or `not_diagnosed`.
    pub answer: &'static str,
    /// The answer in one sentence.
    pub answer_sentence: String,
    /// `null` when the pipeline asks for no diagnosis, when the setup comes first, and when it could not be made.
    pub diagnosis: Option<DiagnosisSummary<'a>>,
    /// What the calibration reached, in one sentence.
    pub conclusion: String,
    /// What concerns the run as a whole.
    pub warnings: Vec<Warning>,
}

/// One recording of a run.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RecordingSummary<'a> {
    /// Its name in the pipeline.
    pub name: &'a str,
    /// Its first file, as given.
    pub path: String,
    /// SHA-256 of its file; of several, that of theirs, one a line.
    pub sha256: String,
    /// Its files.
    pub files: Vec<ObservedFile>,
    /// Dwells found.
    pub dwells: usize,
    /// Dwells that were seated in a cavity; without a board, those the fit could use.
    pub associated: usize,
    /// Dwells that do not take part in the fit.
    pub rejected: Vec<RejectedSummary<'a>>,
    /// Where the tip was, dwell by dwell.
    pub places: Vec<PlaceSummary<'a>>,
    /// 0 where the recording has only the robot's clock; `null` of an earlier result, whose own summary says it.
    pub clock_offset_ms: Option<f64>,
    /// Its standard error; `null` where the offset was declared.
    pub clock_offset_sigma_ms: Option<f64>,
    /// How much faster the sensor's clock runs.
    pub clock_drift_ppm: Option<f64>,
    /// Its standard error.
    pub clock_drift_sigma_ppm: Option<f64>,
    /// Sensor time at which the offset holds: its first stamp.
    pub clock_reference_ns: Option<i64>,
    /// What the stages want to be known about it.
    pub warnings: Vec<&'a Warning>,
}

/// A dwell that does not take part in the fit.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RejectedSummary<'a> {
    /// Index in its recording.
    pub dwell: usize,
    /// The reason.
    pub why: &'a str,
}

/// Where the tip was during a dwell.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PlaceSummary<'a> {
    /// Index in its recording.
    pub dwell: usize,
    /// Its beginning, robot clock.
    pub start_ns: i64,
    /// Its end.
    pub end_ns: i64,
    /// `seated`, `hovering`, `free_space`, `ambiguous`, `unassigned`, `no_board`.
    pub place: &'static str,
    /// The cavity it was seated in.
    pub cavity: Option<&'a str>,
    /// How sure that is, 0 to 1.
    pub confidence: Option<f64>,
}

/// What the fit says.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FitSummary<'a> {
    /// What was minimised.
    pub objective: &'a str,
    /// Effects in the model.
    pub effects: Vec<&'a str>,
    /// `converged` or `iteration_limit`.
    pub status: &'static str,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Mean error that the declared noise alone gives.
    pub noise_floor_mm: f64,
    /// By how much the residuals scatter more than declared.
    pub sigma_scale: f64,
    /// Directions of the parameters that the data determine.
    pub rank: usize,
    /// Points that the fit saw.
    pub train: SideSummary,
    /// Points that it did not.
    pub holdout: SideSummary,
    /// All parameters, free and fixed.
    pub parameters: Vec<ParameterSummary<'a>>,
    /// Covariance of the free ones; of a pool, of those that its recordings share.
    pub covariance: CovarianceSummary<'a>,
    /// Directions that the data leave open, in words.
    pub undetermined: Vec<&'a str>,
    /// Eq. 4 of the paper, where that objective was asked for.
    pub paper: Option<PaperSummary>,
}

/// The paper's objective.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct PaperSummary {
    /// Sum of the distances.
    pub sum_of_distances_mm: f64,
    /// What it may be.
    pub limit_mm: f64,
    /// Whether it is.
    pub feasible: bool,
}

/// Errors of one side of a hold-out. *Nominal* is with nominal robot parameters after fitting only the frames that nobody could
/// know beforehand; both are predictions for points no fit saw on the side `holdout`.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct SideSummary {
    /// Points.
    pub n: usize,
    /// With nominal robot parameters.
    pub nominal_mm: ErrorsSummary,
    /// With the calibrated ones.
    pub fitted_mm: ErrorsSummary,
}

/// Sizes of errors in millimetres; `null` throughout where there is nothing to summarise: zero would read as a perfect result.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct ErrorsSummary {
    /// Mean.
    pub mean: Option<f64>,
    /// Root mean square.
    pub rms: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// Largest.
    pub max: Option<f64>,
}

/// One parameter.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ParameterSummary<'a> {
    /// Its name.
    pub name: &'a str,
    /// Unit of its numbers.
    pub unit: Unit,
    /// Before.
    pub nominal: f64,
    /// Calibrated.
    pub value: f64,
    /// Standard error.
    pub sigma: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Whether the data say anything about it; otherwise the prior keeps it near nominal.
    pub determined: bool,
    /// Whether it wants to go further than its bounds allow.
    pub at_bound: bool,
    /// Whether it was estimated.
    pub free: bool,
    /// `robot`, `estimated_frame`, `known_frame` or `effect`.
    pub role: &'static str,
    /// What it is, in words.
    pub meaning: &'a str,
}

/// Covariance of parameters, in the products of their units.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CovarianceSummary<'a> {
    /// Names of the parameters.
    pub names: Vec<&'a str>,
    /// One row for each.
    pub rows: Vec<Vec<f64>>,
}

/// Where a joint was: between the visited intervals, and beyond them, the calibration knows only what it knows elsewhere.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JointSummary<'a> {
    /// Its name.
    pub name: &'a str,
    /// Unit of its readings.
    pub unit: Unit,
    /// What it visited.
    #[serde(flatten)]
    pub visited: Visited,
}

/// Where a frame lies in its parent.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FrameEntry {
    /// Its name.
    pub frame: String,
    /// The frame it lies in.
    pub parent: String,
    /// Its origin.
    pub xyz_m: [f64; 3],
    /// Roll, pitch and yaw about the fixed x, y, z of the parent.
    pub rpy_deg: [f64; 3],
}

/// Another calibration of the run's observations.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RefitSummary<'a> {
    /// What was added to the run's model.
    pub effects: &'a [String],
    /// Mean error that the declared noise alone gives.
    pub noise_floor_mm: f64,
    /// Points that the fit saw.
    pub train: SideSummary,
    /// Points that it did not.
    pub holdout: SideSummary,
}
