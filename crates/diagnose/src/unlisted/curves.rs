//! Several unlisted error curves: each joint may err over its own angle, all at once.
//!
//! The first curve joins the base where the best unlisted cell is a joint's own angle, others while that of another joint
//! predicts places the fit did not see. Each is then described among the others, so that none carries another's shape.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::diagnosis::UnknownReport;
use crate::diagnosis::ripple::Peak;
use crate::judge::conditioned_problems::{ConditionedProblem, ConditionedProblems, as_candidate};
use crate::problem::Candidate;
use crate::unlisted::describe_unlisted;
use crate::weigh::Outside;

/// A joint's own error curve.
#[derive(Debug)]
pub(crate) struct Curve {
    /// Its columns as they joined the base.
    pub candidate: Candidate,
    /// What it is among the others.
    pub report: UnknownReport,
}

/// Curves that are real with `names` in the model, the strongest first.
pub(crate) fn error_curves(
    conditioned_problems: &mut ConditionedProblems<'_>,
    names: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<Vec<Curve>, DiagnoseError> {
    let mut shapes: Vec<Candidate> = Vec::new();
    loop {
        let base: Vec<Candidate> = names.iter().chain(&shapes).cloned().collect();
        let conditioned = conditioned_problems.with(&base)?;
        let explained = || conditioned.weighed.p_nothing >= config.max_probability_nothing;
        if shapes.len() >= conditioned.problem.joints() || (!shapes.is_empty() && explained()) {
            break;
        }
        let Some(best) = leading_curve(&conditioned, &shapes, config) else { break };
        shapes.push(as_candidate(&best.what, &conditioned, config));
    }
    let mut curves = Vec::new();
    for (k, shape) in shapes.iter().enumerate() {
        let others = shapes.iter().enumerate().filter(|(l, _)| *l != k).map(|(_, s)| s);
        let base: Vec<Candidate> = names.iter().chain(others).cloned().collect();
        let conditioned = conditioned_problems.with(&base)?;
        let own = conditioned.weighed.unlisted.iter().filter(|u| u.what.name() == shape.spec);
        let best = own.max_by(|a, b| a.ln_evidence.total_cmp(&b.ln_evidence));
        if let Some(report) = best.and_then(|u| describe_unlisted(&conditioned, u, config)) {
            curves.push(Curve { candidate: shape.clone(), report });
        }
    }
    share_ripples(&mut curves);
    curves.sort_by(|a, b| b.report.gain_nats.total_cmp(&a.report.gain_nats));
    Ok(curves)
}

/// Gears of one make: what stands out in one joint less clearly than a ripple is one where another joint has it clearly.
fn share_ripples(curves: &mut [Curve]) {
    let clear: Vec<Peak> = curves.iter().filter_map(|c| c.report.peak.filter(Peak::is_alone)).collect();
    for report in curves.iter_mut().map(|c| &mut c.report) {
        let shared = report.peak.filter(|p| clear.iter().any(|c| p.is_of_a_make_with(c)));
        report.ripple = report.ripple.or(shared.map(|p| p.ripple));
    }
}

/// The best joint over its own angle that predicts; the first must be as good as the best cell of all.
fn leading_curve<'r>(
    conditioned: &'r ConditionedProblem,
    taken: &[Candidate],
    config: &DiagnosisConfig,
) -> Option<&'r Outside> {
    let weighed = &conditioned.weighed;
    // Joints of one make err alike: after a first curve the next need not lead all cells, only predict.
    let limit = match taken.is_empty() {
        true => weighed.best_cell()?.ln_evidence - config.margin_nats,
        false => config.margin_nats,
    };
    let own = weighed.unlisted.iter().filter(|u| {
        u.ln_evidence >= limit.max(config.margin_nats)
            && u.what.enters.own_angle(u.what.depends).is_some()
            && taken.iter().all(|t| t.spec != u.what.name())
    });
    let mut own: Vec<&Outside> = own.collect();
    own.sort_by(|a, b| b.ln_evidence.total_cmp(&a.ln_evidence));
    own.into_iter().find(|u| conditioned.predicts(u, config))
}
