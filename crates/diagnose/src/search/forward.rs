//! More than one missing effect: forward steps with a stop rule, then every effect judged again among the others.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::events::is_same_event;
use crate::judge::conditioned_problems::{ConditionedProblem, ConditionedProblems};
use crate::judge::judged::Grade;
use crate::problem::{Candidate, Problem};
use crate::search::accepted::Accepted;
use crate::weigh::Weighed;
use armcal_model::Toggle;
use std::collections::BTreeSet;

/// Steps none of which had a name at once, and which together say less than one unlisted shape: no more are tried.
const PATIENCE: usize = 4;
/// Share of the nats of an earlier effect that a detail of its shape may gain: a hundredth of the squared error where the effect is ten
/// times what remains, ln(1 + 1) / ln(1 + 100).
const DETAIL_NATS: f64 = 0.15;

/// A step of the search.
pub(crate) struct Step {
    /// What joins the model.
    pub candidate: Candidate,
    named_at_once: bool,
    /// By how much the score rose with it, and would have risen with the best unlisted shape in its place [nats].
    gain_nats: f64,
    unlisted_nats: f64,
    /// Fall of the squared residual, declared noise = 1.
    fall: f64,
}

impl Step {
    /// One that was confirmed before.
    pub fn known(candidate: Candidate, fall: f64) -> Step {
        Step { candidate, named_at_once: true, gain_nats: f64::INFINITY, unlisted_nats: 0.0, fall }
    }

    /// Whether it may be no more than what the formula of an earlier one leaves of its shape: it could look like that, removes a
    /// small share of the squared error that the earlier one removed, and adds a small share of what that one said.
    fn may_be_detail_of(&self, earlier: &Step, config: &DiagnosisConfig) -> bool {
        self.fall < config.leftover_share * earlier.fall
            && self.gain_nats < DETAIL_NATS * earlier.gain_nats
            && switches_alike(&earlier.candidate, &self.candidate)
    }
}

/// Steps that were confirmed before, with the problem that they leave.
pub(crate) fn confirmed_steps(names: &[Candidate], rest: &ConditionedProblem) -> Vec<Step> {
    names.iter().map(|c| Step::known(c.clone(), rest.weighed.base.rss)).collect()
}

/// Judges every step among the others and drops the weakest until all may be named. `cells` stay in the base.
pub(crate) fn confirm(
    conditioned_problems: &mut ConditionedProblems<'_>,
    mut steps: Vec<Step>,
    cells: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<Vec<Accepted>, DiagnoseError> {
    // Together the steps must say more than one unlisted shape: as many of the first as do, and those that did so alone. A
    // later step that says less than it costs does not take a name from an earlier one.
    let together = (0..=steps.len()).rev().find(|n| beats_a_cell(&steps[..*n], config)).unwrap_or(0);
    let mut at = 0..;
    steps.retain(|s| at.next().is_some_and(|k| k < together) || s.named_at_once);
    loop {
        let mut judged = Vec::new();
        let mut gone = None;
        let all: Vec<Candidate> = steps.iter().map(|s| s.candidate.clone()).collect();
        for (k, own) in all.iter().enumerate() {
            let others = [all_but(&all, k), cells.to_vec()].concat();
            let conditioned = conditioned_problems.with(&others)?;
            let weighed = &conditioned.weighed;
            let Some(entry) = entry_of(weighed, own) else {
                gone = Some(k);
                break;
            };
            let mut verdict = conditioned.judge(entry, config);
            if verdict.grade(config) < Grade::Named
                && let Some(score) =
                    conditioned_problems.score(&[others, vec![own.clone()]].concat(), &conditioned)
            {
                verdict.refitted(score, conditioned.nothing());
            }
            let candidate = weighed.entries[entry].candidate.clone();
            judged.push(Accepted {
                candidate,
                grade: verdict.grade(config),
                judged: verdict,
                conditioned: conditioned.clone(),
                set: vec![entry],
                instead_of: Vec::new(),
                ranked: Vec::new(),
            });
        }
        match gone.or_else(|| weakest(&judged)).or_else(|| find_shape_detail(&judged, config)) {
            Some(k) => drop(steps.remove(k)),
            None => return Ok(judged),
        }
    }
}

/// Of what is refused, that which says least.
fn weakest(judged: &[Accepted]) -> Option<usize> {
    let refused = judged.iter().enumerate().filter(|(_, a)| a.grade == Grade::Refused);
    let least = refused.min_by(|a, b| a.1.judged.gain.nats.total_cmp(&b.1.judged.gain.nats));
    least.map(|(k, _)| k)
}

/// What is no more than the detail of another one's shape: it is no effect.
fn find_shape_detail(judged: &[Accepted], config: &DiagnosisConfig) -> Option<usize> {
    let most = judged.iter().map(|a| a.judged.gain.nats).fold(0.0, f64::max);
    judged.iter().position(|a| a.judged.gain.nats < config.leftover_share * most)
}

/// The entry of a candidate; a scan may have moved to another shape, or an event to a dwell nearby.
fn entry_of(weighed: &Weighed, candidate: &Candidate) -> Option<usize> {
    let exact = weighed.entries.iter().position(|e| e.candidate.spec == candidate.spec);
    exact.or_else(|| {
        // A shape that was searched has moved; without it the name stands in the catalogue too.
        let alike = |k: &usize| {
            let other = &weighed.entries[*k].candidate;
            other.family == candidate.family && other.target == candidate.target
        };
        let entry = weighed.ranking().into_iter().find(alike);
        entry.or_else(|| {
            weighed.entries.iter().position(|e| is_same_event(&candidate.spec, &e.candidate.spec))
        })
    })
}

/// Accepts the best candidate again and again while it is promising. `cells` stay in the base.
pub(crate) fn forward_selection(
    conditioned_problems: &mut ConditionedProblems<'_>,
    mut steps: Vec<Step>,
    cells: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<(Vec<Step>, bool), DiagnoseError> {
    let mut may_be_shape = false;
    // Members of a group that leave again would enter again.
    let mut been_at: BTreeSet<Vec<String>> = BTreeSet::new();
    while steps.len() < config.max_effects {
        let mut accepted: Vec<Candidate> = steps.iter().map(|s| s.candidate.clone()).collect();
        accepted.extend_from_slice(cells);
        let conditioned = match conditioned_problems.with(&accepted) {
            Ok(conditioned) => conditioned,
            // The last one cannot be fitted beside the others: the search ends without it.
            Err(_) if !steps.is_empty() => {
                conditioned_problems.dropped.extend(steps.pop().map(|step| step.candidate.spec));
                break;
            }
            Err(error) => return Err(error),
        };
        if conditioned.weighed.p_nothing >= config.max_probability_nothing {
            break;
        }
        let step = match next_step(conditioned_problems, &conditioned, &accepted, config)? {
            Next::Step(step) => *step,
            Next::Again => continue,
            Next::End => break,
        };
        if steps.iter().any(|earlier| step.may_be_detail_of(earlier, config)) {
            may_be_shape = true;
            break;
        }
        steps.extend(one_by_one(step, &conditioned.problem));
        if cells.is_empty() {
            drop_superseded(&mut steps, conditioned_problems, &conditioned, config);
        }
        let mut names: Vec<String> = steps.iter().map(|s| s.candidate.spec.clone()).collect();
        names.sort();
        if !been_at.insert(names) {
            break;
        }
        if patience_ends(&steps, config) {
            break;
        }
    }
    Ok((steps, may_be_shape))
}

/// What comes after the steps so far.
enum Next {
    /// This one.
    Step(Box<Step>),
    /// The same question again: the leader was put at its own size.
    Again,
    /// Nothing that is worth trying.
    End,
}

/// The leader of what these accepted ones leave, if it is promising.
fn next_step(
    conditioned_problems: &mut ConditionedProblems<'_>,
    conditioned: &ConditionedProblem,
    accepted: &[Candidate],
    config: &DiagnosisConfig,
) -> Result<Next, DiagnoseError> {
    let weighed = &conditioned.weighed;
    let Some((top, _)) = conditioned.leading_entries(config).into_iter().next() else {
        return Ok(Next::End);
    };
    let mut judged = conditioned.judge(top, config);
    let mut named = judged.grade(config) == Grade::Named;
    let entry = &weighed.entries[judged.entry];
    // Far from the fit one step is short, and an unlisted shape has more of them.
    if !named
        && let Some(score) = conditioned_problems
            .score(&[accepted, std::slice::from_ref(&entry.candidate)].concat(), conditioned)
    {
        judged.refitted(score, conditioned.nothing());
        named = judged.grade(config) == Grade::Named;
    }
    // Before an unlisted shape beats it, it may show what it does at its own size.
    if !named
        && entry.ln_evidence >= config.margin_nats
        && conditioned_problems.refine(accepted, &entry.candidate)?
    {
        return Ok(Next::Again);
    }
    if !judged.promising(config) {
        return Ok(Next::End);
    }
    let gain_nats = judged.gain.nats;
    Ok(Next::Step(Box::new(Step {
        candidate: entry.candidate.clone(),
        named_at_once: named,
        gain_nats,
        unlisted_nats: judged.unlisted.as_ref().map_or(0.0, |u| gain_nats + u.above.nats),
        fall: judged.own().score * weighed.scale.powi(2),
    })))
}

/// Whether the last steps had no name at once, and all together say no more than an unlisted shape.
fn patience_ends(steps: &[Step], config: &DiagnosisConfig) -> bool {
    let nameless = steps.iter().rev().take_while(|s| !s.named_at_once).count();
    nameless >= PATIENCE && !beats_a_cell(steps, config)
}

/// Whether what one effect leaves behind could look like the other: an effect that turns over with the direction, or
/// begins with a dwell or a recording, leaves only what does so too.
fn switches_alike(first: &Candidate, next: &Candidate) -> bool {
    let switch = |c: &Candidate| match c.toggle {
        // Whoever comes from the other side comes another way.
        Toggle::Approach => Toggle::Direction,
        other => other,
    };
    let switches = matches!(switch(first), Toggle::Direction | Toggle::Time | Toggle::Recording);
    !switches || switch(first) == switch(next)
}

/// A group enters as its members, each of which is then judged among the others.
fn one_by_one(step: Step, problem: &Problem) -> Vec<Step> {
    if !step.candidate.is_group() {
        return vec![step];
    }
    let of = |spec: &str| all_of(problem).find(|c| c.spec == spec).cloned();
    let members = step.candidate.members().filter_map(of).collect::<Vec<_>>();
    let share = 1.0 / members.len().max(1) as f64;
    let one =
        |candidate| Step { candidate, gain_nats: share * step.gain_nats, fall: share * step.fall, ..step };
    members.into_iter().map(one).collect()
}

/// Backward drop: an earlier effect without which, the later ones in the model, a refit says as much leaves.
fn drop_superseded(
    steps: &mut Vec<Step>,
    conditioned_problems: &mut ConditionedProblems<'_>,
    conditioned: &ConditionedProblem,
    config: &DiagnosisConfig,
) {
    let mut k = 0;
    while k + 1 < steps.len() {
        let all: Vec<Candidate> = steps.iter().map(|s| s.candidate.clone()).collect();
        let without = conditioned_problems.score(&all_but(&all, k), conditioned);
        let Some((with, without)) = conditioned_problems.score(&all, conditioned).zip(without) else { break };
        if with.above(&without).nats < config.margin_nats {
            steps.remove(k);
        } else {
            k += 1;
        }
    }
}

/// All but one of them.
pub(crate) fn all_but(names: &[Candidate], k: usize) -> Vec<Candidate> {
    [&names[..k], &names[k + 1..]].concat()
}

/// Whether the steps from the first one that could not be named alone say more than the best single unlisted shape at
/// that point, by a margin for each of them.
fn beats_a_cell(steps: &[Step], config: &DiagnosisConfig) -> bool {
    let Some(from) = steps.iter().position(|s| !s.named_at_once) else { return true };
    // One alone is judged beside it.
    if from + 1 == steps.len() {
        return true;
    }
    let together: f64 = steps[from..].iter().map(|s| s.gain_nats).sum();
    let cost = config.margin_nats * (steps.len() - from) as f64;
    together - cost >= steps[from].unlisted_nats
}

fn all_of(problem: &Problem) -> impl Iterator<Item = &Candidate> {
    problem.candidates.iter().chain(problem.scans.iter().flat_map(|s| &s.points))
}

#[cfg(test)]
#[path = "../tests/forward.rs"]
pub(crate) mod tests;
