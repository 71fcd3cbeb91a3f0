//! Fewer names for the same: what two effects of one joint do, one may do alone.
//!
//! A search takes what explains most at each step. Of causes in several joints that may be one family in all of them, which no
//! single one is, and what it leaves of a cause then gets a name of its own. With what was found elsewhere in the model, each
//! joint that has several names is asked once more: one takes their place where the model with it says as much of dwells that it did not see.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::judge::conditioned_problems::ConditionedProblems;
use crate::problem::Candidate;
use crate::search::accepted::{Accepted, accepted_candidates};
use crate::search::found::{Found, going_on};

/// The same with one name for several of a target, wherever that says as much.
pub(crate) fn merge_names(
    conditioned_problems: &mut ConditionedProblems<'_>,
    mut found: Found,
    config: &DiagnosisConfig,
) -> Result<Found, DiagnoseError> {
    while let Some(simpler) = merge_first_target(conditioned_problems, &found.accepted, config)? {
        found = simpler;
    }
    Ok(found)
}

/// With one name for several of the first target for which that says as much; none where there is no such target.
fn merge_first_target(
    conditioned_problems: &mut ConditionedProblems<'_>,
    accepted: &[Accepted],
    config: &DiagnosisConfig,
) -> Result<Option<Found>, DiagnoseError> {
    let names = accepted_candidates(accepted);
    let mut targets: Vec<&str> = names.iter().map(|c| c.target.as_str()).collect();
    targets.sort_unstable();
    targets.dedup();
    for target in targets {
        let (own, others): (Vec<Candidate>, Vec<Candidate>) =
            names.iter().cloned().partition(|c| c.target == target);
        // What the user knows to act is not traded.
        if own.len() < 2 || own.iter().any(|c| c.known.is_some()) {
            continue;
        }
        let conditioned = conditioned_problems.with(&others)?;
        let ranked =
            conditioned.weighed.ranking().into_iter().map(|k| &conditioned.weighed.entries[k].candidate);
        let Some(one) = ranked.into_iter().find(|c| c.target == target && !c.is_group()) else { continue };
        let with_one = [others, vec![one.clone()]].concat();
        let (Some(before), Some(after)) = (
            conditioned_problems.score(&names, &conditioned),
            conditioned_problems.score(&with_one, &conditioned),
        ) else {
            continue;
        };
        if before.above(&after).nats >= config.margin_nats {
            continue;
        }
        let again = going_on(conditioned_problems, &with_one, config)?
            .filter(|again| again.accepted.len() < names.len());
        if again.is_some() {
            return Ok(again);
        }
    }
    Ok(None)
}

#[cfg(test)]
#[path = "../tests/fewer.rs"]
mod tests;
