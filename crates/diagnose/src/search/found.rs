//! What names leave, searched further.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::judge::conditioned_problems::ConditionedProblems;
use crate::problem::Candidate;
use crate::search::accepted::Accepted;
use crate::search::forward::{Step, confirm, forward_selection};

/// Names that were confirmed, each beside the others.
pub(crate) struct Found {
    /// Those names.
    pub accepted: Vec<Accepted>,
    /// Whether what remains is so small a part of an effect that was found that it may be its shape.
    pub may_be_shape: bool,
}

/// The names of which these are the first: confirmed, then what they leave. None where not all of them are confirmed.
pub(crate) fn going_on(
    conditioned_problems: &mut ConditionedProblems<'_>,
    names: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<Option<Found>, DiagnoseError> {
    let steps = names.iter().map(|c| Step::known(c.clone(), f64::INFINITY)).collect();
    let accepted = confirm(conditioned_problems, steps, &[], config)?;
    if accepted.len() < names.len() {
        return Ok(None);
    }
    let known = accepted.iter().map(|a| Step::known(a.candidate.clone(), a.fall())).collect();
    let (steps, may_be_shape) = forward_selection(conditioned_problems, known, &[], config)?;
    let same = steps.iter().map(|s| &s.candidate.spec).eq(accepted.iter().map(|a| &a.candidate.spec));
    let accepted = if same { accepted } else { confirm(conditioned_problems, steps, &[], config)? };
    Ok((accepted.len() >= names.len()).then_some(Found { accepted, may_be_shape }))
}
