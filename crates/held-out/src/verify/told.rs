//! What the result knows of the new recordings, and where they go beyond it.

use armcal_core::{Code, DwellId, Observation, Samples, Severity, Stage, Unit, Visited, Warning};
use armcal_model::{Chain, Model, PlacedEffect};
use armcal_recording::{FileReport, sha256_of};
use armcal_result::Told;
use armcal_result::{DwellMark, StoredModel, also_in};
use armcal_stages::RecordingData;
use std::collections::BTreeMap;

/// The recordings that the calibration saw: the same files, or, re-encoded or cut, the same dwells.
pub fn recordings_in_calibration(past: &StoredModel, seen: &[RecordingData]) -> Vec<Told> {
    let of = |s: &RecordingData| {
        let marks: Vec<DwellMark> =
            s.dwells.iter().map(|d| DwellMark::of(d.mid_ns(), &d.joint_rad)).collect();
        let known = |identity: &String| past.recordings.iter().any(|r| r.identity.contains(identity));
        // A model of an earlier version knows files by their SHA-256, which has no name before it.
        let by_sha256 = past.recordings.iter().flat_map(|r| &r.identity).any(|known| !known.contains(':'));
        let is_file = |f: &FileReport| {
            known(&f.identity)
                || by_sha256 && f.object.is_none() && sha256_of(&f.path).is_ok_and(|hash| known(&hash))
        };
        if !s.report.files.is_empty() && s.report.files.iter().all(is_file) {
            return Some(Told { recording: s.name.clone(), dwells: marks.len(), all: marks.len() });
        }
        let known = past.recordings.iter().filter_map(|r| r.dwells.as_ref());
        let in_each: Vec<Vec<bool>> = known.map(|known| also_in(&marks, known)).collect();
        let dwells = (0..marks.len()).filter(|i| in_each.iter().any(|in_one| in_one[*i])).count();
        (dwells > 0).then(|| Told { recording: s.name.clone(), dwells, all: marks.len() })
    };
    seen.iter().filter_map(of).collect()
}

/// A recording that the calibration saw proves nothing.
pub fn not_held_out(told: &Told) -> Warning {
    let Told { recording, dwells, all } = told;
    let part = if dwells == all { String::new() } else { format!(" in {dwells} of its {all} dwells") };
    let message = format!(
        "the calibration was made from this recording{part}: its error here says nothing about new ones"
    );
    let subject = format!("recording `{recording}`");
    Warning::new(Severity::Inadequate, Stage::Recording, Code::NotHeldOut, subject, message)
}

/// One warning a joint that stands or moves where no dwell of the calibration was near.
pub fn beyond_calibrated(
    chain: &Chain,
    visited: &[Visited],
    observations: &[Observation],
    samples: &[Samples],
) -> Vec<Warning> {
    let of_joint = |(joint, visited): (usize, &Visited)| {
        let name = chain.joint_names().get(joint)?;
        let unit = chain.joint_unit(joint);
        let outside = |q: &f64| !visited.is_near(*q);
        // What was seen of several points in a dwell is one dwell.
        let of_dwell = |o: &Observation| Some((o.dwell, *o.joint_rad.get(joint)?));
        let dwells: BTreeMap<DwellId, f64> = observations.iter().filter_map(of_dwell).collect();
        let dwells: Vec<f64> = dwells.into_values().collect();
        let readings = || samples.iter().filter_map(|s| s.joints.joint_rad.get(joint)).flatten();
        let (far_dwells, all) = (dwells.iter().filter(|q| outside(q)).count(), readings().count());
        let far = readings().filter(|q| outside(q)).count();
        if far_dwells == 0 && far == 0 {
            return None;
        }
        let percent = 100.0 * far as f64 / all.max(1) as f64;
        let percent = if percent < 1.0 { "less than 1".to_owned() } else { format!("{percent:.0}") };
        let slides = unit == Unit::Metre;
        let beyond = Visited::of(readings().chain(&dwells).copied().filter(|q| outside(q)), slides);
        let message = format!(
            "{far_dwells} of {} dwells and {percent} % of all readings are further than {} from every dwell of the \
             calibration (bins {}; calibrated: {}): the error there is extrapolated, not covered by it",
            dwells.len(),
            value_text(visited.bin, unit),
            intervals_text(&beyond, unit),
            intervals_text(visited, unit),
        );
        Some(Warning::new(
            Severity::Notice,
            Stage::Calibrate,
            Code::BeyondCalibratedRange,
            name.clone(),
            message,
        ))
    };
    visited.iter().enumerate().filter_map(of_joint).collect()
}

/// What follows a measured effort, in dwells that have none.
pub fn effort_unknown(model: &Model, observations: &[Observation]) -> Vec<Warning> {
    let of = |effect: &PlacedEffect| {
        let joint = effect.spec.target.filter(|_| effect.spec.kind == "effort_compliance")?;
        let without = observations.iter().filter(|o| o.effort_of(joint).is_none()).count();
        let message = format!(
            "{without} of {} dwells have no measured effort of `{}`, which it follows: there it is left at zero",
            observations.len(),
            model.chain().joint_names()[joint],
        );
        let (severity, stage) = (Severity::Notice, Stage::Calibrate);
        let warning = || Warning::new(severity, stage, Code::EffortUnknown, effect.spec.to_string(), message);
        (without > 0).then(warning)
    };
    model.effects().iter().filter_map(of).collect()
}

fn intervals_text(visited: &Visited, unit: Unit) -> String {
    let one = |[low, high]: &[f64; 2]| format!("{:.0} to {}", unit.to_display(*low), value_text(*high, unit));
    visited.intervals.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn value_text(si: f64, unit: Unit) -> String {
    format!("{:.0} {}", unit.to_display(si), unit.display_symbol())
}
