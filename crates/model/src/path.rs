//! The product rule along the path from world to tip.
//!
//! With `tip = P_i A_i S_i` (everything before segment i, the segment, everything after it), a small change of segment i
//! moves everything behind it by `P_i (dA_i A_i^-1) P_i^-1`, whatever stands there: a rotation `w` and a velocity, the
//! spatial twist (Lynch and Park, Modern Robotics, 2017, section 5.1.1). Seen at the path's origin the velocity is `v_i`, at
//! the tip it is `v_i + w_i x tip`, so that one forward pass with the segments' derivatives gives the whole Jacobian.

use crate::rigid::{Rigid, rotation_rate};
use crate::segment::{LinearisedSegment, Segment};
use nalgebra::Vector3;

/// Motion of the tip per unit of one quantity, in the frame the path starts in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Twist {
    /// d position [m per unit].
    pub translation_m: Vector3<f64>,
    /// d rotation: `w` with `dR = [w]x R` [rad per unit].
    pub rotation_rad: Vector3<f64>,
}

impl Twist {
    /// No motion.
    pub fn none() -> Twist {
        Twist { translation_m: Vector3::zeros(), rotation_rad: Vector3::zeros() }
    }

    /// Adds `factor` of another motion.
    pub fn add(&mut self, other: &Twist, factor: f64) {
        self.translation_m += other.translation_m * factor;
        self.rotation_rad += other.rotation_rad * factor;
    }
}

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

/// A path at one parameter vector. Segments that no joint moves are alike in every pose: they are worked out once.
pub(crate) struct PathAt<'a> {
    path: &'a [Segment],
    p: &'a [f64],
    /// By segment; `None` where a joint moves it.
    still: Vec<Option<LinearisedSegment>>,
}

impl<'a> PathAt<'a> {
    pub fn of(path: &'a [Segment], p: &'a [f64]) -> PathAt<'a> {
        let still = |segment: &Segment| segment.joint.is_none().then(|| segment.linearised(p, &[]));
        PathAt { path, p, still: path.iter().map(still).collect() }
    }

    /// The end of the path and its derivatives with respect to every parameter and joint on it.
    pub fn linearised(&self, joints: &[f64]) -> LinearisedPath {
        let mut tip = Rigid::identity();
        let mut parameters = Vec::with_capacity(self.p.len());
        let mut joint_twists = Vec::with_capacity(joints.len());
        for (segment, still) in self.path.iter().zip(&self.still) {
            let moved;
            let linearised = match still {
                Some(still) => still,
                None => {
                    moved = segment.linearised(self.p, joints);
                    &moved
                }
            };
            let (before, own) = (tip, &linearised.transform);
            tip = before.then(own);
            let twist = |change: &Rigid<f64>| {
                let rotation_rad = before.rotation * rotation_rate(&change.rotation, &own.rotation);
                let at_end_m = before.rotation * change.translation_m;
                Twist { translation_m: at_end_m - rotation_rad.cross(&tip.translation_m), rotation_rad }
            };
            let (by_parameter, by_joint) = linearised.derivatives.split_at(segment.parameters.len());
            parameters.extend(segment.parameters.clone().zip(by_parameter.iter().map(twist)));
            let joint = segment.joint.iter().map(|joint| joint.index);
            joint_twists.extend(joint.zip(by_joint.iter().map(twist)));
        }
        for (_, twist) in parameters.iter_mut().chain(&mut joint_twists) {
            twist.translation_m += twist.rotation_rad.cross(&tip.translation_m);
        }
        LinearisedPath { tip, parameters, joints: joint_twists }
    }
}
