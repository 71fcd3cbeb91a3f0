//! The product rule along the path from world to tip.
//!
//! With `tip = P_i A_i S_i` (everything before segment i, the segment, everything after it), a small change of segment i
//! moves everything behind it by `P_i (dA_i A_i^-1) P_i^-1`, whatever stands there: a rotation `w` and a velocity, the
//! twist (Lynch and Park, Modern Robotics, 2017, section 5.1). Where the segment ends the velocity is `v_i`, at the tip it is
//! `v_i + w_i x (tip - end_i)`, so that one forward pass with the segments' derivatives gives the whole Jacobian.

use crate::rigid::Rigid;
use crate::segment::{LinearisedSegment, Segment};
use crate::twist::Twist;
use std::borrow::Cow;

/// The frame before the first segment and behind every one of them.
pub(crate) struct Ends(pub Vec<Rigid<f64>>);

impl Ends {
    /// Follows the path from the identity.
    pub fn of(path: &[Segment], p: &[f64], joints: &[f64]) -> Ends {
        let mut ends = Vec::with_capacity(path.len() + 1);
        let mut end = Rigid::identity();
        ends.push(end);
        for segment in path {
            end = end.then(&segment.transform(p, joints));
            ends.push(end);
        }
        Ends(ends)
    }
}

/// A path at one parameter vector and one pose: where it ends and how that changes.
pub(crate) struct LinearisedPath {
    /// The end of the path in the frame it starts in.
    pub tip: Rigid<f64>,
    /// (index in the parameter vector, motion of the tip), in the order of the path.
    pub parameters: Vec<(usize, Twist)>,
    /// (index in the joint vector, motion of the tip), in the order of the path.
    pub joints: Vec<(usize, Twist)>,
}

/// The end of the path.
pub(crate) fn follow(path: &[Segment], p: &[f64], joints: &[f64]) -> Rigid<f64> {
    path.iter().fold(Rigid::identity(), |before, segment| before.then(&segment.transform(p, joints)))
}

/// The end of the path and its motion per unit of each joint, in the order of the path.
pub(crate) fn joint_twists(path: &[Segment], p: &[f64], joints: &[f64]) -> (Rigid<f64>, Vec<(usize, Twist)>) {
    let Ends(ends) = Ends::of(path, p, joints);
    let tip = ends[path.len()];
    let twist = |(segment, ends): (&Segment, &[Rigid<f64>])| {
        let joint = segment.joint?;
        let mut motions = segment.linearised(p, joints).motions.turned(&ends[0].rotation);
        motions.shift(&(tip.translation_m - ends[1].translation_m));
        Some((joint.index, motions.by(segment.parameters.len())))
    };
    (tip, path.iter().zip(ends.windows(2)).filter_map(twist).collect())
}

/// A path at or about one parameter vector. Segments that no joint moves are alike in every pose: they are worked out once.
pub(crate) struct PathAt<'a> {
    path: &'a [Segment],
    p: Cow<'a, [f64]>,
    /// By segment; `None` where a joint moves it.
    still: Vec<Option<LinearisedSegment>>,
}

impl<'a> PathAt<'a> {
    pub fn of(path: &'a [Segment], p: impl Into<Cow<'a, [f64]>>) -> PathAt<'a> {
        let p = p.into();
        let still = |segment: &Segment| segment.joint.is_none().then(|| segment.linearised(&p, &[]));
        let still = path.iter().map(still).collect();
        PathAt { path, p, still }
    }

    /// The end of the path and its derivatives with respect to every parameter and joint on it.
    pub fn linearised(&self, joints: &[f64]) -> LinearisedPath {
        self.with(&self.p, joints)
    }

    /// The same with parameters of the pose's own: a segment whose parameters it leaves alone is as it was.
    pub fn with(&self, p: &[f64], joints: &[f64]) -> LinearisedPath {
        let mut tip = Rigid::identity();
        let mut motions = Vec::with_capacity(self.path.len());
        for (segment, still) in self.path.iter().zip(&self.still) {
            let own = segment.parameters.clone();
            let moved;
            let linearised = match still {
                Some(still) if p[own.clone()] == self.p[own] => still,
                _ => {
                    moved = segment.linearised(p, joints);
                    &moved
                }
            };
            let before = tip;
            tip = before.then(&linearised.transform);
            motions.push((linearised.motions.turned(&before.rotation), tip.translation_m));
        }
        let mut parameters = Vec::with_capacity(p.len());
        let mut of_joints = Vec::with_capacity(joints.len());
        for (segment, (motions, end_m)) in self.path.iter().zip(&mut motions) {
            motions.shift(&(tip.translation_m - *end_m));
            let own = segment.parameters.clone();
            of_joints.extend(segment.joint.map(|joint| (joint.index, motions.by(own.len()))));
            parameters.extend(own.enumerate().map(|(k, index)| (index, motions.by(k))));
        }
        LinearisedPath { tip, parameters, joints: of_joints }
    }
}
