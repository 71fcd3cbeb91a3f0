//! The nominal arm in one pose: its axes, and what its links weigh where.
//!
//! Links have the masses and centres of their URDF, as far as they count ([`crate::Masses`]); else each weighs 2.5 kg for
//! every metre from its joint to the next ones (the last: to the tip), evenly spread. A joint carries its own link and all
//! behind it, on every branch. Only the proportions matter, because the amplitude of an effect absorbs the scale and a second
//! amplitude the share of the outer links.

use crate::rigid::Rigid;
use crate::segment::{Body, Geometry, Motion, Segment};
use crate::tree::{SegmentId, Tree};
use armcal_core::{FeatureId, Load, Observation};
use nalgebra::Vector3;
use std::ops::Range;

/// Mass of a link per length between its joints [kg/m].
const LINK_DENSITY_KGPM: f64 = 2.5;

/// The axis of a joint at the nominal arm, in the world.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointAxis {
    /// A point on the axis that the joint itself does not move [m]: the link before it ends here.
    pub origin_m: Vector3<f64>,
    /// Where its own link begins [m]: there too, unless it slides.
    pub start_m: Vector3<f64>,
    /// Unit vector.
    pub axis: Vector3<f64>,
    /// How the joint moves.
    pub motion: Motion,
    /// The segment that holds the joint.
    pub segment: SegmentId,
    /// The frame right before that segment.
    pub before: Rigid<f64>,
    /// The links it moves: its own, then those behind it.
    pub links: Range<usize>,
}

/// A link: what one joint moves and no other joint behind it.
#[derive(Debug, Clone, PartialEq)]
struct Link {
    body: Body,
    /// The link that carries it; none for one that hangs on the base.
    parent: Option<usize>,
    /// The arm that it is part of.
    arm: usize,
    /// Where its joint is and where it ends [m]: at the next joints and the tip.
    from_m: Vector3<f64>,
    to_m: Vec<Vector3<f64>>,
}

/// A point of the arm and the link that carries it; none of a point that no joint moves.
#[derive(Debug, Clone, PartialEq)]
struct Hook {
    at_m: Vector3<f64>,
    link: Option<usize>,
}

/// The nominal arm in one pose.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NominalPose {
    /// The frame of the base of each arm, in the world.
    pub bases: Vec<Rigid<f64>>,
    /// The joints, in the order of the joint vector.
    pub joints: Vec<JointAxis>,
    /// Joints that follow the reading of another: that reading, the change per change of it, and the joint.
    mimics: Vec<(usize, f64, JointAxis)>,
    /// Where a load can hang: the tip of each arm, then the markers.
    hooks: Vec<Hook>,
    /// What each joint moves, branch after branch, arm after arm.
    links: Vec<Link>,
    /// Whether each link weighs what its file declares.
    pub declared: Vec<bool>,
}

impl NominalPose {
    /// Of a tree whose first segments end at the bases, one an arm, and the features on it, the tips of these arms first.
    pub fn of(
        tree: &Tree,
        (arms, features): (usize, &[SegmentId]),
        p: &[f64],
        joint_rad: &[f64],
    ) -> NominalPose {
        let ends = tree.ends(p, joint_rad);
        let mut pose = NominalPose {
            bases: ends[..arms].to_vec(),
            joints: Vec::new(),
            mimics: Vec::new(),
            hooks: Vec::new(),
            links: Vec::new(),
            declared: Vec::new(),
        };
        // The arm and the link that each segment is part of.
        let mut part_of: Vec<(usize, Option<usize>)> = Vec::with_capacity(ends.len());
        for (id, segment) in tree.0.iter().enumerate() {
            let (arm, parent) = segment.parent.map_or((id, None), |parent| part_of[parent]);
            let Some(joint) = segment.joint else {
                part_of.push((arm, parent));
                continue;
            };
            let before = segment.parent.map_or_else(Rigid::identity, |parent| ends[parent]);
            let value = joint.at(joint_rad.get(joint.index).copied().unwrap_or(f64::NAN));
            let link = pose.links.len();
            let axis =
                JointAxis { links: link..link + 1, ..joint_axis(id, segment, before, &ends[id], (p, value)) };
            pose.begin_link(arm, parent, &axis);
            part_of.push((arm, Some(link)));
            match joint.mimic {
                None => pose.joints.push(axis),
                Some(mimic) => pose.mimics.push((joint.index, mimic.ratio, axis)),
            }
        }
        let hook = |end: &SegmentId| Hook { at_m: ends[*end].translation_m, link: part_of[*end].1 };
        pose.hooks = features.iter().map(hook).collect();
        pose.end_links();
        pose.weigh(tree, &ends, &part_of);
        pose
    }

    /// Adds a link that hangs on another, which ends where the joint of this one is.
    fn begin_link(&mut self, arm: usize, parent: Option<usize>, joint: &JointAxis) {
        if let Some(parent) = parent {
            self.links[parent].to_m.push(joint.origin_m);
        }
        let body = Body::NONE;
        self.links.push(Link { body, parent, arm, from_m: joint.start_m, to_m: Vec::new() });
    }

    /// Ends the link of each tip at the tip, those of other branches at the marker farthest out, and lets every joint know
    /// what it moves.
    fn end_links(&mut self) {
        let mut ends: Vec<usize> = (1..=self.links.len()).collect();
        for k in (0..self.links.len()).rev() {
            if let Some(parent) = self.links[k].parent {
                ends[parent] = ends[parent].max(ends[k]);
            }
        }
        let (tips, markers) = self.hooks.split_at(self.bases.len());
        for tip in tips {
            tip.link.into_iter().for_each(|link| self.links[link].to_m.push(tip.at_m));
        }
        for (k, link) in self.links.iter_mut().enumerate().filter(|(_, link)| link.to_m.is_empty()) {
            let ends = markers.iter().filter(|marker| marker.link == Some(k)).map(|marker| marker.at_m);
            let far = |m: &Vector3<f64>| (m - link.from_m).norm();
            let end = ends.max_by(|a, b| far(a).total_cmp(&far(b)));
            link.to_m.extend(end);
        }
        for joint in self.joints.iter_mut().chain(self.mimics.iter_mut().map(|(_, _, joint)| joint)) {
            joint.links.end = ends[joint.links.start];
        }
    }

    /// Lets the links weigh what their file declares, or as much as they are long where it leaves them without a mass.
    fn weigh(&mut self, tree: &Tree, ends: &[Rigid<f64>], part_of: &[(usize, Option<usize>)]) {
        let mut declared: Vec<Body> = vec![Body::NONE; self.links.len()];
        for ((segment, end), (_, link)) in tree.0.iter().zip(ends).zip(part_of) {
            // What no joint moves bears no part.
            let Some((body, k)) = segment.body.as_ref().zip(*link) else { continue };
            declared[k].add(&Body { centre_m: end.point(&body.centre_m), ..*body });
        }
        self.declared = declared.iter().map(|body| body.mass_kg > 0.0).collect();
        for (link, body) in self.links.iter_mut().zip(declared) {
            link.body = if body.mass_kg > 0.0 { body } else { uniform_link_body(link) };
        }
    }

    /// Where link `k` begins, and where it ends if it does not branch [m].
    pub fn beam_m(&self, k: usize) -> Option<(Vector3<f64>, Vector3<f64>)> {
        match self.links[k].to_m.as_slice() {
            [to] => Some((self.links[k].from_m, *to)),
            _ => None,
        }
    }

    /// The direction from where the link at the tip of an arm begins to that tip; none where the two are one.
    pub fn towards_tip(&self, arm: usize) -> Option<Vector3<f64>> {
        let tip = &self.hooks[arm];
        (tip.at_m - self.links[tip.link?].from_m).try_normalize(1e-6)
    }

    /// Length of link `k` to the farthest of its ends [m].
    pub fn length_m(&self, k: usize) -> f64 {
        let link = &self.links[k];
        link.to_m.iter().map(|to| (to - link.from_m).norm()).fold(0.0, f64::max)
    }

    /// How far from a joint each of its links begins with the arm stretched out [m], in their order.
    pub fn stretched_m(&self, joint: usize) -> Vec<f64> {
        let links = self.joints[joint].links.clone();
        let mut begins_m = vec![0.0; links.len()];
        for k in links.clone().skip(1) {
            let Some(parent) = self.links[k].parent.filter(|parent| links.contains(parent)) else { continue };
            begins_m[k - links.start] = begins_m[parent - links.start] + self.length_m(parent);
        }
        begins_m
    }

    /// Mass of link `k` [kg].
    pub fn link_mass_kg(&self, k: usize) -> f64 {
        self.links[k].body.mass_kg
    }

    /// Centre of mass of link `k` [m].
    pub fn link_centre_m(&self, k: usize) -> Vector3<f64> {
        self.links[k].body.centre_m
    }

    /// All links of an arm.
    pub fn links_of(&self, arm: usize) -> Range<usize> {
        let before = |arms: usize| self.links.partition_point(|link| link.arm < arms);
        before(arm)..before(arm + 1)
    }

    /// The joints of an arm.
    pub fn joints_of(&self, arm: usize) -> Range<usize> {
        let before = |arms: usize| self.joints.partition_point(|j| self.links[j.links.start].arm < arms);
        before(arm)..before(arm + 1)
    }

    /// Whether a joint hangs on the base.
    pub fn is_first(&self, joint: usize) -> bool {
        self.links[self.joints[joint].links.start].parent.is_none()
    }

    /// The links behind a joint's own.
    pub fn outer(&self, joint: usize) -> Range<usize> {
        let links = &self.joints[joint].links;
        links.start + 1..links.end
    }

    /// The joint on which a link's only neighbour hangs; none where it branches or ends.
    pub fn next_joint(&self, joint: usize) -> Option<usize> {
        let own = self.joints[joint].links.start;
        let mut next =
            (0..self.joints.len()).filter(|k| self.links[self.joints[*k].links.start].parent == Some(own));
        next.next().filter(|_| self.links[own].to_m.len() == 1 && next.next().is_none())
    }

    /// The joint whose own link carries a joint; none where the base does, or one without a reading.
    pub fn previous_joint(&self, joint: usize) -> Option<usize> {
        let parent = self.links[self.joints.get(joint)?.links.start].parent?;
        self.joints.iter().position(|j| j.links.start == parent)
    }

    /// Moment about `pivot` of the weights of some links [N m].
    pub fn moment_nm(
        &self,
        pivot: &Vector3<f64>,
        links: Range<usize>,
        gravity: &Vector3<f64>,
    ) -> Vector3<f64> {
        let weight = |k| (self.link_centre_m(k) - pivot).cross(gravity) * self.link_mass_kg(k);
        links.map(weight).sum()
    }

    /// Generalised force on a reading of the weights of all links its joints move, or of those behind their own links,
    /// positive towards +q [N m] (prismatic: [N]).
    pub fn torque_nm(&self, joint: usize, outer: bool, gravity: &Vector3<f64>) -> f64 {
        let of = |j: &JointAxis| {
            let links = j.links.start + usize::from(outer)..j.links.end;
            match j.motion {
                Motion::Revolute => j.axis.dot(&self.moment_nm(&j.origin_m, links, gravity)),
                Motion::Prismatic => {
                    let mass: f64 = links.map(|k| self.link_mass_kg(k)).sum();
                    j.axis.dot(gravity) * mass
                }
            }
        };
        self.over_joints(joint, of)
    }

    /// The feature that is the tip of a joint's arm.
    pub fn tip_of(&self, joint: usize) -> FeatureId {
        FeatureId(self.links[self.joints[joint].links.start].arm)
    }

    /// Generalised force on a reading of one kilogram at a feature; none where the joint does not move it.
    pub fn kilogram_nm(&self, joint: usize, at: FeatureId, gravity: &Vector3<f64>) -> f64 {
        let Some((hook, link)) = self.hooks.get(at.0).and_then(|hook| Some((hook, hook.link?))) else {
            return 0.0;
        };
        self.over_joints(joint, |j| match j.motion {
            _ if !j.links.contains(&link) => 0.0,
            Motion::Revolute => j.axis.dot(&(hook.at_m - j.origin_m).cross(gravity)),
            Motion::Prismatic => j.axis.dot(gravity),
        })
    }

    /// The sum of `of` over the loads of an observation that some links carry, each with where it hangs [m] and its mass [kg].
    pub fn over_loads(
        &self,
        o: &Observation,
        links: &Range<usize>,
        of: impl Fn(&Vector3<f64>, f64) -> Vector3<f64>,
    ) -> Vector3<f64> {
        let carried = |load: Load| {
            let hook = self.hooks.get(load.at.0)?;
            hook.link.filter(|link| links.contains(link)).map(|_| of(&hook.at_m, load.kg))
        };
        o.loads().filter_map(carried).reduce(|sum, one| sum + one).unwrap_or_else(Vector3::zeros)
    }

    /// The joint of a reading, and those that follow it by their ratios.
    fn over_joints(&self, joint: usize, of: impl Fn(&JointAxis) -> f64) -> f64 {
        let following = self.mimics.iter().filter(|(reading, ..)| *reading == joint);
        following.fold(of(&self.joints[joint]), |sum, (_, ratio, mimic)| sum + ratio * of(mimic))
    }
}

/// The axis of the joint that a segment holds, at `value` [rad] (prismatic: [m]).
fn joint_axis(
    id: SegmentId,
    segment: &Segment,
    before: Rigid<f64>,
    end: &Rigid<f64>,
    (p, value): (&[f64], f64),
) -> JointAxis {
    let (origin_m, axis) = match &segment.geometry {
        Geometry::ModifiedDh { .. } => {
            // Rx(alpha) Tx(a) stands before the axis.
            let a_m = p.get(segment.parameters.start + 2).copied().unwrap_or_default();
            let origin_m = before.translation_m + before.rotation.column(0) * a_m;
            (origin_m, end.rotation.column(2).into_owned())
        }
        Geometry::Axis(axis) => (before.translation_m, before.rotation * axis),
        Geometry::StandardDh { .. } | Geometry::Origin { .. } => {
            (before.translation_m, before.rotation.column(2).into_owned())
        }
    };
    let motion = segment.joint.map_or(Motion::Revolute, |joint| joint.motion);
    let slid_m = if motion == Motion::Prismatic { value } else { 0.0 };
    let start_m = origin_m + axis * slid_m;
    JointAxis { origin_m, start_m, axis, motion, segment: id, before, links: 0..0 }
}

/// What a link weighs that weighs as much as it is long.
fn uniform_link_body(link: &Link) -> Body {
    let mut all = Body::NONE;
    for to_m in &link.to_m {
        let mass_kg = LINK_DENSITY_KGPM * (to_m - link.from_m).norm();
        all.add(&Body { mass_kg, centre_m: (link.from_m + to_m) * 0.5 });
    }
    all
}
