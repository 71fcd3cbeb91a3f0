//! The arm without its effects and before calibration: what they are placed on, and what drives them.

use super::nominal_pose::NominalPose;
use crate::Chain;
use crate::segment::Segment;
use crate::tree::{Feature, SegmentId, Tree};
use armcal_core::{Parameter, Pose, Unit};
use std::collections::BTreeMap;

/// What of a model has no effect in it.
#[derive(Debug, Clone, Copy)]
pub struct NominalArm<'a> {
    /// Its chain, of several arms all of them.
    pub chain: &'a Chain,
    /// Every parameter of the model.
    pub parameters: &'a [Parameter],
    pub(crate) tree: &'a Tree,
    pub(crate) features: &'a [Feature],
    pub(crate) boards: &'a BTreeMap<usize, Segment>,
}

impl<'a> NominalArm<'a> {
    fn nominal(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.nominal).collect()
    }

    /// It in a pose.
    pub(crate) fn pose(&self, joint_rad: &[f64]) -> NominalPose {
        let routes = self.features.iter().map(|feature| &feature.route);
        let ends: Vec<SegmentId> = routes.filter_map(|route| route.last().copied()).collect();
        NominalPose::of(self.tree, (self.chain.bases(), &ends), &self.nominal(), joint_rad)
    }

    /// It with all joints at zero.
    pub(crate) fn zero_pose(&self) -> NominalPose {
        self.pose(&vec![0.0; self.chain.joint_names.len()])
    }

    /// world_from_board of a recording, if it has a board.
    pub(super) fn board_in_world(&self, recording: usize) -> Option<Pose> {
        self.boards.get(&recording).map(|board| Pose::from(&board.transform(&self.nominal(), &[])))
    }

    /// Whether the pose of a recording's board is found by the fit, with nothing else known of it.
    pub(super) fn board_is_estimated(&self, recording: usize) -> bool {
        let own = self.boards.get(&recording).map_or(0..0, |board| board.parameters.clone());
        self.parameters[own].iter().any(|p| p.free && p.prior_sigma.is_none())
    }

    /// Every length of the chain and of the tips that is not zero: index in the parameter vector, nominal [m].
    pub(crate) fn lengths_m(&self) -> Vec<(usize, f64)> {
        let tips = (0..self.chain.bases()).flat_map(|arm| self.feature_segment(arm).parameters.clone());
        (0..self.chain.parameters.len())
            .chain(tips)
            .map(|index| (index, &self.parameters[index]))
            .filter(|(_, p)| p.unit == Unit::Metre && p.nominal != 0.0)
            .map(|(index, p)| (index, p.nominal))
            .collect()
    }

    /// The segment of the tip of an arm, or of a marker.
    pub(super) fn feature_segment(&self, feature: usize) -> &'a Segment {
        &self.tree.0[self.features[feature].route.last().copied().unwrap_or(feature)]
    }

    /// The parameters of the tree (chain, base, tip), which effects may act on, with their indices.
    pub(super) fn on_path(&self) -> impl Iterator<Item = (usize, &'a Parameter)> {
        let on_path = |index: usize| self.tree.0.iter().any(|segment| segment.parameters.contains(&index));
        self.parameters.iter().enumerate().filter(move |(index, _)| on_path(*index))
    }
}
