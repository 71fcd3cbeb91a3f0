//! Which observations are of one pose of the arm.
//!
//! Whatever the model lacks is the same wherever the arm stands the same way: an observation at the pose of another one
//! that the fit saw is no test of it.

use armcal_core::Observation;
use std::borrow::Borrow;
use std::ops::Range;

/// Joint difference, in every joint, below which two dwells are of one pose [rad] (sliding: [m]): what a hand that leads the
/// arm back, or a controller, leaves over; far above the noise of encoders.
pub const SAME_POSE_RAD: f64 = 0.01;

/// The runs of observations that are what was measured in one dwell, each of another feature or against another place, in the
/// order given. They share the readings of the joints, and with them the encoders' noise.
pub fn measured_together<O: Borrow<Observation>>(observations: &[O]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::with_capacity(observations.len());
    for (i, o) in observations.iter().map(Borrow::borrow).enumerate() {
        let joins = |run: &Range<usize>| {
            let mut run = observations[run.clone()].iter().map(Borrow::borrow);
            run.all(|other: &Observation| other.dwell == o.dwell && other.what() != o.what())
        };
        match runs.last_mut().filter(|run| joins(run)) {
            Some(run) => run.end = i + 1,
            None => runs.push(i..i + 1),
        }
    }
    runs
}

/// Number of the group that each observation belongs to: no two observations of one pose are in different groups, and
/// groups are as small as that allows. Different cavities are different poses, however close.
pub(crate) fn pose_groups(observations: &[Observation]) -> Vec<usize> {
    let mut sets = Sets::new(observations.len());
    each_pose_pair(observations, |a, b| sets.join(a, b));
    sets.numbered()
}

/// Calls `found` with every two observations of one pose.
pub(crate) fn each_pose_pair(observations: &[Observation], mut found: impl FnMut(usize, usize)) {
    // Along the joint that moves most, observations of one pose are neighbours.
    let joints = observations.iter().map(|o| o.joint_rad.len()).min().unwrap_or(0);
    let widest =
        (0..joints).max_by(|a, b| joint_spread(observations, *a).total_cmp(&joint_spread(observations, *b)));
    let Some(joint) = widest else { return };
    let at = |i: usize| observations[i].joint_rad[joint];
    let mut order: Vec<usize> = (0..observations.len()).collect();
    order.sort_by(|a, b| at(*a).total_cmp(&at(*b)));
    for (place, &a) in order.iter().enumerate() {
        let near = order[place + 1..].iter().take_while(|b| at(**b) - at(a) < SAME_POSE_RAD);
        near.filter(|b| is_one_pose(&observations[a], &observations[**b])).for_each(|b| found(a, *b));
    }
}

fn joint_spread(observations: &[Observation], joint: usize) -> f64 {
    let readings = observations.iter().map(|o| o.joint_rad[joint]);
    let start = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = readings.fold(start, |[low, high], q| [q.min(low), q.max(high)]);
    high - low
}

fn is_one_pose(a: &Observation, b: &Observation) -> bool {
    let elsewhere = a.cavity().zip(b.cavity()).is_some_and(|(a, b)| a != b);
    let close = |(a, b): (&f64, &f64)| (a - b).abs() < SAME_POSE_RAD;
    !elsewhere && a.joint_rad.len() == b.joint_rad.len() && a.joint_rad.iter().zip(&b.joint_rad).all(close)
}

/// Disjoint sets of numbers (union-find with path halving, Tarjan and van Leeuwen 1984).
pub(crate) struct Sets {
    parent: Vec<usize>,
}

impl Sets {
    pub fn new(count: usize) -> Sets {
        Sets { parent: (0..count).collect() }
    }

    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.parent[i] != i {
            self.parent[i] = self.parent[self.parent[i]];
            i = self.parent[i];
        }
        i
    }

    /// The sets, numbered from 0 in the order of their first members.
    pub fn numbered(mut self) -> Vec<usize> {
        let mut next = 0;
        let mut number = vec![usize::MAX; self.parent.len()];
        (0..self.parent.len())
            .map(|i| {
                let root = self.root(i);
                if number[root] == usize::MAX {
                    number[root] = next;
                    next += 1;
                }
                number[root]
            })
            .collect()
    }
}
