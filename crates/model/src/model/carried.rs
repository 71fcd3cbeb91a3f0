//! A point that a feature carries along, followed through many poses of one rigid arm.

use super::Model;
use crate::tree::{Asked, SegmentId, TreeAt};
use crate::twist::Twist;
use armcal_core::FeatureId;
use nalgebra::{Matrix3, Vector3};

/// A point of a feature's frame in the base frame, effects left out, at one parameter vector. What no joint moves is worked
/// out once.
pub struct CarriedPoint<'a> {
    tree: TreeAt<'a>,
    route: &'a [SegmentId],
    point_m: Vector3<f64>,
}

/// Where such a point is, and what moves it.
pub struct CarriedMotions {
    /// In the base frame [m].
    pub at_m: Vector3<f64>,
    /// (index in the parameter vector, motion [m per unit]), in the order of the feature's route.
    pub parameters: Vec<(usize, Vector3<f64>)>,
    /// Its motion per metre along each axis of the feature's frame.
    pub axes: Matrix3<f64>,
}

impl Model {
    /// The point `point_m` of a feature's frame [m], with motions by the parameters `asked` for.
    pub fn carried_point(
        &self,
        p: &[f64],
        feature: FeatureId,
        point_m: Vector3<f64>,
        asked: &Asked<'_>,
    ) -> CarriedPoint<'_> {
        let tree = TreeAt::of(&self.tree, p.to_vec(), Some(asked));
        CarriedPoint { tree, route: &self.route(feature)[1..], point_m }
    }
}

impl CarriedPoint<'_> {
    /// Where it is in a pose of the arm [m].
    pub fn at_m(&self, joint_rad: &[f64]) -> Vector3<f64> {
        self.tree.point(self.route, joint_rad, self.point_m)
    }

    /// The same, with what moves it.
    pub fn motions(&self, joint_rad: &[f64]) -> CarriedMotions {
        let feature = self.tree.linearised(self.route, joint_rad);
        let arm_m = feature.at.rotation * self.point_m;
        let moved = |twist: &Twist| twist.translation_m + twist.rotation_rad.cross(&arm_m);
        let parameters = feature.parameters.iter().map(|(index, twist)| (*index, moved(twist)));
        CarriedMotions {
            at_m: feature.at.translation_m + arm_m,
            parameters: parameters.collect(),
            axes: feature.at.rotation,
        }
    }
}
