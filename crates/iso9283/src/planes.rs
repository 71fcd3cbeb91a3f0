//! Where an attained path crosses the measuring planes of the command path.
//!
//! A plane is crossed again on the way back, on the far side of a circle, and many times by a tip that trembles at
//! rest. Of all crossings in the command's direction those are taken that follow one another in time and lie
//! closest to the commanded poses, all together. A plane that has none nearby stays without a crossing.

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
    plane: usize,
    /// Index of the sample before, and the fraction of the way to the next: orders crossings in time.
    at: (usize, f64),
    crossing: Crossing,
    cost_m: f64,
    before: Option<usize>,
}

/// The crossing of every plane by `run`, or none. A crossing further than `reach_m` [m] from the commanded pose
/// does not belong to the path.
pub fn find_crossings(planes: &[Plane], run: &[TimedPose], reach_m: f64) -> Vec<Option<Crossing>> {
    let mut candidates: Vec<Candidate> = Vec::new();
    // Chains so far that no earlier one undercuts, in order of time: costs fall from each to the next.
    let mut cheapest: Vec<usize> = Vec::new();
    for (index, plane) in planes.iter().enumerate() {
        let earlier = candidates.len();
        for (at, crossing) in crossings_of_plane(plane, run) {
            let distance_m = (crossing.pose.position_m - plane.pose.position_m).norm();
            if distance_m <= reach_m {
                let ended = cheapest.partition_point(|&chain| candidates[chain].at < at);
                let before = ended.checked_sub(1).map(|last| cheapest[last]);
                // Every plane crossed saves `reach_m`, so that a chain leaves out no crossing that it could have.
                let cost_m = distance_m - reach_m + before.map_or(0.0, |chain| candidates[chain].cost_m);
                candidates.push(Candidate { plane: index, at, crossing, cost_m, before });
            }
        }
        cheapest.extend(earlier..candidates.len());
        keep_cheapest(&candidates, &mut cheapest);
    }
    let mut found = vec![None; planes.len()];
    let mut next = cheapest.last().copied();
    while let Some(chain) = next {
        found[candidates[chain].plane] = Some(candidates[chain].crossing);
        next = candidates[chain].before;
    }
    found
}

/// Leaves the chains that cost less than every earlier one, in order of time.
fn keep_cheapest(candidates: &[Candidate], chains: &mut Vec<usize>) {
    let when = |chain: usize| candidates[chain].at;
    chains.sort_by(|&a, &b| when(a).0.cmp(&when(b).0).then(when(a).1.total_cmp(&when(b).1)));
    let mut least_m = f64::INFINITY;
    chains.retain(|&chain| {
        let cheaper = candidates[chain].cost_m < least_m;
        least_m = least_m.min(candidates[chain].cost_m);
        cheaper
    });
}

/// All crossings of a plane from behind to before it.
fn crossings_of_plane(plane: &Plane, run: &[TimedPose]) -> Vec<((usize, f64), Crossing)> {
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
