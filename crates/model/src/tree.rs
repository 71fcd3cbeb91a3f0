//! The tree of segments from the world to every feature, and the product rule along each of its paths.
//!
//! With `feature = P_i A_i S_i` (everything before segment i, the segment, everything after it), a small change of segment i
//! moves everything behind it by `P_i (dA_i A_i^-1) P_i^-1`, whatever stands there: a rotation `w` and a velocity, the
//! twist (Lynch and Park, Modern Robotics, 2017, section 5.1). Where the segment ends the velocity is `v_i`, at a feature it is
//! `v_i + w_i x (feature - end_i)`, so that one forward pass with the segments' derivatives gives the Jacobians of all features.

use crate::rigid::Rigid;
use crate::segment::{LinearisedSegment, Segment};
use crate::twist::{Twist, Twists};
use nalgebra::Vector3;
use std::borrow::Cow;

/// A segment by its place in the tree.
pub(crate) type SegmentId = usize;

/// Segments, parents before their children, branch after branch.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Tree(pub Vec<Segment>);

/// Whether derivatives by a parameter are asked for, by its index.
pub type Asked<'a> = dyn Fn(usize) -> bool + 'a;

/// The segments from the world to a feature, in this order; the last one ends there.
pub(crate) type Route = Box<[SegmentId]>;

/// A feature at one parameter vector and one pose: where it is and how that changes.
pub(crate) struct LinearisedFeature {
    /// The feature in the world.
    pub at: Rigid<f64>,
    /// (index in the parameter vector, motion of the feature), in the order of its route.
    pub parameters: Vec<(usize, Twist)>,
    /// (index in the joint vector, motion of the feature), in the order of its route; a reading that moves two joints of
    /// it is there twice.
    pub joints: Vec<(usize, Twist)>,
}

impl Tree {
    /// The segments from the world to the end of one.
    pub fn route(&self, end: SegmentId) -> Route {
        let mut route: Vec<SegmentId> = std::iter::successors(Some(end), |id| self.0[*id].parent).collect();
        route.reverse();
        route.into()
    }

    /// The frame at the end of every segment.
    pub fn ends(&self, p: &[f64], joints: &[f64]) -> Vec<Rigid<f64>> {
        let mut ends: Vec<Rigid<f64>> = Vec::with_capacity(self.0.len());
        for segment in &self.0 {
            let before = segment.parent.map_or_else(Rigid::identity, |parent| ends[parent]);
            ends.push(before.then(&segment.transform(p, joints)));
        }
        ends
    }

    /// The end of a route.
    pub fn follow(&self, route: &[SegmentId], p: &[f64], joints: &[f64]) -> Rigid<f64> {
        let along = |before: Rigid<f64>, id: &SegmentId| before.then(&self.0[*id].transform(p, joints));
        route.iter().fold(Rigid::identity(), along)
    }

    /// The end of a route and its motion per unit of each joint, in the order of the route.
    pub fn joint_twists(
        &self,
        route: &[SegmentId],
        p: &[f64],
        joints: &[f64],
    ) -> (Rigid<f64>, Vec<(usize, Twist)>) {
        let (mut at, mut moving) = (Rigid::identity(), Vec::new());
        for segment in route.iter().map(|id| &self.0[*id]) {
            let before = at;
            at = before.then(&segment.transform(p, joints));
            let Some(joint) = segment.joint else { continue };
            let motions = segment.linearised(p, joints).motions.turned(&before.rotation);
            moving.push((joint.index, segment.parameters.len(), motions, at.translation_m));
        }
        let twist = |(index, last, mut motions, end_m): (usize, usize, Twists<_>, _)| {
            motions.shift(&(at.translation_m - end_m));
            (index, motions.by(last))
        };
        (at, moving.into_iter().map(twist).collect())
    }
}

/// A tree at or about one parameter vector. Segments that no joint moves are alike in every pose: they are worked out once.
pub(crate) struct TreeAt<'a> {
    tree: &'a Tree,
    p: Cow<'a, [f64]>,
    segments: Vec<Still>,
}

/// What is known of a segment before its pose.
enum Still {
    /// All of it: no joint moves it.
    Linearised(Box<LinearisedSegment>),
    /// Nothing, and how its parameters and its joint move its end is asked of it.
    Asked,
    /// Nothing, and only where it ends is asked.
    Unasked,
}

impl<'a> TreeAt<'a> {
    /// Where only some parameters are `asked` for, what others and joints move may be missing.
    pub fn of(tree: &'a Tree, p: impl Into<Cow<'a, [f64]>>, asked: Option<&Asked<'_>>) -> TreeAt<'a> {
        let p = p.into();
        let still = |segment: &Segment| match segment.joint {
            None => Still::Linearised(segment.linearised(&p, &[]).into()),
            Some(_) if asked.is_none_or(|asked| segment.parameters.clone().any(asked)) => Still::Asked,
            Some(_) => Still::Unasked,
        };
        let segments = tree.0.iter().map(still).collect();
        TreeAt { tree, p, segments }
    }

    /// A point of the frame at the end of a route, in the one before it.
    pub fn point(&self, route: &[SegmentId], joints: &[f64], point_m: Vector3<f64>) -> Vector3<f64> {
        let before = |point_m: Vector3<f64>, id: &SegmentId| match &self.segments[*id] {
            Still::Linearised(still) => still.transform.point(&point_m),
            _ => self.tree.0[*id].transform(&self.p, joints).point(&point_m),
        };
        route.iter().rev().fold(point_m, before)
    }

    /// The end of a route and its derivatives with respect to every parameter and joint on it.
    pub fn linearised(&self, route: &[SegmentId], joints: &[f64]) -> LinearisedFeature {
        self.with(route, &self.p, joints)
    }

    /// The same with parameters of the pose's own: a segment whose parameters it leaves alone is as it was.
    pub fn with(&self, route: &[SegmentId], p: &[f64], joints: &[f64]) -> LinearisedFeature {
        let mut at = Rigid::identity();
        let mut motions = Vec::with_capacity(route.len());
        for &id in route {
            let segment = &self.tree.0[id];
            let own = segment.parameters.clone();
            let moved;
            let linearised = match &self.segments[id] {
                Still::Linearised(still) if p[own.clone()] == self.p[own] => still,
                Still::Unasked => {
                    at = at.then(&segment.transform(p, joints));
                    continue;
                }
                _ => {
                    moved = segment.linearised(p, joints);
                    &moved
                }
            };
            let before = at;
            at = before.then(&linearised.transform);
            motions.push((segment, linearised.motions.turned(&before.rotation), at.translation_m));
        }
        let mut parameters = Vec::with_capacity(p.len());
        let mut of_joints = Vec::with_capacity(joints.len());
        for (segment, motions, end_m) in &mut motions {
            motions.shift(&(at.translation_m - *end_m));
            let own = segment.parameters.clone();
            of_joints.extend(segment.joint.map(|joint| (joint.index, motions.by(own.len()))));
            parameters.extend(own.enumerate().map(|(k, index)| (index, motions.by(k))));
        }
        LinearisedFeature { at, parameters, joints: of_joints }
    }
}
