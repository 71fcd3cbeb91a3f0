//! What transforms join.

use crate::streams::occlusion::Seen;
use armcal_core::Pose;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use std::collections::BTreeMap;

/// Where one child was in one parent.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Edge {
    /// In the first message.
    pub first: Seen,
    pub is_constant: bool,
    pub messages: u64,
}

impl Edge {
    pub fn new(first: Seen) -> Edge {
        Edge { first, is_constant: true, messages: 1 }
    }

    /// Takes in what came later.
    pub fn add(&mut self, later: &Edge) {
        self.is_constant &= later.is_constant && later.first == self.first;
        self.messages += later.messages;
    }

    /// parent_from_child, where it is constant.
    pub fn pose(&self) -> Option<Pose> {
        let [x, y, z, w] = self.first.quaternion_xyzw.filter(|_| self.first.has_unit_quaternion())?;
        let turned = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Some(Pose::from_parts(Translation3::from(self.first.position_m), turned))
    }
}

/// All transforms by parent and child.
pub(crate) type Edges = BTreeMap<(String, String), Edge>;
