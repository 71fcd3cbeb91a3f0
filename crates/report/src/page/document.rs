//! The one JSON document of the page: everything its scripts draw, worked out already.

use super::shown::{Shown, drawn_drivers, effect_names};
use crate::findings::unlisted_curves;
use armcal_diagnose::{CandidateReport, DependsOn, Diagnosis};
use armcal_model::find;
use armcal_result::proto::ErrorCurve;
use armcal_result::sensitivity::{Basis, Channel, Driver};
use armcal_result::{Column, RecordingNames, Refit, Run};
use armcal_wording::{candidate_sizes, channel_told};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Rows of the ranking.
const RANKED: usize = 12;

/// The document.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Document {
    /// Joints and the other places where an error may enter.
    pub channels: Vec<Channel>,
    /// Drivers drawn for each of the first channels; none for a joint that does not move the tip.
    pub drawn: Vec<Vec<DependsOn>>,
    /// What errors may follow.
    pub drivers: Vec<Driver>,
    /// Direction of arrival, `[joint][dwell]`.
    pub arrival: Vec<Vec<i8>>,
    /// Names of the recordings.
    pub recordings: Vec<String>,
    /// Where they begin on the axis of time, in that order [min]; `null` without dwells.
    pub begin_min: Column,
    /// Effects and parameters in words, by their spelling, where the two differ.
    pub told: BTreeMap<String, String>,
    /// The dwells that became observations.
    pub dwells: Dwells,
    /// Boards with seated dwells, as one recording each saw them.
    pub boards: Vec<Value>,
    /// The run's own calibration, then every refit.
    pub refits: Vec<Shown>,
    /// Geometry and what was found, one effect after the other, by index into `refits`.
    pub path: Vec<usize>,
    /// The ranking.
    pub candidates: Vec<Value>,
    /// Shapes without a listed cause.
    pub unlisted: Vec<Value>,
    /// Effects that the run's own model has.
    pub own_effects: Vec<String>,
}

/// Columns over dwells.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Dwells {
    pub recording: Vec<usize>,
    pub dwell: Vec<usize>,
    pub cavity: Vec<Option<String>>,
    /// The marker that was measured; `null` of the tip.
    pub marker: Vec<Option<String>>,
    /// Measured tip in the world [mm]: x, y, z.
    pub world_mm: [Column; 3],
    /// Measured tip from the base: distance from its vertical axis and height above it [mm].
    pub reach_mm: [Column; 2],
    /// Cavity in its board [mm]: x, y.
    pub board_mm: [Column; 2],
}

impl Document {
    /// Of a run, its steps and its alternatives.
    pub fn of(run: &Run, basis: &Basis) -> Document {
        let all: Vec<&Refit> = run.refits().collect();
        let mut refits = vec![Shown::of_run(run, basis)];
        refits.extend(all.iter().map(|refit| Shown::of(run, basis, refit)));
        let index_of = |effects: &[String]| all.iter().position(|r| r.effects == effects).map(|k| k + 1);
        let path = [0].into_iter().chain(run.steps.iter().filter_map(|s| index_of(&s.effects))).collect();
        let candidates =
            run.diagnosis.iter().flat_map(|d| candidate_rows(d, &run.recording_names(), &index_of)).collect();
        Document {
            channels: basis.sensitivity.channels.clone(),
            drawn: drawn_drivers(basis),
            drivers: basis.drivers.clone(),
            arrival: basis.arrival.clone(),
            recordings: run.recordings.iter().map(|r| r.name.clone()).collect(),
            begin_min: run.recorded_time().begins(),
            told: display_names(run),
            dwells: dwell_columns(run),
            boards: board_maps(run),
            refits,
            path,
            candidates,
            unlisted: unlisted_curves(run).into_iter().map(unlisted_shape).collect(),
            own_effects: effect_names(&run.model),
        }
    }
}

/// Every event that the page names, and every parameter of one, with its moment; what has no name, by where it enters and what
/// it depends on.
fn display_names(run: &Run) -> BTreeMap<String, String> {
    let ranked = run.diagnosis.iter().flat_map(|d| &d.candidates).map(|c| c.spec.clone());
    let refitted = run.refits().flat_map(|r| r.effects.iter().cloned());
    let calibrations = std::iter::once(&run.calibration).chain(run.refits().map(|r| &r.calibration));
    let parameters = calibrations.flat_map(|c| &c.fit.estimates).map(|e| e.parameter.name.clone());
    let all = ranked.chain(refitted).chain(effect_names(&run.model)).chain(parameters);
    let names = run.recording_names();
    let each = all.map(|spec| (names.label(&spec), spec));
    let events = each.filter(|(words, spec)| words != spec).map(|(words, spec)| (spec, words));
    let unlisted = run.diagnosis.iter().flat_map(|d| &d.unlisted).filter_map(|u| {
        let words = format!("unlisted, {} over {}", channel_told(&u.channel), u.driver);
        Some((u.effect()?.to_string(), words))
    });
    events.chain(unlisted).collect()
}

/// The best entries, and below them whatever was found.
fn candidate_rows(
    d: &Diagnosis,
    names: &RecordingNames,
    index_of: &dyn Fn(&[String]) -> Option<usize>,
) -> Vec<Value> {
    let found = |c: &CandidateReport| c.standing.is_some_and(|s| s.in_answer);
    let row = |c: &CandidateReport| {
        let specs: Vec<String> = c.spec.split('+').map(str::to_owned).collect();
        json!({
            "spec": c.spec,
            "summary": find(&c.effect).map_or("", |kind| kind.summary),
            "size": candidate_sizes(c),
            "probability": c.standing.map(|s| s.probability),
            "behind_nats": c.standing.map(|s| s.behind_nats),
            "behind_se": c.standing.map(|s| s.behind_se),
            "p_adjusted": c.p_adjusted,
            "absorbed": c.absorbed,
            "also": c.same_to_the_data.iter().map(|name| names.label(name)).collect::<Value>(),
            // Whether the diagnosis holds it to be missing.
            "found": found(c),
            // Index into `refits`.
            "refit": index_of(&specs),
        })
    };
    let best = d.candidates.iter().take(RANKED);
    let rest = d.candidates.iter().skip(RANKED).filter(|c| found(c));
    best.chain(rest).map(row).collect()
}

fn dwell_columns(run: &Run) -> Dwells {
    let marker = |o: &armcal_core::Observation| run.model.measured_name(o);
    let values = run.calibration.fit.values();
    let measured_m: Vec<_> =
        run.observations.iter().map(|o| run.model.measured_tip_in_world(&values, o)).collect();
    let in_base_m: Vec<_> = measured_m
        .iter()
        .zip(&run.observations)
        .map(|(m, o)| {
            let (model, p) = run.model.in_recording(o.dwell.recording, &values);
            model.base_in_world(&p).inverse() * nalgebra::Point3::from(*m)
        })
        .collect();
    let cavity_mm = |axis: usize| {
        Column::of(run.observations.iter().map(|o| o.in_board_m().map(|in_board_m| in_board_m[axis] * 1e3)))
    };
    Dwells {
        recording: run.observations.iter().map(|o| o.dwell.recording).collect(),
        dwell: run.observations.iter().map(|o| o.dwell.dwell).collect(),
        cavity: run.observations.iter().map(|o| o.cavity().map(str::to_owned)).collect(),
        marker: run.observations.iter().map(marker).collect(),
        world_mm: [0, 1, 2].map(|axis| Column::of_all(measured_m.iter().map(|m| m[axis] * 1e3))),
        reach_mm: [
            Column::of_all(in_base_m.iter().map(|m| m.x.hypot(m.y) * 1e3)),
            Column::of_all(in_base_m.iter().map(|m| m.z * 1e3)),
        ],
        board_mm: [cavity_mm(0), cavity_mm(1)],
    }
}

fn board_maps(run: &Run) -> Vec<Value> {
    let Some(board) = &run.board else { return Vec::new() };
    let seen =
        |index: usize| run.observations.iter().any(|o| o.dwell.recording == index && o.cavity().is_some());
    let of_axis = |axis: usize| Column::of_all(board.cavities.iter().map(|c| c.in_board_m[axis] * 1e3));
    let names: Vec<&str> = board.cavities.iter().map(|c| c.name.as_str()).collect();
    let map = |recording: usize| {
        // Cavities [mm]: x, y.
        json!({ "recording": recording, "cavities_mm": [of_axis(0), of_axis(1)], "names": names })
    };
    (0..run.recordings.len()).filter(|index| seen(*index)).map(map).collect()
}

/// The curve that Foxglove plots, as a line with half its band.
fn unlisted_shape(([channel, driver], curve): ([String; 2], ErrorCurve)) -> Value {
    let half = curve.high.iter().zip(&curve.low).map(|(high, low)| (high - low) / 2.0);
    json!({
        "channel": channel,
        "driver": driver,
        "driver_unit": curve.driver_unit,
        "unit": curve.unit,
        "at": Column::of_all(curve.at),
        "value": Column::of_all(curve.value),
        "half": Column::of_all(half),
    })
}
