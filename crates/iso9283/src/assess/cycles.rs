//! Cycles: visits to one commanded pose from one direction, in order of time.

use crate::evidence::Visit;
use crate::tip_pose::TipPose;
use nalgebra::Vector3;

/// Visits to one commanded pose from one direction.
pub(super) struct Cycles<'a> {
    /// Name of the pose.
    pub pose: &'a str,
    /// Direction of the first approach; none where it is unknown.
    pub direction: Option<Vector3<f64>>,
    /// Whether the pose is approached from another direction too.
    pub one_of_several: bool,
    /// The visits in order of time.
    pub visits: Vec<&'a Visit>,
}

impl Cycles<'_> {
    /// The attained poses in order of time.
    pub fn attained(&self) -> Vec<TipPose> {
        self.visits.iter().map(|visit| visit.attained).collect()
    }

    /// The place in words: the pose, and the direction where there is more than one.
    pub fn at(&self) -> String {
        match self.direction {
            Some(d) if self.one_of_several => {
                format!("{} arriving along ({:+.2}, {:+.2}, {:+.2})", self.pose, d.x, d.y, d.z)
            }
            None if self.one_of_several => format!("{} arriving from unknown directions", self.pose),
            _ => self.pose.to_owned(),
        }
    }

    /// Where the cycles fall short of the standard's.
    pub fn notes(&self) -> Vec<String> {
        let unknown = self.direction.is_none().then(|| "direction of approach unknown".to_owned());
        unknown.into_iter().collect()
    }
}

/// Sorts visits by pose, in order of first appearance, and by direction. A visit belongs to the first direction
/// within `same_rad` [rad], else it opens one.
pub(super) fn by_direction(visits: &[Visit], same_rad: f64) -> Vec<Cycles<'_>> {
    let mut cycles: Vec<Cycles<'_>> = Vec::new();
    for visit in in_time(visits) {
        let direction = visit.approach.and_then(|d| d.try_normalize(0.0));
        let same = |known: &&mut Cycles<'_>| {
            known.pose == visit.pose
                && match (known.direction, direction) {
                    (Some(a), Some(b)) => a.angle(&b) <= same_rad,
                    (None, None) => true,
                    _ => false,
                }
        };
        match cycles.iter_mut().find(same) {
            Some(known) => known.visits.push(visit),
            None => {
                cycles.push(Cycles {
                    pose: &visit.pose,
                    direction,
                    one_of_several: false,
                    visits: vec![visit],
                });
            }
        }
    }
    let poses: Vec<&str> = cycles.iter().map(|c| c.pose).collect();
    for known in &mut cycles {
        known.one_of_several = poses.iter().filter(|pose| **pose == known.pose).count() > 1;
    }
    cycles
}

/// Visits in order of time; of equal times the earlier in the list first.
pub(super) fn in_time(visits: &[Visit]) -> Vec<&Visit> {
    let mut sorted: Vec<&Visit> = visits.iter().collect();
    sorted.sort_by_key(|visit| visit.time_ns);
    sorted
}

/// The cycles of each pose, poses in order of first appearance.
pub(super) fn by_pose<'c, 'a>(cycles: &'c [Cycles<'a>]) -> Vec<(&'a str, Vec<&'c Cycles<'a>>)> {
    let mut poses: Vec<(&str, Vec<&Cycles<'_>>)> = Vec::new();
    for known in cycles {
        match poses.iter_mut().find(|pose| pose.0 == known.pose) {
            Some(pose) => pose.1.push(known),
            None => poses.push((known.pose, vec![known])),
        }
    }
    poses
}
