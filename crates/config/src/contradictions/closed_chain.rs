//! Joined tips that contradict the rest of the pipeline.

use crate::{ClosedChainSection, ClosureKind, Pipeline};
use armcal_calibrate::HoldoutConfig;

/// The key of a closed chain that cannot be, and why.
pub fn find_contradiction(chain: &ClosedChainSection, pipeline: &Pipeline) -> Option<(&'static str, String)> {
    if let HoldoutConfig::Cavities { .. } | HoldoutConfig::EveryNthCavity { .. } = pipeline.holdout {
        let said = "goes by cavity, but joined tips have none in common that armcal knows; use \"random\", \"cavity-folds\" \
                    (dwells are dealt out) or \"dwells\"";
        return Some(("holdout.kind", said.to_owned()));
    }
    if pipeline.table.is_some() {
        let said =
            "is there and [closed_chain] too: calibrate dwells in a board and dwells with joined tips apart";
        return Some(("table", said.to_owned()));
    }
    if let Some(said) = no_two_points(chain, pipeline) {
        return Some(("closed_chain.between", said));
    }
    let positive = |v: f64| v.is_finite() && v > 0.0;
    if !positive(chain.sigma_mm) {
        return Some(("closed_chain.sigma_mm", "must be above zero: no joint holds a point exactly".into()));
    }
    if !positive(chain.max_gap_mm) {
        return Some(("closed_chain.max_gap_mm", "must be above zero".into()));
    }
    match (chain.kind, chain.length_mm) {
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
fn no_two_points(chain: &ClosedChainSection, pipeline: &Pipeline) -> Option<String> {
    let markers: Vec<&str> = pipeline.markers.keys().map(String::as_str).collect();
    match (&chain.between, &pipeline.two_arms) {
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
            Some(format!(
                "names `{unknown}`; the points of this robot are {known}: add [markers.{unknown}] with link = \"...\""
            ))
        }
    }
}
