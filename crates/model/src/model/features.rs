//! What can be measured of an arm: its tip, and markers on its links; and every frame of it, for drawing.

use super::Model;
use crate::measurements::find_measurement;
use crate::rigid::Rigid;
use crate::tree::SegmentId;
use crate::twist::Twist;
use armcal_core::{Against, FeatureId, Observation, Pose, Reference};
use nalgebra::Matrix6xX;
use std::collections::BTreeSet;
use std::ops::Range;

/// A frame of the arm, for drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFrame {
    /// A DH row, a link of the URDF, a base, a tip.
    pub name: String,
    /// The one that it hangs on, by its place among all; none for a base.
    pub parent: Option<usize>,
    /// Where it is in the base, of several arms the first one's.
    pub in_base: Pose,
}

impl Model {
    /// Every frame of the arm: base, the end of each segment (a DH row, or a link of the URDF, fixed ones included), tip;
    /// parents before those that hang on them.
    pub fn link_frames(&self, p: &[f64], joint_rad: &[f64]) -> Vec<LinkFrame> {
        let mut ends: Vec<Rigid<f64>> = Vec::with_capacity(self.tree.0.len());
        // By segment: the last frame with a name on the way to it.
        let mut named: Vec<Option<usize>> = Vec::with_capacity(self.tree.0.len());
        let mut frames: Vec<LinkFrame> = Vec::with_capacity(self.tree.0.len());
        let first = self.base_in_world(p).inverse();
        for (id, segment) in self.tree.0.iter().enumerate() {
            // In the base frame the base is where it is.
            let end = match segment.parent {
                None if id == 0 => Rigid::identity(),
                None => Rigid::from(&(first * self.arm_base_in_world(p, id))),
                Some(parent) => ends[parent].then(&segment.transform(p, joint_rad)),
            };
            let parent = segment.parent.and_then(|parent| named[parent]);
            named.push(segment.frame.as_ref().map_or(parent, |_| Some(frames.len())));
            let frame = |name: &String| LinkFrame { name: name.clone(), parent, in_base: Pose::from(&end) };
            frames.extend(segment.frame.iter().map(frame));
            ends.push(end);
        }
        frames
    }

    /// The arm, of several, that a feature is on.
    pub fn arm_of(&self, feature: FeatureId) -> usize {
        self.route(feature).first().copied().unwrap_or(0)
    }

    /// A feature in the link that carries it.
    pub fn feature_in_link(&self, p: &[f64], feature: FeatureId) -> Pose {
        let own = self.route(feature).last().map(|end| self.tree.0[*end].transform(p, &[]));
        own.map_or_else(Pose::identity, |own| Pose::from(&own))
    }

    /// A feature in the base frame, effects left out.
    pub fn feature_in_base(&self, p: &[f64], feature: FeatureId, joint_rad: &[f64]) -> Pose {
        Pose::from(&self.tree.follow(&self.route(feature)[1..], p, joint_rad))
    }

    /// Motion of a feature per unit of each joint reading, in the order of its route.
    pub(super) fn joint_twists(&self, p: &[f64], feature: FeatureId, o: &Observation) -> Vec<(usize, Twist)> {
        if let Some((model, p)) = self.seen(p, o) {
            return model.joint_twists(&p, feature, o);
        }
        match &self.effects {
            None => self.tree.joint_twists(self.route(feature), p, &o.joint_rad).1,
            Some(effects) => effects.joint_twists(p, feature, &self.drivers(&effects.session, o)),
        }
    }

    /// The joints whose readings move a feature, rising.
    pub fn joints_to(&self, feature: FeatureId) -> BTreeSet<usize> {
        let joints = self.route(feature).iter().filter_map(|id| self.tree.0[*id].joint);
        joints.map(|joint| joint.index).collect()
    }

    /// Those of them that move another branch too, such as the waist of a torso with two arms.
    pub fn joints_shared_by(&self, feature: FeatureId) -> BTreeSet<usize> {
        let own = self.joints_to(feature);
        let beside = |theirs: &BTreeSet<usize>| !theirs.is_subset(&own) && !own.is_subset(theirs);
        let others = self.features().map(|(other, _)| self.joints_to(other)).filter(beside);
        others.flat_map(|theirs| own.intersection(&theirs).copied().collect::<Vec<usize>>()).collect()
    }

    /// The names of what can be measured of the arm: its tip, then its markers.
    pub fn features(&self) -> impl Iterator<Item = (FeatureId, &str)> {
        self.features.iter().enumerate().map(|(k, feature)| (FeatureId(k), feature.name.as_str()))
    }

    /// The markers: which feature each is, its name, and the link that it is on.
    pub fn markers(&self) -> impl Iterator<Item = (FeatureId, &str, &str)> {
        let all = self.features.iter().enumerate();
        all.filter_map(|(k, feature)| Some((FeatureId(k), feature.name.as_str(), feature.link.as_deref()?)))
    }

    /// Whether two features are on the same link.
    pub fn on_one_link(&self, a: FeatureId, b: FeatureId) -> bool {
        let [a, b] = [a, b].map(|feature| self.route(feature).iter().rev().nth(1));
        a == b
    }

    /// The name of a marker; none of the tip.
    pub fn marker_name(&self, feature: FeatureId) -> Option<&str> {
        (!feature.is_tip()).then(|| self.feature_name(feature))
    }

    /// The name of a feature.
    pub fn feature_name(&self, feature: FeatureId) -> &str {
        self.features.get(feature.0).map_or("", |feature| feature.name.as_str())
    }

    /// The points and planes that stand fixed in the world: which place each is, its name, and whether it is a plane.
    pub fn places(&self) -> impl Iterator<Item = (usize, &str, bool)> {
        self.fixed.iter().enumerate().map(|(k, place)| (k, place.name.as_str(), place.is_plane))
    }

    /// Where a fixed place is; of a plane z is its normal.
    pub fn place_in_world(&self, p: &[f64], place: usize) -> Pose {
        Pose::from(&self.fixed[place].segment.transform(p, &[]))
    }

    /// The name of what something was measured against.
    pub fn against_name(&self, against: Against) -> &str {
        match against {
            Against::Feature(feature) => self.feature_name(feature),
            Against::Fixed(place) => self.fixed.get(place).map_or("", |place| place.name.as_str()),
        }
    }

    /// What an observation is, in words: none of the tip where a sensor saw it or a table held it, else such as `elbow` or `tip
    /// from post`.
    pub fn measured_name(&self, o: &Observation) -> Option<String> {
        let place = match o.against() {
            Some(Against::Fixed(place)) => place,
            // Of two arms the tips are joined in every observation.
            Some(Against::Feature(to)) if self.chain.arms().is_empty() => {
                return Some(format!("{} and {}", self.feature_name(o.feature), self.feature_name(to)));
            }
            _ => return self.marker_name(o.feature).map(str::to_owned),
        };
        let how = match &o.reference {
            Reference::Number { kind, .. } => find_measurement(kind).map_or("at", |kind| kind.preposition),
            _ => "in",
        };
        Some(format!("{} {how} {}", self.feature_name(o.feature), self.fixed[place].name))
    }

    /// The lengths that distances count from: what has each, and its index in the parameter vector.
    pub fn lengths(&self) -> impl Iterator<Item = (&str, usize)> {
        let name = |index: usize| self.parameters[index].name.strip_suffix(".length").unwrap_or("");
        self.lengths.iter().map(move |&index| (name(index), index))
    }

    /// Where the model puts a feature, in the world, effects included.
    pub fn feature_in_world(&self, p: &[f64], feature: FeatureId, o: &Observation) -> Pose {
        if let Some((model, p)) = self.seen(p, o) {
            return model.feature_in_world(&p, feature, o);
        }
        let at = match &self.effects {
            None => self.tree.follow(self.route(feature), p, &o.joint_rad),
            Some(effects) => {
                effects.evaluate(&effects.predicting(p), p, feature, &self.drivers(&effects.session, o)).tip
            }
        };
        Pose::from(&at)
    }

    /// d position [m] and d rotation vector [rad] of a feature, in the world, per unit of each joint reading: 6 rows, one
    /// column a reading.
    pub fn feature_jacobian(&self, p: &[f64], feature: FeatureId, o: &Observation) -> Matrix6xX<f64> {
        let mut jacobian = Matrix6xX::zeros(self.joint_count());
        for (column, twist) in self.joint_twists(p, feature, o) {
            let mut moved = jacobian.fixed_view_mut::<3, 1>(0, column);
            moved += twist.translation_m;
            let mut turned = jacobian.fixed_view_mut::<3, 1>(3, column);
            turned += twist.rotation_rad;
        }
        jacobian
    }

    /// Indices of the parameters of a feature's place on its link.
    pub fn feature_parameters(&self, feature: FeatureId) -> Range<usize> {
        self.route(feature).last().map_or(0..0, |end| self.tree.0[*end].parameters.clone())
    }

    /// The segments from the world to a feature.
    pub(crate) fn route(&self, feature: FeatureId) -> &[SegmentId] {
        &self.features[feature.0].route
    }
}
