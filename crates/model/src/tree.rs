//! The tree of segments from the world to every feature, and the product rule along each of its paths.
//!
//! With `feature = P_i A_i S_i` (everything before segment i, the segment, everything after it), a small change of segment i
//! moves everything behind it by `P_i (dA_i A_i^-1) P_i^-1`, whatever stands there: a rotation `w` and a velocity, the
//! twist (Lynch and Park, Modern Robotics, 2017, section 5.1). Where the segment ends the velocity is `v_i`, at a feature it is
//! `v_i + w_i x (feature - end_i)`, so that one forward pass with the segments' derivatives gives the Jacobians of all features.

use crate::rigid::Rigid;
use crate::segment::{LinearisedSegment, Segment};
use crate::still::{Still, StillMoving};
use crate::twist::Twist;
use nalgebra::Vector3;
use std::borrow::Cow;

/// A segment by its place in the tree.
pub type SegmentId = usize;

/// Segments, parents before their children, branch after branch.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Tree(pub Vec<Segment>);

/// Whether derivatives by a parameter are asked for, by its index.
pub type Asked<'a> = dyn Fn(usize) -> bool + 'a;

/// The segments from the world to a feature, in this order; the last one ends there.
pub(crate) type Route = Box<[SegmentId]>;

/// The name of a feature and the way to it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Feature {
    pub name: String,
    /// The link of a marker, as it was named; none of the tip.
    pub link: Option<String>,
    pub route: Route,
}

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
            let (before, still) = (at, Still::of(segment, p));
            let transform = still.transform(joints);
            at = before.then(&transform);
            let (Some(joint), Some(twist)) = (segment.joint, still.by_joint(&transform.translation_m)) else {
                continue;
            };
            moving.push((joint.index, twist.turned(&before.rotation), at.translation_m));
        }
        let twist =
            |(index, twist, end_m): (usize, Twist, _)| (index, twist.shifted(&(at.translation_m - end_m)));
        (at, moving.into_iter().map(twist).collect())
    }
}

/// A tree at or about one parameter vector: what is alike in every pose is worked out once.
pub(crate) struct TreeAt<'a> {
    tree: &'a Tree,
    p: Cow<'a, [f64]>,
    segments: Vec<Known>,
}

/// What is known of a segment before its pose.
enum Known {
    /// All of it: no joint moves it, and only where it ends is asked.
    Placed(Rigid<f64>),
    /// The same with how its parameters move it.
    Linearised(Box<LinearisedSegment>),
    /// All but its joint, and only where it ends is asked.
    Still(Still),
    /// All but its joint; how its parameters and its joint move its end is asked too.
    Moving(Box<StillMoving>),
}

impl<'a> TreeAt<'a> {
    /// Where only some parameters are `asked` for, what others and joints move may be missing.
    pub fn of(tree: &'a Tree, p: impl Into<Cow<'a, [f64]>>, asked: Option<&Asked<'_>>) -> TreeAt<'a> {
        let known = |segment: &Segment, p: &[f64]| match segment.joint {
            None => Known::Linearised(segment.linearised(p, &[]).into()),
            Some(_) if asked.is_none_or(|asked| segment.parameters.clone().any(asked)) => {
                Known::Moving(StillMoving::of(segment, p).into())
            }
            Some(_) => Known::Still(Still::of(segment, p)),
        };
        TreeAt::known(tree, p.into(), known)
    }

    /// Where nothing but places is asked for: for [`TreeAt::follow`].
    pub fn predicting(tree: &'a Tree, p: impl Into<Cow<'a, [f64]>>) -> TreeAt<'a> {
        let known = |segment: &Segment, p: &[f64]| match segment.joint {
            None => Known::Placed(segment.transform(p, &[])),
            Some(_) => Known::Still(Still::of(segment, p)),
        };
        TreeAt::known(tree, p.into(), known)
    }

    fn known(tree: &'a Tree, p: Cow<'a, [f64]>, known: impl Fn(&Segment, &[f64]) -> Known) -> TreeAt<'a> {
        let segments = tree.0.iter().map(|segment| known(segment, &p)).collect();
        TreeAt { tree, p, segments }
    }

    /// What is known of a segment, where these parameters leave its own alone.
    fn at(&self, id: SegmentId, p: &[f64]) -> Option<&Known> {
        let own = self.tree.0[id].parameters.clone();
        (p[own.clone()] == self.p[own]).then(|| &self.segments[id])
    }

    /// Where a segment ends in its start, with parameters of the pose's own.
    fn transform(&self, id: SegmentId, p: &[f64], joints: &[f64]) -> Rigid<f64> {
        match self.at(id, p) {
            Some(Known::Placed(transform)) => *transform,
            Some(Known::Linearised(linearised)) => linearised.transform,
            Some(Known::Still(still)) => still.transform(joints),
            Some(Known::Moving(moving)) => moving.transform(joints),
            None => self.tree.0[id].transform(p, joints),
        }
    }

    /// The end of a route, with parameters of the pose's own.
    pub fn follow(&self, route: &[SegmentId], p: &[f64], joints: &[f64]) -> Rigid<f64> {
        let along = |before: Rigid<f64>, id: &SegmentId| before.then(&self.transform(*id, p, joints));
        route.iter().fold(Rigid::identity(), along)
    }

    /// A point of the frame at the end of a route, in the one before it.
    pub fn point(&self, route: &[SegmentId], joints: &[f64], point_m: Vector3<f64>) -> Vector3<f64> {
        let before = |point_m: Vector3<f64>, id: &SegmentId| match &self.segments[*id] {
            Known::Placed(transform) => transform.point(&point_m),
            Known::Linearised(linearised) => linearised.transform.point(&point_m),
            Known::Still(still) => still.point(joints, &point_m),
            Known::Moving(moving) => moving.point(joints, &point_m),
        };
        route.iter().rev().fold(point_m, before)
    }

    /// The end of a route and its derivatives with respect to every parameter and joint on it.
    pub fn linearised(&self, route: &[SegmentId], joints: &[f64]) -> LinearisedFeature {
        self.with(route, &self.p, joints)
    }

    /// The same with parameters of the pose's own.
    pub fn with(&self, route: &[SegmentId], p: &[f64], joints: &[f64]) -> LinearisedFeature {
        let mut at = Rigid::identity();
        let mut motions = Vec::with_capacity(route.len());
        for &id in route {
            let segment = &self.tree.0[id];
            let own;
            let linearised = match self.at(id, p) {
                Some(Known::Linearised(linearised)) => linearised,
                Some(Known::Still(still)) => {
                    at = at.then(&still.transform(joints));
                    continue;
                }
                Some(Known::Moving(moving)) => {
                    own = moving.linearised(joints);
                    &own
                }
                Some(Known::Placed(_)) | None => {
                    own = segment.linearised(p, joints);
                    &own
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
