//! `summary.json`: what a script, a CI job or a campaign table needs to know about a run.
//!
//! The names are a contract (`armcal.summary/1`): fields are added, never renamed. Every number is
//! finite or `null`; a length is in millimetres where the name says `_mm`, a parameter in its `unit`.
//!
//! `nominal_mm` is the error with nominal robot parameters after fitting only the frames that nobody
//! could know beforehand (base, tool, a board whose pose is estimated); `fitted_mm` is the error with
//! the calibrated parameters. On the `holdout` side both are predictions for points no fit saw.

use crate::ReportError;
use crate::diagnosis_summary::diagnosis_summary;
use crate::parameters::frames;
use armcal_calibrate::{Calibration, Estimate, SideErrors};
use armcal_core::{Dwell, ErrorStats, Visited};
use armcal_result::by_marker::by_marker;
use armcal_result::{RecordingRun, Refit, Run, TwoArms, VERSION, visited};
use armcal_table::{Assignment, Place};
use armcal_wording::{answer, conclusion};
use serde_json::{Value, json};
use std::path::Path;

/// Version of the contract.
pub const SCHEMA: &str = "armcal.summary/1";

/// The summary of a run: indented JSON with a final newline.
///
/// # Errors
/// A recording that cannot be read once more for its hash.
pub fn summary_json(run: &Run) -> Result<String, ReportError> {
    Ok(format!("{:#}\n", summary(run)?))
}

fn summary(run: &Run) -> Result<Value, ReportError> {
    let answer = answer(run);
    let begin = json!({
        "schema": SCHEMA,
        "version": VERSION,
        "pipeline": run.pipeline_name,
        "status": run.status(),
    });
    let what = json!({
        "recordings": run.recordings.iter().map(|r| recording(run, r)).collect::<Result<Value, _>>()?,
        "fit": fit(&run.calibration),
    });
    let markers = by_marker(run);
    let rest = json!({
        // What each joint visited in the dwells that were calibrated or held out.
        "joints": joints(run),
        // Base, tip and boards as calibrated.
        "frames": frames(run),
        // The same observations and hold-out with more effects in the model: what was found, step by step, then the best
        // candidates, each alone.
        "refits": run.refits().map(refit).collect::<Value>(),
        // What contradicts the data about the setup, before any physics.
        "setup": run.setup,
        // The answer in one word (a verdict, `setup` or `not_diagnosed`), and in one sentence.
        "answer": answer.word,
        "answer_sentence": answer.sentence,
        // `null` when the pipeline asks for no diagnosis, when the setup comes first, and when it could not be made.
        "diagnosis": run.diagnosis.as_ref().map(diagnosis_summary),
        "conclusion": conclusion(&run.calibration),
        "warnings": run.overall_warnings(),
    });
    Ok(joined([
        begin,
        // Of two arms whose tips are joined: their names, how, and the length of a link. An error is a closing error then.
        json!(TwoArms::of(run)),
        what,
        // Errors by marker, the tip among them; absent of an arm without markers.
        if markers.is_empty() { Value::Null } else { json!({ "markers": markers }) },
        rest,
    ]))
}

/// One object with the fields of several, in their order; `null` has none.
fn joined(parts: impl IntoIterator<Item = Value>) -> Value {
    let fields =
        parts.into_iter().filter_map(|part| if let Value::Object(own) = part { Some(own) } else { None });
    Value::Object(fields.flatten().collect())
}

/// Where each joint was: between the visited intervals, and beyond them, the calibration knows only what it knows elsewhere.
fn joints(run: &Run) -> Value {
    let chain = run.model.chain();
    let visited = visited(&run.model, &run.observations);
    let joint = |(index, visited): (usize, Visited)| {
        joined([
            json!({ "name": chain.joint_names()[index], "unit": chain.joint_unit(index) }),
            json!(visited),
        ])
    };
    visited.into_iter().enumerate().map(joint).collect()
}

fn recording(run: &Run, r: &RecordingRun) -> Result<Value, ReportError> {
    let clock = r.clock.as_ref();
    // What is declared has no standard error.
    let estimated = clock.filter(|c| !c.declared);
    let rejected = r.rejections.iter().map(|x| json!({ "dwell": x.dwell.dwell, "why": x.why }));
    Ok(json!({
        "name": r.name,
        "path": r.paths.first().map(|p| path_text(p)).unwrap_or_default(),
        "sha256": r.sha256()?,
        "files": r.files(),
        "dwells": r.found(),
        "associated": run.associated(r),
        "rejected": rejected.collect::<Value>(),
        "places": r.dwells.iter().enumerate().map(|(i, d)| place(d, r.assignments().get(i))).collect::<Value>(),
        // 0 when the recording has only the robot's clock; then there is no standard error either. `null` of an earlier
        // result, whose own summary says it.
        "clock_offset_ms": r.earlier.is_none().then(|| clock.map_or(0.0, |c| c.offset_s * 1e3)),
        "clock_offset_sigma_ms": estimated.map(|c| c.offset_sigma_s * 1e3),
        "clock_drift_ppm": clock.map(|c| c.drift * 1e6),
        "clock_drift_sigma_ppm": estimated.map(|c| c.drift_sigma * 1e6),
        // Sensor time at which the offset holds.
        "clock_reference_ns": clock.map(|c| c.reference_ns),
        "warnings": r.all_warnings(),
    }))
}

/// Where the tip was during a dwell.
fn place(dwell: &Dwell, assignment: Option<&Assignment>) -> Value {
    let place = assignment.map(|a| &a.place);
    let (cavity, confidence) = match place {
        Some(Place::Seated { cavity, confidence }) => (Some(cavity), Some(confidence)),
        _ => (None, None),
    };
    json!({
        "dwell": dwell.id.dwell,
        "start_ns": dwell.start_ns,
        "end_ns": dwell.end_ns,
        "place": place.map_or("no_board", Place::word),
        "cavity": cavity,
        "confidence": confidence,
    })
}

fn refit(refit: &Refit) -> Value {
    let c = &refit.calibration;
    json!({
        // What was added to the run's model.
        "effects": refit.effects,
        "noise_floor_mm": c.noise_floor_m * 1e3,
        "train": side(&c.train),
        "holdout": side(&c.holdout),
    })
}

/// What the fit says.
pub(crate) fn fit(c: &Calibration) -> Value {
    json!({
        "objective": c.fit.objective,
        "effects": armcal_result::effects(c),
        "status": armcal_result::status_word(c.fit.status),
        "iterations": c.fit.iterations,
        "noise_floor_mm": c.noise_floor_m * 1e3,
        "sigma_scale": c.fit.sigma_scale,
        "rank": c.fit.rank,
        "train": side(&c.train),
        "holdout": side(&c.holdout),
        "parameters": c.fit.estimates.iter().map(parameter).collect::<Value>(),
        "undetermined": c.fit.undetermined.iter().map(|u| u.text.as_str()).collect::<Value>(),
        // Eq. 4 of the paper, when that objective was asked for.
        "paper": c.fit.paper.map(|p| json!({
            "sum_of_distances_mm": p.sum_of_distances_m * 1e3,
            "limit_mm": p.limit_m * 1e3,
            "feasible": p.feasible,
        })),
    })
}

/// Errors of one side of a hold-out.
pub(crate) fn side(errors: &SideErrors) -> Value {
    json!({
        "n": errors.fitted.n,
        "nominal_mm": error_summary(&errors.nominal),
        "fitted_mm": error_summary(&errors.fitted),
    })
}

/// Errors in millimetres; `null` throughout when there is nothing to summarise: zero would read as a perfect result.
pub(crate) fn error_summary(stats: &ErrorStats) -> Value {
    let mm = |value_m: f64| (stats.n > 0).then_some(value_m * 1e3);
    json!({ "mean": mm(stats.mean_m), "rms": mm(stats.rms_m), "p95": mm(stats.p95_m), "max": mm(stats.max_m) })
}

/// One parameter.
pub(crate) fn parameter(e: &Estimate) -> Value {
    json!({
        "name": e.parameter.name,
        "unit": e.parameter.unit,
        "nominal": e.parameter.nominal,
        "value": e.value,
        "sigma": e.sigma,
        "ci95": e.ci95,
        "determined": e.determined,
        "at_bound": e.at_bound,
        "free": e.parameter.free,
        "role": armcal_result::role_word(e.parameter.role),
    })
}

/// A path as text; bytes that are not Unicode become U+FFFD so that the document stays valid JSON.
fn path_text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
