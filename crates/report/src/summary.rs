//! `summary.json`: what a script, a CI job or a campaign table needs to know about a run.
//!
//! The names are a contract (`armcal.summary/1`): fields are added, never renamed. Every number is
//! finite or `null`; a length is in millimetres where the name says `_mm`, a parameter in its `unit`.
//!
//! `nominal_mm` is the error with nominal robot parameters after fitting only the frames that nobody
//! could know beforehand (base, tool, a board whose pose is estimated); `fitted_mm` is the error with
//! the calibrated parameters. On the `holdout` side both are predictions for points no fit saw.

use crate::by_marker::{MarkerErrors, by_marker};
use crate::diagnosis_summary::DiagnosisSummary;
use crate::parameters::{FrameEntry, frames};
use crate::past_model::visited;
use crate::past_observations::ObservedFile;
use crate::run::{RecordingRun, Refit, Run, Status, VERSION};
use crate::text::conclusion;
use crate::two_arms::TwoArms;
use armcal_calibrate::{Calibration, Estimate, SideErrors};
use armcal_core::{Dwell, ErrorStats, SetupReport, Unit, Visited, Warning};
use armcal_table::{Assignment, Place};
use serde::Serialize;
use std::path::Path;

/// Version of the contract.
pub const SCHEMA: &str = "armcal.summary/1";

/// The summary of a run: indented JSON with a final newline.
pub fn summary_json(run: &Run) -> String {
    let json = serde_json::to_string_pretty(&Summary::of(run));
    json.expect("strings, numbers and lists under literal names always serialise") + "\n"
}

#[derive(Debug, Clone, Serialize)]
struct Summary<'a> {
    schema: &'static str,
    version: &'static str,
    pipeline: &'a str,
    status: Status,
    /// Of two arms whose tips are joined: their names, how, and the length of a link. An error is a closing error then.
    #[serde(flatten)]
    two_arms: Option<TwoArms<'a>>,
    recordings: Vec<RecordingSummary<'a>>,
    fit: FitSummary<'a>,
    /// Errors by marker, the tip among them; absent of an arm without markers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    markers: Vec<MarkerErrors<'a>>,
    /// What each joint visited in the dwells that were calibrated or held out.
    joints: Vec<JointSummary<'a>>,
    /// Base, tip and boards as calibrated.
    frames: Vec<FrameEntry>,
    /// The same observations and hold-out with more effects in the model: what was found, step by step, then the best
    /// candidates, each alone.
    refits: Vec<RefitSummary<'a>>,
    /// What contradicts the data about the setup, before any physics.
    setup: &'a SetupReport,
    /// The answer in one word (a verdict, `setup` or `not_diagnosed`), and in one sentence.
    answer: &'static str,
    answer_sentence: String,
    /// `null` when the pipeline asks for no diagnosis, when the setup comes first, and when it could not be made.
    diagnosis: Option<DiagnosisSummary<'a>>,
    conclusion: String,
    warnings: Vec<Warning>,
}

#[derive(Debug, Clone, Serialize)]
struct RecordingSummary<'a> {
    name: &'a str,
    path: String,
    sha256: String,
    files: Vec<ObservedFile>,
    dwells: usize,
    associated: usize,
    rejected: Vec<RejectedDwell<'a>>,
    places: Vec<DwellPlace<'a>>,
    /// 0 when the recording has only the robot's clock; then there is no standard error either. `null` of an earlier result,
    /// whose own summary says it.
    clock_offset_ms: Option<f64>,
    clock_offset_sigma_ms: Option<f64>,
    clock_drift_ppm: Option<f64>,
    clock_drift_sigma_ppm: Option<f64>,
    /// Sensor time at which the offset holds.
    clock_reference_ns: Option<i64>,
    warnings: Vec<&'a Warning>,
}

#[derive(Debug, Clone, Serialize)]
struct RejectedDwell<'a> {
    dwell: usize,
    why: &'a str,
}

/// Where the tip was during a dwell.
#[derive(Debug, Clone, Serialize)]
struct DwellPlace<'a> {
    dwell: usize,
    start_ns: i64,
    end_ns: i64,
    place: &'static str,
    cavity: Option<&'a str>,
    confidence: Option<f64>,
}

/// Where a joint was: between the visited intervals, and beyond them, the calibration knows only what it knows elsewhere.
#[derive(Debug, Clone, Serialize)]
struct JointSummary<'a> {
    name: &'a str,
    unit: Unit,
    #[serde(flatten)]
    visited: Visited,
}

/// What the fit says.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct FitSummary<'a> {
    objective: &'a str,
    effects: Vec<&'a str>,
    status: &'static str,
    iterations: usize,
    noise_floor_mm: f64,
    sigma_scale: f64,
    rank: usize,
    train: SideSummary,
    holdout: SideSummary,
    pub(crate) parameters: Vec<ParameterSummary<'a>>,
    undetermined: Vec<&'a str>,
    paper: Option<PaperSummary>,
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct SideSummary {
    n: usize,
    nominal_mm: ErrorSummary,
    fitted_mm: ErrorSummary,
}

/// `null` throughout when there is nothing to summarise: zero would read as a perfect result.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct ErrorSummary {
    mean: Option<f64>,
    rms: Option<f64>,
    p95: Option<f64>,
    max: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct ParameterSummary<'a> {
    name: &'a str,
    unit: Unit,
    nominal: f64,
    value: f64,
    sigma: f64,
    ci95: [f64; 2],
    determined: bool,
    at_bound: bool,
    free: bool,
    role: &'static str,
}

#[derive(Debug, Clone, Serialize)]
struct RefitSummary<'a> {
    /// What was added to the run's model.
    effects: &'a [String],
    noise_floor_mm: f64,
    train: SideSummary,
    holdout: SideSummary,
}

/// Eq. 4 of the paper, when that objective was asked for.
#[derive(Debug, Clone, Serialize)]
struct PaperSummary {
    sum_of_distances_mm: f64,
    limit_mm: f64,
    feasible: bool,
}

impl<'a> Summary<'a> {
    fn of(run: &'a Run) -> Summary<'a> {
        let answer = run.answer();
        Summary {
            schema: SCHEMA,
            version: VERSION,
            pipeline: &run.pipeline_name,
            status: run.status(),
            two_arms: TwoArms::of(run),
            recordings: run.recordings.iter().map(|r| recording(run, r)).collect(),
            fit: fit(&run.calibration),
            markers: by_marker(run),
            joints: joints(run),
            frames: frames(run),
            refits: run.refits().map(refit).collect(),
            setup: &run.setup,
            answer: answer.word,
            answer_sentence: answer.sentence,
            diagnosis: run.diagnosis.as_ref().map(DiagnosisSummary::of),
            conclusion: conclusion(&run.calibration),
            warnings: run.overall_warnings(),
        }
    }
}

fn joints(run: &Run) -> Vec<JointSummary<'_>> {
    let chain = run.model.chain();
    let visited = visited(&run.model, &run.observations);
    let joint = |(index, visited): (usize, Visited)| JointSummary {
        name: chain.joint_names()[index].as_str(),
        unit: chain.joint_unit(index),
        visited,
    };
    visited.into_iter().enumerate().map(joint).collect()
}

fn recording<'a>(run: &'a Run, r: &'a RecordingRun) -> RecordingSummary<'a> {
    let clock = r.clock.as_ref();
    // What is declared has no standard error.
    let estimated = clock.filter(|c| !c.declared);
    RecordingSummary {
        name: &r.name,
        path: r.paths.first().map(|p| path_text(p)).unwrap_or_default(),
        sha256: r.sha256(),
        files: r.files(),
        dwells: r.found(),

        associated: run.associated(r),
        rejected: r.rejections.iter().map(|x| RejectedDwell { dwell: x.dwell.dwell, why: &x.why }).collect(),
        places: r.dwells.iter().enumerate().map(|(i, d)| place(d, r.assignments().get(i))).collect(),
        clock_offset_ms: r.earlier.is_none().then(|| clock.map_or(0.0, |c| c.offset_s * 1e3)),
        clock_offset_sigma_ms: estimated.map(|c| c.offset_sigma_s * 1e3),
        clock_drift_ppm: clock.map(|c| c.drift * 1e6),
        clock_drift_sigma_ppm: estimated.map(|c| c.drift_sigma * 1e6),
        clock_reference_ns: clock.map(|c| c.reference_ns),
        warnings: r.all_warnings(),
    }
}

fn place<'a>(dwell: &Dwell, assignment: Option<&'a Assignment>) -> DwellPlace<'a> {
    let (place, cavity, confidence) = match assignment.map(|a| &a.place) {
        None => ("no_board", None, None),
        Some(Place::Seated { cavity, confidence }) => ("seated", Some(cavity.as_str()), Some(*confidence)),
        Some(Place::Hovering { .. }) => ("hovering", None, None),
        Some(Place::FreeSpace) => ("free_space", None, None),
        Some(Place::Ambiguous { .. }) => ("ambiguous", None, None),
        Some(Place::Unassigned { .. }) => ("unassigned", None, None),
    };
    DwellPlace {
        dwell: dwell.id.dwell,
        start_ns: dwell.start_ns,
        end_ns: dwell.end_ns,
        place,
        cavity,
        confidence,
    }
}

fn refit(refit: &Refit) -> RefitSummary<'_> {
    let c = &refit.calibration;
    RefitSummary {
        effects: &refit.effects,
        noise_floor_mm: c.noise_floor_m * 1e3,
        train: side(&c.train),
        holdout: side(&c.holdout),
    }
}

/// What the fit says.
pub(crate) fn fit(c: &Calibration) -> FitSummary<'_> {
    FitSummary {
        objective: &c.fit.objective,
        effects: crate::run::effects(c),
        status: crate::run::status_word(c.fit.status),
        iterations: c.fit.iterations,
        noise_floor_mm: c.noise_floor_m * 1e3,
        sigma_scale: c.fit.sigma_scale,
        rank: c.fit.rank,
        train: side(&c.train),
        holdout: side(&c.holdout),
        parameters: c.fit.estimates.iter().map(parameter).collect(),
        undetermined: c.fit.undetermined.iter().map(|u| u.text.as_str()).collect(),
        paper: c.fit.paper.map(|p| PaperSummary {
            sum_of_distances_mm: p.sum_of_distances_m * 1e3,
            limit_mm: p.limit_m * 1e3,
            feasible: p.feasible,
        }),
    }
}

/// Errors of one side of a hold-out.
pub(crate) fn side(errors: &SideErrors) -> SideSummary {
    SideSummary {
        n: errors.fitted.n,
        nominal_mm: error_summary(&errors.nominal),
        fitted_mm: error_summary(&errors.fitted),
    }
}

/// Errors in millimetres.
pub(crate) fn error_summary(stats: &ErrorStats) -> ErrorSummary {
    let mm = |value_m: f64| (stats.n > 0).then_some(value_m * 1e3);
    ErrorSummary { mean: mm(stats.mean_m), rms: mm(stats.rms_m), p95: mm(stats.p95_m), max: mm(stats.max_m) }
}

/// One parameter.
pub(crate) fn parameter(e: &Estimate) -> ParameterSummary<'_> {
    ParameterSummary {
        name: &e.parameter.name,
        unit: e.parameter.unit,
        nominal: e.parameter.nominal,
        value: e.value,
        sigma: e.sigma,
        ci95: e.ci95,
        determined: e.determined,
        at_bound: e.at_bound,
        free: e.parameter.free,
        role: crate::run::role_word(e.parameter.role),
    }
}

/// A path as text; bytes that are not Unicode become U+FFFD so that the document stays valid JSON.
fn path_text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
