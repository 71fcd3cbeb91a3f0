//! Which dwells are visits to the same place, which are too alike to speak for one another, and which of very many weigh.

use crate::config::DiagnosisConfig;
use crate::problem::{DwellRow, Problem};
use armcal_calibrate::{AlikePoses, MIN_CAVITIES, SAME_POSE_RAD, measured_together};
use armcal_core::Observation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Poses this close in every joint predict one another whatever is missing: they are left out together [rad]
/// (3 deg; half the length over which joint error curves of real arms stay alike).
const ALIKE_RAD: f64 = 0.052;

/// Independent unit of each dwell: its place, or its neighbourhood in joint space where places are few or unknown.
pub(crate) fn independent_units(problem: &Problem) -> Vec<usize> {
    let mut known: BTreeMap<&str, usize> = BTreeMap::new();
    for place in problem.dwells.iter().filter_map(|d| d.place.as_deref()) {
        let next = known.len();
        known.entry(place).or_insert(next);
    }
    // Where places are few, the poses at them are the sample: a ball in one of two sockets says nothing about the
    // socket, everything about the arm.
    let enough = known.len() >= MIN_CAVITIES;
    let mut poses = AlikePoses::within(ALIKE_RAD);
    let unit = |d: &DwellRow| match d.place.as_deref().filter(|_| enough) {
        Some(place) => known[place],
        None => known.len() + poses.group_of(&d.joint_rad),
    };
    problem.dwells.iter().map(unit).collect()
}

/// The observations of at most `max_weighed` poses: one drawn from each of as many equal stretches of time, so that every
/// part of the session and, as motions go, of joint space keeps its share. The draw keeps clear of a regular motion's period.
pub(crate) fn thin_observations<'o>(
    observations: &'o [Observation],
    config: &DiagnosisConfig,
) -> Vec<&'o Observation> {
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

/// [`place_names`] of each pose of these observations.
pub(crate) fn places_of_poses(observations: &[Observation]) -> Vec<Option<String>> {
    let poses = measured_together(observations);
    place_names(&poses.iter().map(|pose| &observations[pose.start]).collect::<Vec<_>>())
}

/// The cavity; for a tracked pose the pose itself, where it was visited more than once. One observation of each pose is asked.
pub(crate) fn place_names(observations: &[&Observation]) -> Vec<Option<String>> {
    let mut poses = AlikePoses::within(SAME_POSE_RAD);
    let pose = |o: &&Observation| o.cavity().is_none().then(|| poses.group_of(&o.joint_rad));
    let member: Vec<Option<usize>> = observations.iter().map(pose).collect();
    let mut visits = vec![0; poses.groups()];
    member.iter().flatten().for_each(|k| visits[*k] += 1);
    let name = |(o, member): (&&Observation, Option<usize>)| match (o.cavity(), member) {
        (Some(cavity), _) => Some(cavity.to_owned()),
        (None, Some(k)) if visits[k] > 1 => Some(format!("pose {}", k + 1)),
        _ => None,
    };
    observations.iter().zip(member).map(name).collect()
}
