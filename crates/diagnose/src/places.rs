//! Which dwells are visits to the same place, which are too alike to speak for one another, and which of very many weigh.

use crate::config::DiagnosisConfig;
use crate::problem::Problem;
use armcal_calibrate::{MIN_CAVITIES, measured_together};
use armcal_core::Observation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Joint difference below which two tracked dwells are visits to the same pose [rad].
const SAME_POSE_RAD: f64 = 0.01;
/// Poses this close in every joint predict one another whatever is missing: they are left out together [rad]
/// (3 deg; half the length over which joint error curves of real arms stay alike).
const ALIKE_RAD: f64 = 0.052;

/// Independent unit of each dwell: its place, or its neighbourhood in joint space where places are few or unknown.
pub(crate) fn units(problem: &Problem) -> Vec<usize> {
    let mut known: BTreeMap<&str, usize> = BTreeMap::new();
    for place in problem.dwells.iter().filter_map(|d| d.place.as_deref()) {
        let next = known.len();
        known.entry(place).or_insert(next);
    }
    // Where places are few, the poses at them are the sample: a ball in one of two sockets says nothing about the
    // socket, everything about the arm.
    let enough = known.len() >= MIN_CAVITIES;
    let mut leaders: Vec<usize> = Vec::new();
    let mut unit = Vec::with_capacity(problem.dwells.len());
    for (i, d) in problem.dwells.iter().enumerate() {
        if let Some(place) = d.place.as_deref().filter(|_| enough) {
            unit.push(known[place]);
            continue;
        }
        let alike = |l: &usize| {
            let other = &problem.dwells[*l].joint_rad;
            other.iter().zip(&d.joint_rad).all(|(a, b)| (a - b).abs() < ALIKE_RAD)
        };
        let at = leaders.iter().position(alike).unwrap_or_else(|| {
            leaders.push(i);
            leaders.len() - 1
        });
        unit.push(known.len() + at);
    }
    unit
}

/// The observations of at most `max_weighed` poses: one drawn from each of as many equal stretches of time, so that every
/// part of the session and, as motions go, of joint space keeps its share. The draw keeps clear of a regular motion's period.
pub(crate) fn thinned<'o>(observations: &'o [Observation], config: &DiagnosisConfig) -> Vec<&'o Observation> {
    let poses = measured_together(observations);
    let (n, most) = (poses.len(), config.max_weighed);
    if n <= most {
        return observations.iter().collect();
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|i| observations[poses[*i].start].dwell);
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed ^ 0x7417);
    let mut drawn: Vec<usize> =
        (0..most).map(|k| order[rng.random_range(k * n / most..(k + 1) * n / most)]).collect();
    drawn.sort_unstable();
    drawn.into_iter().flat_map(|i| &observations[poses[i].clone()]).collect()
}

/// [`places`] of each pose of these observations.
pub(crate) fn places_of_poses(observations: &[Observation]) -> Vec<Option<String>> {
    let poses = measured_together(observations);
    places(&poses.iter().map(|pose| &observations[pose.start]).collect::<Vec<_>>())
}

/// The cavity; for a tracked pose the pose itself, where it was visited more than once. One observation of each pose is asked.
pub(crate) fn places(observations: &[&Observation]) -> Vec<Option<String>> {
    let same = |a: &Observation, b: &Observation| {
        a.joint_rad.len() == b.joint_rad.len()
            && a.joint_rad.iter().zip(&b.joint_rad).all(|(a, b)| (a - b).abs() < SAME_POSE_RAD)
    };
    let mut poses: Vec<(usize, usize)> = Vec::new();
    let mut member = vec![None; observations.len()];
    for (i, o) in observations.iter().enumerate().filter(|(_, o)| o.cavity().is_none()) {
        let known = poses.iter().position(|(first, _)| same(observations[*first], o));
        let k = known.unwrap_or_else(|| {
            poses.push((i, 0));
            poses.len() - 1
        });
        poses[k].1 += 1;
        member[i] = Some(k);
    }
    let name = |(i, o): (usize, &&Observation)| match (o.cavity(), member[i]) {
        (Some(cavity), _) => Some(cavity.to_owned()),
        (None, Some(k)) if poses[k].1 > 1 => Some(format!("pose {}", k + 1)),
        _ => None,
    };
    observations.iter().enumerate().map(name).collect()
}
