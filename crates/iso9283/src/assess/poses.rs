//! Clauses 7.2 and 7.6 from visits.

use super::cycles::{Cycles, by_pose};
use crate::catalogue::{
    ACCURACY_DRIFT, ACCURACY_VARIATION, Component, POSE_ACCURACY, POSE_REPEATABILITY, REPEATABILITY_DRIFT,
};
use crate::criterion::{Findings, Place};
use crate::drift::{accuracy_drift, repeatability_drift};
use crate::pose::{accuracy_variation, pose_accuracy, pose_repeatability};
use crate::settling::elapsed_s;
use crate::tip_pose::TipPose;

/// How long the standard watches for drift [h].
const DRIFT_H: f64 = 8.0;

/// Accuracy, repeatability and drift of every pose, one direction at a time.
pub(super) fn assess(cycles: &[Cycles<'_>], findings: &mut Findings) {
    for known in cycles {
        let (at, notes, attained) = (known.at(), known.notes(), known.attained());
        let place = Place { at: &at, n: attained.len(), notes: &notes };
        match pose_accuracy(&known.visits[0].commanded, &attained) {
            Ok(ap) => {
                findings.give(&POSE_ACCURACY, Component::Position, ap.position_m, &place);
                findings.give_three(&POSE_ACCURACY, Component::AXES, &ap.axes_m, &place);
                findings.give_angles(&POSE_ACCURACY, ap.angles_rad, &place);
            }
            Err(why) => findings.lack(&POSE_ACCURACY, &at, why),
        }
        if attained.len() < 2 {
            findings.lack(
                &POSE_REPEATABILITY,
                &at,
                format!("{}; it was visited once", POSE_REPEATABILITY.needs),
            );
        } else {
            match pose_repeatability(&attained) {
                Ok(rp) => {
                    findings.give(&POSE_REPEATABILITY, Component::Radius, rp.radius_m, &place);
                    findings.give_angles(&POSE_REPEATABILITY, rp.angles_rad, &place);
                }
                Err(why) => findings.lack(&POSE_REPEATABILITY, &at, why),
            }
        }
        assess_drift(known, &place, findings);
    }
}

/// Drift from the first block of cycles to later ones: ten cycles a block as in the standard, or half of what there
/// are.
fn assess_drift(known: &Cycles<'_>, place: &Place<'_>, findings: &mut Findings) {
    let attained = known.attained();
    let size = (attained.len() / 2).min(ACCURACY_DRIFT.cycles);
    if size < 2 {
        for what in [&ACCURACY_DRIFT, &REPEATABILITY_DRIFT] {
            findings.lack(what, place.at, format!("{}; fewer than 4 visits from one direction", what.needs));
        }
        return;
    }
    let blocks: Vec<Vec<TipPose>> = attained.chunks_exact(size).map(<[TipPose]>::to_vec).collect();
    let ends = [&known.visits[0], &known.visits[known.visits.len() - 1]];
    let hours = elapsed_s(ends[0].time_ns, ends[1].time_ns) / 3600.0;
    let short = (hours < DRIFT_H).then(|| format!("over {hours:.2} h instead of {DRIFT_H} h"));
    let notes: Vec<String> = place.notes.iter().cloned().chain(short).collect();
    let place = Place { at: place.at, n: size, notes: &notes };
    let commanded = &known.visits[0].commanded;
    findings.tell_deviation(&ACCURACY_DRIFT, accuracy_drift(commanded, &blocks), &place);
    findings.tell_deviation(&REPEATABILITY_DRIFT, repeatability_drift(&blocks), &place);
}

/// Multi-directional pose accuracy variation of every pose.
pub(super) fn assess_directions(cycles: &[Cycles<'_>], findings: &mut Findings) {
    for (pose, cycles) in by_pose(cycles) {
        let directed: Vec<&Cycles<'_>> = cycles.into_iter().filter(|c| c.direction.is_some()).collect();
        let Some((three, spread_deg)) = most_perpendicular(&directed) else {
            let why = format!("{}; this recording has {}", ACCURACY_VARIATION.needs, directed.len());
            findings.lack(&ACCURACY_VARIATION, pose, why);
            continue;
        };
        let attained: Vec<Vec<TipPose>> = three.iter().map(|c| c.attained()).collect();
        let n = attained.iter().map(Vec::len).min().unwrap_or(0);
        let [low, high] = spread_deg;
        let oblique = high - low > 1.0 || (low - 90.0).abs() > 1.0;
        let oblique =
            oblique.then(|| format!("directions are {low:.0} to {high:.0} deg apart instead of 90"));
        let notes: Vec<String> = oblique.into_iter().collect();
        let place = Place { at: pose, n, notes: &notes };
        findings.tell_deviation(&ACCURACY_VARIATION, accuracy_variation(&attained), &place);
    }
}

/// The three directions nearest to perpendicular, and the smallest and largest angle between any two of them [deg].
/// Directions that were repeated come before those that were not, and the thirty-two most visited are enough to
/// choose from.
fn most_perpendicular<'c, 'a>(directed: &[&'c Cycles<'a>]) -> Option<([&'c Cycles<'a>; 3], [f64; 2])> {
    let mut known = directed.to_vec();
    known.sort_by_key(|c| std::cmp::Reverse(c.visits.len()));
    known.truncate(32);
    let repeated = known.iter().filter(|c| c.visits.len() > 1).count();
    if repeated >= 3 {
        known.truncate(repeated);
    }
    let mut best: Option<([&Cycles<'_>; 3], f64)> = None;
    for (i, a) in known.iter().enumerate() {
        for (j, b) in known.iter().enumerate().skip(i + 1) {
            for c in known.iter().skip(j + 1) {
                let volume = a.direction?.dot(&b.direction?.cross(&c.direction?)).abs();
                if best.as_ref().is_none_or(|best| volume > best.1) {
                    best = Some(([a, b, c], volume));
                }
            }
        }
    }
    let three = best?.0;
    let mut angles_deg = [0.0; 3];
    for (angle_deg, (h, k)) in angles_deg.iter_mut().zip([(0, 1), (0, 2), (1, 2)]) {
        *angle_deg = three[h].direction?.angle(&three[k].direction?).to_degrees();
    }
    angles_deg.sort_by(f64::total_cmp);
    Some((three, [angles_deg[0], angles_deg[2]]))
}
