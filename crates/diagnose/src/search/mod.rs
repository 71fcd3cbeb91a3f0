//! The whole search: from nothing or from names that were proposed, then beside the unlisted shapes that may hide effects.

pub(crate) mod accepted;
pub(crate) mod fewer;
pub(crate) mod forward;
pub(crate) mod found;
pub(crate) mod settle;

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::judge::conditioned_problems::{ConditionedProblem, ConditionedProblems, as_candidate};
use crate::problem::Candidate;
use crate::search::accepted::{Accepted, accepted_candidates};
use crate::search::fewer::merge_names;
use crate::search::forward::{confirm, confirmed_steps, forward_selection};
use crate::search::found::{Found, going_on};
use crate::unlisted::curves::{Curve, error_curves};
use std::rc::Rc;

/// Where the search ended.
#[derive(Debug)]
pub(crate) struct Search {
    /// Effects whose names may be told.
    pub accepted: Vec<Accepted>,
    /// Effects that show only with the best unlisted shape in the model too.
    pub tentative: Vec<Accepted>,
    /// Error curves of joints over their own angle that no name explains, the strongest first.
    pub curves: Vec<Curve>,
    /// What remains with the named ones in the model.
    pub rest: Rc<ConditionedProblem>,
    /// What remains with the curves in it too.
    pub with_curves: Rc<ConditionedProblem>,
    /// Whether anything remains that these data show.
    pub left_over: bool,
    /// Whether what remains is so small a part of an effect that was found that it may be that effect's shape.
    pub may_be_shape: bool,
}

/// Searches; then once more with the unlisted shapes in the model, for effects they may hide. It begins with names that were
/// `proposed` where each of them stands here too.
pub(crate) fn search(
    conditioned_problems: &mut ConditionedProblems<'_>,
    proposed: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<Search, DiagnoseError> {
    let Found { mut accepted, may_be_shape } =
        match from_proposed_names(conditioned_problems, proposed, config)? {
            Some(found) => merge_names(conditioned_problems, found, config)?,
            None => from_nothing(conditioned_problems, config)?,
        };
    let mut names = accepted_candidates(&accepted);
    let mut rest = conditioned_problems.with(&names)?;
    let left_over = rest.is_something_missing(config);
    let (mut tentative, mut curves) = (Vec::new(), Vec::new());
    if left_over && !may_be_shape {
        curves = error_curves(conditioned_problems, &names, config)?;
        let mut shapes: Vec<Candidate> = curves.iter().map(|c| c.candidate.clone()).collect();
        accepted = beside_curves(conditioned_problems, accepted, &shapes, &rest, config)?;
        names = accepted_candidates(&accepted);
        rest = conditioned_problems.with(&names)?;
        if shapes.is_empty() {
            let best = rest.weighed.best_cell().filter(|c| c.ln_evidence >= config.margin_nats);
            shapes.extend(best.map(|cell| as_candidate(&cell.what, &rest, config)));
        }
        if !shapes.is_empty() {
            let (steps, _) =
                forward_selection(conditioned_problems, confirmed_steps(&names, &rest), &shapes, config)?;
            if steps.len() > names.len() {
                tentative = confirm(conditioned_problems, steps, &shapes, config)?;
                tentative.retain(|t| names.iter().all(|n| n.spec != t.candidate.spec));
            }
        }
    }
    let all: Vec<Candidate> =
        names.iter().cloned().chain(curves.iter().map(|c| c.candidate.clone())).collect();
    let with_curves = conditioned_problems.with(&all)?;
    let may_be_shape = left_over && may_be_shape;
    Ok(Search { accepted, tentative, curves, rest, with_curves, left_over, may_be_shape })
}

/// The names that a search finds which begins with none.
pub(crate) fn from_nothing(
    conditioned_problems: &mut ConditionedProblems<'_>,
    config: &DiagnosisConfig,
) -> Result<Found, DiagnoseError> {
    let (steps, may_be_shape) = forward_selection(conditioned_problems, Vec::new(), &[], config)?;
    let accepted = confirm(conditioned_problems, steps, &[], config)?;
    merge_names(conditioned_problems, Found { accepted, may_be_shape }, config)
}

/// The same from names that fewer dwells proposed. None where not all of them are confirmed here, each as the best there is
/// beside the others: then the steps that led to them would be others.
fn from_proposed_names(
    conditioned_problems: &mut ConditionedProblems<'_>,
    proposed: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<Option<Found>, DiagnoseError> {
    if proposed.is_empty() {
        return Ok(None);
    }
    let found = going_on(conditioned_problems, proposed, config)?;
    Ok(found.filter(|found| found.accepted.iter().all(|a| a.leads(config))))
}

/// The names that stand beside error curves too: what a curve of a joint's own angle explains as well was never that effect.
fn beside_curves(
    conditioned_problems: &mut ConditionedProblems<'_>,
    accepted: Vec<Accepted>,
    curves: &[Candidate],
    rest: &ConditionedProblem,
    config: &DiagnosisConfig,
) -> Result<Vec<Accepted>, DiagnoseError> {
    if curves.is_empty() {
        return Ok(accepted);
    }
    let kept = confirm(
        conditioned_problems,
        confirmed_steps(&accepted_candidates(&accepted), rest),
        curves,
        config,
    )?;
    if kept.len() == accepted.len() {
        return Ok(accepted);
    }
    let mut steps = accepted_candidates(&accepted);
    steps.retain(|c| kept.iter().any(|k| k.candidate.spec == c.spec));
    confirm(conditioned_problems, confirmed_steps(&steps, rest), &[], config)
}

#[cfg(test)]
#[path = "../tests/search.rs"]
mod tests;
