//! Clauses 7.3, 7.4, 7.5 and 9: what lies between two stops, and how the arm comes to rest.

use super::cycles::{Cycles, in_time};
use crate::catalogue::{
    Component, DISTANCE_ACCURACY, DISTANCE_REPEATABILITY, OVERSHOOT, POSING_TIME, STABILIZATION_TIME,
};
use crate::criterion::{Findings, Place};
use crate::distance::{distance_accuracy, distance_repeatability};
use crate::evidence::{Settings, Visit};
use crate::pose::pose_repeatability;
use crate::settling::{Settling, measure_settling, overshoot_m, posing_time_s, stabilization_time_s};
use crate::tip_pose::TipPose;

/// Moves from one pose to the next, repeated.
struct Moves<'a> {
    from: &'a Visit,
    to: &'a Visit,
    cycles: Vec<[&'a Visit; 2]>,
}

pub(super) fn assess(visits: &[Visit], cycles: &[Cycles<'_>], settings: &Settings, findings: &mut Findings) {
    let moves = moves_between_poses(visits);
    for moved in &moves {
        assess_distance(moved, findings);
    }
    let bands_m: Vec<(&str, f64)> = cycles.iter().filter_map(|known| band_m(known, settings)).collect();
    for known in cycles {
        assess_settling(known, settings, findings);
    }
    for moved in &moves {
        assess_posing(moved, &bands_m, findings);
    }
}

/// Every move within a recording from one commanded pose to another, in order of first appearance.
fn moves_between_poses(visits: &[Visit]) -> Vec<Moves<'_>> {
    let mut moves: Vec<Moves<'_>> = Vec::new();
    let mut sorted = in_time(visits);
    sorted.sort_by_key(|visit| visit.recording);
    let steps = sorted.windows(2).map(|pair| (pair[0], pair[1]));
    for (from, to) in steps.filter(|(from, to)| from.recording == to.recording && from.pose != to.pose) {
        match moves.iter_mut().find(|known| known.from.pose == from.pose && known.to.pose == to.pose) {
            Some(known) => known.cycles.push([from, to]),
            None => moves.push(Moves { from, to, cycles: vec![[from, to]] }),
        }
    }
    moves
}

impl Moves<'_> {
    fn at(&self) -> String {
        format!("{} to {}", self.from.pose, self.to.pose)
    }
}

fn assess_distance(moved: &Moves<'_>, findings: &mut Findings) {
    let at = moved.at();
    let place = Place { at: &at, n: moved.cycles.len(), notes: &[] };
    let attained: Vec<[TipPose; 2]> =
        moved.cycles.iter().map(|[from, to]| [from.attained, to.attained]).collect();
    let accuracy = distance_accuracy(&[moved.from.commanded, moved.to.commanded], &attained);
    for (what, distance) in
        [(&DISTANCE_ACCURACY, accuracy), (&DISTANCE_REPEATABILITY, distance_repeatability(&attained))]
    {
        match distance {
            Ok(distance) => {
                findings.give(what, Component::Position, distance.position_m, &place);
                findings.give_three(what, Component::AXES, &distance.axes_m, &place);
                findings.give_angles(what, distance.angles_rad, &place);
            }
            Err(why) => findings.lack(what, &at, why),
        }
    }
}

/// The limit band [m]: the one declared, else the pose repeatability, which takes two visits.
fn band_m<'a>(known: &Cycles<'a>, settings: &Settings) -> Option<(&'a str, f64)> {
    let repeatability_m =
        || pose_repeatability(&known.attained()).ok().map(|rp| rp.radius_m).filter(|r| *r > 0.0);
    settings.limit_band_m.or_else(repeatability_m).map(|band_m| (known.pose, band_m))
}

fn assess_settling(known: &Cycles<'_>, settings: &Settings, findings: &mut Findings) {
    let at = known.at();
    let lack = |findings: &mut Findings, why: &dyn std::fmt::Display| {
        findings.lack(&STABILIZATION_TIME, &at, why);
        findings.lack(&OVERSHOOT, &at, why);
    };
    let sampled: Vec<&Visit> =
        known.visits.iter().copied().filter(|visit| !visit.arrival.is_empty()).collect();
    let Some((_, band_m)) = band_m(known, settings) else {
        let why = "needs a limit band: declare one, or visit the pose twice from one direction";
        return lack(findings, &why);
    };
    if sampled.is_empty() {
        return lack(findings, &"needs samples of the tip around the stop");
    }
    let settled: Result<Vec<Settling>, _> = sampled
        .iter()
        .map(|visit| measure_settling(&visit.arrival, &visit.attained.position_m, band_m))
        .collect();
    let numbers = settled
        .and_then(|settled| Ok((stabilization_time_s(&settled)?, overshoot_m(&settled)?, settled.len())));
    match numbers {
        Ok((time_s, furthest_m, n)) => {
            let mut notes = known.notes();
            notes.push(format!("limit band {:.3} mm", band_m * 1e3));
            let place = Place { at: &at, n, notes: &notes };
            findings.give(&STABILIZATION_TIME, Component::Only, time_s, &place);
            findings.give(&OVERSHOOT, Component::Only, furthest_m, &place);
        }
        Err(why) => lack(findings, &why),
    }
}

fn assess_posing(moved: &Moves<'_>, bands_m: &[(&str, f64)], findings: &mut Findings) {
    let at = moved.at();
    let Some((_, band_m)) = bands_m.iter().find(|band| band.0 == moved.to.pose) else {
        return findings.lack(&POSING_TIME, &at, "needs a limit band: declare one, or repeat the move");
    };
    let timed =
        moved.cycles.iter().filter_map(|[_, to]| to.departed_ns.map(|departed_ns| (departed_ns, *to)));
    let arrivals = timed.filter(|(_, to)| !to.arrival.is_empty());
    let cycles: Result<Vec<[i64; 2]>, _> = arrivals
        .map(|(departed_ns, to)| {
            Ok([departed_ns, measure_settling(&to.arrival, &to.attained.position_m, *band_m)?.settled_ns])
        })
        .collect();
    match cycles.and_then(|cycles| Ok((posing_time_s(&cycles)?, cycles.len()))) {
        Ok((time_s, n)) => {
            let apart_m = (moved.to.commanded.position_m - moved.from.commanded.position_m).norm();
            let notes = [
                format!("{:.1} mm apart, limit band {:.3} mm", apart_m * 1e3, band_m * 1e3),
                "at the speed of this programme; the standard asks for the fastest".to_owned(),
            ];
            findings.give(&POSING_TIME, Component::Only, time_s, &Place { at: &at, n, notes: &notes });
        }
        Err(crate::IsoError::TooFew { .. }) => findings.lack(&POSING_TIME, &at, POSING_TIME.needs),
        Err(why) => findings.lack(&POSING_TIME, &at, why),
    }
}
