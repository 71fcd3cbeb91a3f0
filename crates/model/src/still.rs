//! A segment at some values of its parameters, alike in every pose: what is left is where its joint is.
//!
//! A joint moves `before * motion(q) * behind`. What the parameters do to the two constant parts comes from their formulas by dual
//! numbers, once; in a pose it is only turned along. What the joint does is its axis: `w` for an angle and `v` for a length,
//! by the definition of a twist (Lynch and Park, Modern Robotics, 2017, section 4.1).

use crate::rigid::Rigid;
use crate::segment::{Joint, LinearisedSegment, MAX_PARAMETERS, Motion, Parts, Segment, joint_transform};
use crate::twist::{Twist, Twists};
use nalgebra::{SVector, Vector3};
use num_dual::DualSVec64;
use std::array;

impl Segment {
    /// The transform from the frame before the segment to the one after it, predicted.
    ///
    /// `p` is the whole parameter vector and `joints` the whole joint vector; a joint that is missing is NaN.
    pub fn transform(&self, p: &[f64], joints: &[f64]) -> Rigid<f64> {
        Still::of(self, p).transform(joints)
    }

    /// [`Segment::transform`] and its derivatives.
    pub fn linearised(&self, p: &[f64], joints: &[f64]) -> LinearisedSegment {
        StillMoving::of(self, p).linearised(joints)
    }
}

/// A dual number that differentiates by all quantities of a segment at once.
type Lanes = DualSVec64<MAX_PARAMETERS>;

/// Where a segment is.
pub(crate) struct Still {
    parts: Parts<f64>,
    joint: Option<(Joint, Vector3<f64>)>,
}

/// The same, with its derivatives by the segment's parameters.
pub(crate) struct StillMoving {
    still: Still,
    /// How many they are.
    parameters: usize,
    /// Motions of the end of the part before the joint, in axes of its start; none where there is no such part.
    before: Option<Twists<MAX_PARAMETERS>>,
    /// Of the end of the part behind it, in axes of its own start.
    behind: Twists<MAX_PARAMETERS>,
}

impl Still {
    pub fn of(segment: &Segment, p: &[f64]) -> Still {
        let joint = segment.joint.map(|joint| (joint, segment.axis()));
        Still { parts: segment.parts(&p[segment.parameters.clone()]), joint }
    }

    /// Where its end is in its start.
    pub fn transform(&self, joints: &[f64]) -> Rigid<f64> {
        let Parts { before, behind } = &self.parts;
        let behind = match self.motion(joints) {
            Some(motion) => motion.then(behind),
            None => *behind,
        };
        before.map_or(behind, |before| before.then(&behind))
    }

    /// A point of the frame at its end, in its start.
    pub fn point(&self, joints: &[f64], point_m: &Vector3<f64>) -> Vector3<f64> {
        let Parts { before, behind } = &self.parts;
        let behind_m = behind.point(point_m);
        let moved_m = self.motion(joints).map_or(behind_m, |motion| motion.point(&behind_m));
        before.map_or(moved_m, |before| before.point(&moved_m))
    }

    /// The motion of its joint; a reading that is missing is NaN.
    fn motion(&self, joints: &[f64]) -> Option<Rigid<f64>> {
        let (joint, axis) = self.joint.as_ref()?;
        let reading = joints.get(joint.index).copied().unwrap_or(f64::NAN);
        Some(joint_transform(axis, joint.at(reading), joint.motion))
    }

    /// Motion of its end per unit of its joint's reading, in axes of its start; `end_m` is where that end is.
    pub fn by_joint(&self, end_m: &Vector3<f64>) -> Option<Twist> {
        let (joint, axis) = self.joint.as_ref()?;
        let before = self.parts.before.unwrap_or_else(Rigid::identity);
        let axis = before.rotation * axis * joint.mimic.map_or(1.0, |mimic| mimic.ratio);
        Some(match joint.motion {
            Motion::Prismatic => Twist { translation_m: axis, rotation_rad: Vector3::zeros() },
            Motion::Revolute => {
                Twist { translation_m: axis.cross(&(end_m - before.translation_m)), rotation_rad: axis }
            }
        })
    }
}

impl StillMoving {
    pub fn of(segment: &Segment, p: &[f64]) -> StillMoving {
        let own = &p[segment.parameters.clone()];
        let mut lanes = [Lanes::from(0.0); MAX_PARAMETERS];
        for (k, (lane, &value)) in lanes.iter_mut().zip(own).enumerate() {
            *lane = Lanes::from(value).derivative(k);
        }
        let Parts { before, behind } = segment.parts(&lanes[..own.len()]);
        // A segment that no joint moves is one part.
        let (before, behind) = match segment.joint {
            Some(_) => (before.as_ref().map(part_twists), part_twists(&behind)),
            None => (None, part_twists(&Parts { before, behind }.whole())),
        };
        StillMoving { still: Still::of(segment, p), parameters: own.len(), before, behind }
    }

    /// Where its end is in its start.
    pub fn transform(&self, joints: &[f64]) -> Rigid<f64> {
        self.still.transform(joints)
    }

    /// A point of the frame at its end, in its start.
    pub fn point(&self, joints: &[f64], point_m: &Vector3<f64>) -> Vector3<f64> {
        self.still.point(joints, point_m)
    }

    /// Where its end is in its start, and how that end moves.
    pub fn linearised(&self, joints: &[f64]) -> LinearisedSegment {
        let transform = self.still.transform(joints);
        let Some(motion) = self.still.motion(joints) else {
            return LinearisedSegment { transform, motions: self.behind };
        };
        let mut motions = match (&self.still.parts.before, self.before) {
            (Some(before), Some(mut of_before)) => {
                of_before.shift(&(transform.translation_m - before.translation_m));
                let mut motions = self.behind.turned(&(before.rotation * motion.rotation));
                motions.add(&of_before);
                motions
            }
            _ => self.behind.turned(&motion.rotation),
        };
        // Only a segment with at most five parameters has a joint: there is a lane left for it.
        if let Some(twist) = self.still.by_joint(&transform.translation_m) {
            motions.set(self.parameters, &twist);
        }
        LinearisedSegment { transform, motions }
    }
}

/// Motions of the end of a constant part, in axes of its start.
fn part_twists(part: &Rigid<Lanes>) -> Twists<MAX_PARAMETERS> {
    // Of dR R' = [w]x, the entry below the diagonal for each axis.
    let rate = |i: usize, j: usize| {
        let term = |k: usize| entry_derivatives(&part.rotation[(i, k)]) * part.rotation[(j, k)].re;
        term(0) + term(1) + term(2)
    };
    let rotation_rad = [rate(2, 1), rate(0, 2), rate(1, 0)];
    Twists {
        translation_m: array::from_fn(|axis| entry_derivatives(&part.translation_m[axis])),
        rotation_rad,
    }
}

/// The derivatives of an entry; one that depends on nothing has none.
fn entry_derivatives(entry: &Lanes) -> SVector<f64, MAX_PARAMETERS> {
    entry.eps.0.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::{Geometry, Mimic};
    use proptest::prelude::*;

    fn segment(geometry: Geometry, motion: Motion, mimic: Option<Mimic>, parameters: usize) -> Segment {
        let joint = Some(Joint { index: 0, motion, mimic });
        Segment { parent: None, frame: None, geometry, joint, parameters: 0..parameters, body: None }
    }

    fn apart(a: &Rigid<f64>, b: &Rigid<f64>) -> f64 {
        (a.rotation - b.rotation).abs().max().max((a.translation_m - b.translation_m).abs().max())
    }

    proptest! {
        #[test]
        fn a_joint_of_a_row_adds_to_its_theta_or_its_d(
            p in prop::array::uniform5(-2.0..2.0f64), q in -3.0..3.0f64, modified: bool, hayati: bool, slides: bool,
        ) {
            let geometry = if modified { Geometry::ModifiedDh { hayati } } else { Geometry::StandardDh { hayati } };
            let motion = if slides { Motion::Prismatic } else { Motion::Revolute };
            let row = segment(geometry, motion, None, 4 + usize::from(hayati));
            let mut moved = p;
            moved[usize::from(slides)] += q;
            let (at_reading, by_parameter) = (Still::of(&row, &p), Still::of(&row, &moved));
            prop_assert!(apart(&at_reading.transform(&[q]), &by_parameter.transform(&[0.0])) < 1e-14);
            // So does its motion, of which the one comes from the axis and the other from dual numbers.
            let linearised = StillMoving::of(&row, &p).linearised(&[q]);
            let (joint, own) =
                (linearised.motions.by(row.parameters.len()), linearised.motions.by(usize::from(slides)));
            prop_assert!((joint.translation_m - own.translation_m).abs().max() < 1e-13);
            prop_assert!((joint.rotation_rad - own.rotation_rad).abs().max() < 1e-13);
        }

        #[test]
        fn a_joint_that_follows_another_moves_by_its_ratio(
            axis in prop::array::uniform3(-1.0..1.0f64), q in -2.0..2.0f64, ratio in -3.0..3.0f64, offset in -1.0..1.0f64,
            slides: bool,
        ) {
            let axis = (Vector3::from(axis) + Vector3::z() * 2.0).normalize();
            let motion = if slides { Motion::Prismatic } else { Motion::Revolute };
            let of = |mimic| Still::of(&segment(Geometry::Axis(axis), motion, mimic, 0), &[]);
            let (follows, reads) = (of(Some(Mimic { ratio, offset })), of(None));
            let (at, leads) = (follows.transform(&[q]), reads.transform(&[ratio * q + offset]));
            prop_assert!(apart(&at, &leads) < 1e-14);
            let [own, lead] = [&follows, &reads].map(|still| still.by_joint(&at.translation_m).expect("a joint"));
            prop_assert!((own.translation_m - lead.translation_m * ratio).abs().max() < 1e-14);
            prop_assert!((own.rotation_rad - lead.rotation_rad * ratio).abs().max() < 1e-14);
        }
    }
}
