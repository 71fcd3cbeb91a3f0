//! Where an attained path crosses the measuring planes of the command path.
//!
//! A plane is crossed again on the way back, on the far side of a circle, and many times by a tip that trembles at rest. Of
//! all crossings in the command's direction those are taken that follow one another in time and lie closest to the
//! commanded poses, all together. A plane that has none nearby stays without a crossing.

use crate::command::Plane;
use crate::settling::between_ns;
use crate::tip_pose::{TimedPose, TipPose};

/// Where and when a path crossed a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The pose on the plane, interpolated linearly.
    pub pose: TipPose,
    /// When [ns].
    pub time_ns: i64,
}

/// One possible crossing, and the best chain of crossings that ends with it.
struct Candidate {
    /// Index of the sample before, and the fraction of the way to the next: orders crossings in time.
    at: (usize, f64),
    crossing: Crossing,
    cost_m: f64,
    before: Option<usize>,
}

/// The crossing of every plane by `run`, or none. A crossing further than `reach_m` [m] from the commanded pose does not
/// belong to the path.
pub fn cross(planes: &[Plane], run: &[TimedPose], reach_m: f64) -> Vec<Option<Crossing>> {
    let mut candidates: Vec<Candidate> = Vec::new();
    let mut plane_of: Vec<usize> = Vec::new();
    for (index, plane) in planes.iter().enumerate() {
        let earlier = candidates.len();
        for (at, crossing) in crossings(plane, run) {
            let distance_m = (crossing.pose.position_m - plane.pose.position_m).norm();
            if distance_m <= reach_m {
                // Every plane crossed saves `reach_m`, so that a chain leaves out no crossing that it could have.
                let before = cheapest(&candidates[..earlier], at);
                let cost_m = distance_m - reach_m + before.map_or(0.0, |b| candidates[b].cost_m);
                candidates.push(Candidate { at, crossing, cost_m, before });
                plane_of.push(index);
            }
        }
    }
    let mut found = vec![None; planes.len()];
    let mut next = cheapest(&candidates, (usize::MAX, 0.0));
    while let Some(index) = next {
        found[plane_of[index]] = Some(candidates[index].crossing);
        next = candidates[index].before;
    }
    found
}

/// The cheapest chain among those that end before `at`; the first of equals.
fn cheapest(candidates: &[Candidate], at: (usize, f64)) -> Option<usize> {
    let earlier = candidates.iter().enumerate().filter(|(_, candidate)| candidate.at < at);
    earlier.min_by(|a, b| a.1.cost_m.total_cmp(&b.1.cost_m)).map(|(index, _)| index)
}

/// All crossings of a plane from behind to before it.
fn crossings(plane: &Plane, run: &[TimedPose]) -> Vec<((usize, f64), Crossing)> {
    let beyond_m: Vec<f64> =
        run.iter().map(|s| plane.normal.dot(&(s.pose.position_m - plane.pose.position_m))).collect();
    let upward = (1..run.len()).filter(|&k| beyond_m[k - 1] < 0.0 && beyond_m[k] >= 0.0);
    upward
        .map(|k| {
            let s = beyond_m[k - 1] / (beyond_m[k - 1] - beyond_m[k]);
            let (from, to) = (&run[k - 1], &run[k]);
            let crossing = Crossing {
                pose: from.pose.towards(&to.pose, s),
                time_ns: between_ns(from.time_ns, to.time_ns, s),
            };
            ((k - 1, s), crossing)
        })
        .collect()
}
