//! The product rule along the path from world to tip.
//!
//! With `tip = P_i A_i S_i` (everything before segment i, the segment, everything after it), a small
//! change of segment i moves the tip by `P_i dA_i S_i`. `P_i` are the running products of the forward
//! pass and the tip seen from behind segment i is found by going back from the tip, so one forward
//! pass and one segment derivative per parameter give the whole Jacobian.

use crate::rigid::{Rigid, rotation_rate};
use crate::segment::{Segment, SegmentDerivatives};
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

/// Segments that no joint moves, at one parameter vector: alike in every pose, so worked out once for many.
pub(crate) struct Still(Vec<Option<StillSegment>>);

/// One of them.
pub(crate) struct StillSegment {
    pub transform: Rigid<f64>,
    pub derivatives: SegmentDerivatives,
}

impl Still {
    /// The still segments of a path.
    pub fn of(path: &[Segment], p: &[f64]) -> Still {
        let still = |s: &Segment| s.joint.is_none().then(|| StillSegment::of(s, p));
        Still(path.iter().map(still).collect())
    }

    /// A segment of that path, if it is still.
    pub fn get(&self, index: usize) -> Option<&StillSegment> {
        self.0.get(index)?.as_ref()
    }
}

impl StillSegment {
    /// A segment without a joint.
    pub fn of(segment: &Segment, p: &[f64]) -> StillSegment {
        StillSegment { transform: segment.transform(p, &[]), derivatives: segment.derivatives(p, &[]) }
    }
}

/// The end of the path and its derivatives with respect to every parameter and joint on it. `still`: of this path at this
/// parameter vector, where it is known.
pub(crate) fn linearise(
    path: &[Segment],
    p: &[f64],
    joints: &[f64],
    still: Option<&Still>,
) -> LinearisedPath {
    let known = |index: usize| still.and_then(|still| still.get(index));
    let mut ends = Vec::with_capacity(path.len() + 1);
    let mut end = Rigid::identity();
    ends.push(end);
    for (index, segment) in path.iter().enumerate() {
        end = match known(index) {
            Some(still) => end.then(&still.transform),
            None => end.then(&segment.transform(p, joints)),
        };
        ends.push(end);
    }
    let tip = end;
    let mut parameters = Vec::with_capacity(p.len());
    let mut joint_twists = Vec::with_capacity(joints.len());
    for (index, (segment, pair)) in path.iter().zip(ends.windows(2)).enumerate() {
        let (before, after) = (&pair[0], &pair[1]);
        let tip_from_after_m = after.rotation.tr_mul(&(tip.translation_m - after.translation_m));
        let own_rotation = before.rotation.tr_mul(&after.rotation);
        let carry = |change: &Rigid<f64>| Twist {
            translation_m: before.rotation * (change.rotation * tip_from_after_m + change.translation_m),
            rotation_rad: before.rotation * rotation_rate(&change.rotation, &own_rotation),
        };
        let own;
        let derivatives = match known(index) {
            Some(still) => &still.derivatives,
            None => {
                own = segment.derivatives(p, joints);
                &own
            }
        };
        let changes = derivatives.parameters.iter().take(derivatives.count);
        parameters.extend(segment.parameters.clone().zip(changes.map(carry)));
        if let (Some(joint), Some(change)) = (segment.joint, &derivatives.joint) {
            joint_twists.push((joint.index, carry(change)));
        }
    }
    LinearisedPath { tip, parameters, joints: joint_twists }
}
