//! `[closed_chain]`: which two points are joined, and by what.

use crate::pipeline::{FramePose, Pipeline, knowledge};
use armcal_calibrate::HoldoutConfig;
use armcal_core::Observation;
use armcal_model::Length;
use armcal_report::PastObservations;
use serde::Deserialize;
use std::collections::BTreeSet;

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
    /// Why observations of a result cannot be pooled under this.
    pub fn differs(closure: Option<&ClosedChainSection>, past: &PastObservations) -> Option<String> {
        let all = past.recordings.iter().flat_map(|recording| &recording.observations);
        let joined = all.filter(|o| o.is_joined()).map(Observation::is_scalar);
        let said: BTreeSet<bool> = joined.collect();
        match (said.first(), closure) {
            (None, None) => None,
            (Some(_), None) => Some("its tips are joined and the pipeline has no [closed_chain]".into()),
            (None, Some(_)) => {
                Some("none of its tips are joined and the pipeline has a [closed_chain]".into())
            }
            (Some(apart), Some(closure)) => (*apart != (closure.kind == ClosureKind::RigidLink))
                .then(|| "its tips are joined in another way (closed_chain.kind)".into()),
        }
    }

    /// The rigid link between the tips, where that is what joins them.
    pub fn link(&self) -> Option<Length> {
        let length_m = self.length_mm.filter(|_| self.kind == ClosureKind::RigidLink)? * 1e-3;
        Some(Length::of_link(length_m, knowledge(self.length, self.length_sigma_mm)))
    }

    /// What serde cannot see.
    pub fn contradiction(&self, pipeline: &Pipeline) -> Option<(&'static str, String)> {
        if let HoldoutConfig::Cavities { .. } | HoldoutConfig::EveryNthCavity { .. } = pipeline.holdout {
            let said = "goes by cavity, but joined tips have none in common that armcal knows; use \"random\", \"cavity-folds\" \
                        (dwells are dealt out) or \"dwells\"";
            return Some(("holdout.kind", said.to_owned()));
        }
        if pipeline.table.is_some() {
            let said = "is there and [closed_chain] too: calibrate dwells in a board and dwells with joined tips apart";
            return Some(("table", said.to_owned()));
        }
        if let Some(said) = self.no_two_points(pipeline) {
            return Some(("closed_chain.between", said));
        }
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if !positive(self.sigma_mm) {
            return Some((
                "closed_chain.sigma_mm",
                "must be above zero: no joint holds a point exactly".into(),
            ));
        }
        if !positive(self.max_gap_mm) {
            return Some(("closed_chain.max_gap_mm", "must be above zero".into()));
        }
        match (self.kind, self.length_mm) {
            (ClosureKind::RigidLink, None) => Some((
                "closed_chain.length_mm",
                "is missing; a rigid link has a length, even if it is estimated".into(),
            )),
            (ClosureKind::RigidLink, Some(mm)) if !positive(mm) => {
                Some(("closed_chain.length_mm", "must be above zero".into()))
            }
            (ClosureKind::SamePoint, Some(_)) => Some((
                "closed_chain.length_mm",
                "has no meaning for tips in one point; use kind = \"rigid-link\" or remove it".into(),
            )),
            _ => None,
        }
    }

    /// Why these are not two points of the robot.
    fn no_two_points(&self, pipeline: &Pipeline) -> Option<String> {
        let markers: Vec<&str> = pipeline.markers.keys().map(String::as_str).collect();
        match (&self.between, &pipeline.two_arms) {
            (Some(_), Some(_)) => Some("is for one robot; of [[arms]] the tips are joined: remove it".into()),
            (None, Some(_)) => None,
            (None, None) => Some(
                "is missing: name the two points of the robot, such as between = [\"tip\", \"left_hand\"] with \
                 [markers.left_hand] on the link of the other tip"
                    .into(),
            ),
            (Some([a, b]), None) if a == b => Some(format!("names `{a}` twice; name two points")),
            (Some(names), None) => {
                let unknown = names.iter().find(|name| *name != "tip" && !markers.contains(&name.as_str()))?;
                let known = [&["tip"], &markers[..]].concat().join(", ");
                Some(format!("names `{unknown}`; the points of this robot are {known}: add [markers.{unknown}] with link = \"...\""))
            }
        }
    }
}
