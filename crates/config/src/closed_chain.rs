//! `[closed_chain]`: which two points are joined, and by what.

use crate::FramePose;
use crate::measures::length_knowledge;
use armcal_model::Length;
use serde::Deserialize;

/// How two tips are joined.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClosedChainSection {
    /// Of one robot: which points, `"tip"` or a marker; of `[[arms]]` their tips are.
    pub between: Option<[String; 2]>,
    /// `"same-point"` or `"rigid-link"`.
    pub kind: ClosureKind,
    /// With a rigid link: the distance of the two tips [mm].
    pub length_mm: Option<f64>,
    /// How well that is known: `"given"` (default), `"measured"` with `length_sigma_mm`, `"estimated"`.
    #[serde(default)]
    pub length: FramePose,
    /// Standard error of a measured length [mm].
    #[serde(default)]
    pub length_sigma_mm: f64,
    /// How far apart the joined points may be all the same, 1 sigma per axis [mm]; default 0.1.
    #[serde(default = "default_sigma_mm")]
    pub sigma_mm: f64,
    /// Dwells in which the nominal arms have their tips further from closing than this are not joined [mm]; default 100.
    #[serde(default = "default_max_gap_mm")]
    pub max_gap_mm: f64,
}

/// How tips can be joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClosureKind {
    /// Both in one point.
    SamePoint,
    /// On a rigid link with a ball joint at either end.
    RigidLink,
}

fn default_sigma_mm() -> f64 {
    0.1
}

fn default_max_gap_mm() -> f64 {
    100.0
}

impl ClosedChainSection {
    /// The rigid link between the tips, where that is what joins them.
    pub fn link(&self) -> Option<Length> {
        let length_m = self.length_mm.filter(|_| self.kind == ClosureKind::RigidLink)? * 1e-3;
        Some(Length::of_link(length_m, length_knowledge(self.length, self.length_sigma_mm)))
    }
}
