//! The arm without its effects as links and joints at some parameter values: what robots, planners and simulators read.
//!
//! A joint moves about or along an axis through its own frame. Of a DH row only the part behind (modified: before) its joint is
//! a constant, which becomes part of the next joint's origin: `Rz(theta + q) Tz(d) Tx(a) Rx(alpha) = Rz(q) C` and
//! `Rx(alpha) Tx(a) Rz(theta + q) Tz(d) = C1 Rz(q) C2`. So the frame of a row's link lies on the axis of its joint, and what is
//! behind the last joint stands in the places of tips and markers.

use crate::chain::Source;
use crate::rigid::Rigid;
use crate::segment::{Motion, Segment};
use crate::{Chain, Model};
use armcal_core::{FeatureId, Pose};
use nalgebra::Vector3;

/// Links and joints of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// Name of the robot.
    pub name: String,
    /// Name of the link that all hangs on.
    pub root: String,
    /// The joints, each with the link that it carries; parents before their children.
    pub joints: Vec<Bone>,
    /// The tip, then the markers.
    pub places: Vec<Place>,
}

/// A joint and the link that it carries, whose frame is the joint's.
#[derive(Debug, Clone, PartialEq)]
pub struct Bone {
    /// Name of the joint.
    pub name: String,
    /// The joint that carries the link it hangs on, by its place among all; none on the root.
    pub parent: Option<usize>,
    /// Name of the link.
    pub link: String,
    /// Where the joint is in the link that it hangs on, at reading zero.
    pub origin: Pose,
    /// How it moves; none of a fixed one.
    pub moves: Option<Moving>,
}

/// How a joint moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// About or along its axis.
    pub motion: Motion,
    /// The axis, in the joint's frame; of length one.
    pub axis: Vector3<f64>,
    /// Lowest and highest reading [rad] (sliding: [m]), where its file says.
    pub limits: Option<[f64; 2]>,
    /// Which reading of the joint vector moves it.
    pub reading: usize,
    /// Ratio and offset of a joint that follows another's reading; none where the reading is its own.
    pub follows: Option<[f64; 2]>,
}

/// A tip or a marker on a link.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Its name.
    pub name: String,
    /// Which of the model's features it is.
    pub feature: FeatureId,
    /// The joint whose link it is on, by its place among all; none on the root.
    pub on: Option<usize>,
    /// Where it is on the link.
    pub at: Pose,
    /// Where the link ends that the model has it on: of a DH row behind the row, of a URDF the link itself.
    pub link_end: Pose,
}

/// A link, and a constant in it.
type OnLink = (Option<usize>, Rigid<f64>);

impl Model {
    /// An arm of the model, effects left out, at the parameter vector `p`; `root` names the link that its base is.
    pub fn skeleton(&self, arm: usize, p: &[f64], root: &str) -> Skeleton {
        let (chain, own) = self.chain().arm(arm);
        let (joints, ends) = chain.bones(&p[own]);
        let first = self.chain().arms().get(arm).map_or(0, |arm| arm.segments.start) + self.chain().bases();
        let of_arm = |(feature, name): (FeatureId, &str)| {
            let mut route = self.route(feature).iter().rev();
            let own = route.next().map_or_else(Rigid::identity, |end| self.tree().0[*end].transform(p, &[]));
            let before = route.next().and_then(|link| ends.get(link.checked_sub(first)?));
            let (on, link_end) = before.copied().unwrap_or((None, Rigid::identity()));
            let at = Pose::from(&link_end.then(&own));
            Place { name: name.to_owned(), feature, on, at, link_end: Pose::from(&link_end) }
        };
        let features = self.features().filter(|(feature, _)| self.arm_of(*feature) == arm);
        let places = features.map(of_arm).collect();
        Skeleton { name: chain.name().to_owned(), root: root.to_owned(), joints, places }
    }
}

impl Chain {
    /// Its joints at these values of its parameters, and on which link each segment ends.
    fn bones(&self, p: &[f64]) -> (Vec<Bone>, Vec<OnLink>) {
        let mut bones: Vec<Bone> = Vec::new();
        let mut ends: Vec<OnLink> = Vec::with_capacity(self.segments.len());
        for (at, segment) in self.segments.iter().enumerate() {
            let (on, before) = segment.parent.map_or((None, Rigid::identity()), |parent| ends[parent]);
            let (origin, behind) = segment.parted(p);
            let origin = before.then(&origin);
            // The origin of a moving joint of a URDF is a segment of its own, and a fixed DH row is a part of what comes next.
            let name = self.bone_name(at, segment);
            let Some(name) = name.filter(|_| segment.joint.is_some() || self.is_urdf()) else {
                ends.push((on, origin.then(&behind)));
                continue;
            };
            let link = segment.frame.clone().unwrap_or_default();
            let link = if self.is_urdf() { link } else { format!("{link}_link") };
            let moves = segment.joint.map(|joint| Moving {
                motion: joint.motion,
                axis: segment.axis(),
                limits: self.joint_limits[joint.index].filter(|_| joint.mimic.is_none()),
                reading: joint.index,
                follows: joint.mimic.map(|mimic| [mimic.ratio, mimic.offset]),
            });
            ends.push((Some(bones.len()), behind));
            bones.push(Bone { name, parent: on, link, origin: Pose::from(&origin), moves });
        }
        (bones, ends)
    }

    /// The name of the joint of which this is the last segment.
    fn bone_name(&self, at: usize, segment: &Segment) -> Option<String> {
        let Source::Urdf(joints) = &self.source else { return segment.frame.clone() };
        let own = joints.iter().find(|joint| joint.segment + usize::from(joint.moves) == at);
        own.map(|joint| joint.name.clone())
    }
}

impl Skeleton {
    /// Where a place is in the base at these readings.
    pub fn place_in_base(&self, place: &Place, readings: &[f64]) -> Pose {
        let mut links: Vec<Pose> = Vec::with_capacity(self.joints.len());
        for bone in &self.joints {
            let before = bone.parent.map_or_else(Pose::identity, |parent| links[parent]);
            let moved = bone.moves.as_ref().map_or_else(Pose::identity, |moving| moving.at(readings));
            links.push(before * bone.origin * moved);
        }
        place.on.map_or_else(Pose::identity, |on| links[on]) * place.at
    }
}

impl Moving {
    /// The motion at these readings; of a reading that is missing not a number.
    fn at(&self, readings: &[f64]) -> Pose {
        let reading = readings.get(self.reading).copied().unwrap_or(f64::NAN);
        let q = self.follows.map_or(reading, |[ratio, offset]| reading * ratio + offset);
        match self.motion {
            Motion::Revolute => Pose::rotation(self.axis * q),
            Motion::Prismatic => {
                Pose::from_parts((self.axis * q).into(), nalgebra::UnitQuaternion::identity())
            }
        }
    }
}
