//! Joints whose effort is measured in some dwells only: what follows it cannot be told in the others.

use crate::seen::RecordingData;
use armcal_core::{Code, Dwell, Severity, Stage, Warning, list_names};
use std::collections::BTreeMap;

/// Says of each recording which joints have dwells without a measured effort, where any joint of any recording has one at all.
pub fn warn_of_gaps(joints: &[String], seen: &mut [RecordingData]) {
    let lacks = |d: &&Dwell, j: usize| {
        d.effort_nm.as_ref().and_then(|all| all.get(j)).is_none_or(|effort| !effort.is_finite())
    };
    let measured = seen.iter().flat_map(|s| &s.dwells).any(|d| d.effort_nm.is_some());
    for seen in seen.iter_mut().filter(|_| measured) {
        let mut by_count: BTreeMap<usize, Vec<String>> = BTreeMap::new();
        for (j, joint) in joints.iter().enumerate() {
            let without = seen.dwells.iter().filter(|d| lacks(d, j)).count();
            by_count.entry(without).or_default().push(joint.clone());
        }
        by_count.remove(&0);
        seen.warnings
            .extend(by_count.iter().map(|(without, names)| gap_warning(*without, seen.dwells.len(), names)));
    }
}

fn gap_warning(without: usize, dwells: usize, joints: &[String]) -> Warning {
    let said = format!(
        "{without} of {dwells} dwells have no measured effort of it: no effect can follow it (effort_compliance, a formula over \
         it), in this recording or beside it; joints that have theirs are not touched. Record the effort, or calibrate without \
         such dwells"
    );
    let subject = format!("effort of {}", list_names(joints));
    Warning::new(Severity::Notice, Stage::Dwell, Code::EffortIncomplete, subject, said)
}
