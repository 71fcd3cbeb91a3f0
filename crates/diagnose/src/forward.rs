//! More than one missing effect: forward steps with a stop rule, then every effect judged again among the others.

use crate::DiagnoseError;
use crate::config::DiagnosisConfig;
use crate::curves::{Curve, error_curves};
use crate::events::moved;
use crate::judge::{Grade, Judged};
use crate::lead;
use crate::pairs::best_pair;
use crate::problem::{Candidate, Problem};
use crate::rooms::{Room, Rooms, as_candidate};
use crate::weigh::Weighed;
use armcal_model::Toggle;
use std::collections::BTreeSet;
use std::rc::Rc;

/// Steps none of which had a name at once, and which together say less than one unlisted shape: no more are tried.
const PATIENCE: usize = 4;

/// One accepted effect as judged with the others in the model.
#[derive(Debug, Clone)]
pub(crate) struct Accepted {
    /// The candidate.
    pub candidate: Candidate,
    /// Its judgement in the context of the others.
    pub judged: Judged,
    /// That context.
    pub room: Rc<Room>,
    /// How far its name can be trusted.
    pub grade: Grade,
    /// Names that the data do not tell from it, and that the user's knowledge of the arm does.
    pub instead_of: Vec<String>,
}

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
    pub rest: Rc<Room>,
    /// What remains with the curves in it too.
    pub with_curves: Rc<Room>,
    /// Whether anything remains that these data show.
    pub left_over: bool,
    /// Whether what remains is so small a part of the first effect that it may be that effect's shape.
    pub may_be_shape: bool,
}

/// A step of the search.
struct Step {
    candidate: Candidate,
    ln_evidence: f64,
    named_at_once: bool,
    /// ln Bayes factor of the best cell at that point.
    ln_cell: f64,
    /// ln of the prior of one entry over that of one cell.
    ln_prior: f64,
    /// Fall of the squared residual, declared noise = 1.
    fall: f64,
}

impl Step {
    /// One that was confirmed before.
    fn known(candidate: Candidate, fall: f64) -> Step {
        Step { candidate, ln_evidence: 0.0, named_at_once: true, ln_cell: 0.0, ln_prior: 0.0, fall }
    }
}

/// Searches; then once more with the unlisted shapes in the model, for effects they may hide.
pub(crate) fn search(rooms: &mut Rooms<'_>, config: &DiagnosisConfig) -> Result<Search, DiagnoseError> {
    let (steps, may_be_shape) = forward(rooms, Vec::new(), &[], config)?;
    let mut accepted = confirm(rooms, steps, &[], config)?;
    let mut names = named(&accepted);
    let mut rest = rooms.with(&names)?;
    let left_over = something(&rest, config);
    let (mut tentative, mut curves) = (Vec::new(), Vec::new());
    if left_over && !may_be_shape {
        curves = error_curves(rooms, &names, config)?;
        let mut shapes: Vec<Candidate> = curves.iter().map(|c| c.candidate.clone()).collect();
        accepted = beside_curves(rooms, accepted, &shapes, &rest, config)?;
        names = named(&accepted);
        rest = rooms.with(&names)?;
        if shapes.is_empty() {
            let best = rest.weighed.best_cell().filter(|c| c.ln_evidence >= config.margin_nats);
            shapes.extend(best.map(|cell| as_candidate(&cell.what, &rest, config)));
        }
        if !shapes.is_empty() {
            let (steps, _) = forward(rooms, known(&names, &rest), &shapes, config)?;
            if steps.len() > names.len() {
                tentative = confirm(rooms, steps, &shapes, config)?;
                tentative.retain(|t| names.iter().all(|n| n.spec != t.candidate.spec));
            }
        }
    }
    let all: Vec<Candidate> =
        names.iter().cloned().chain(curves.iter().map(|c| c.candidate.clone())).collect();
    let with_curves = rooms.with(&all)?;
    let may_be_shape = left_over && may_be_shape;
    Ok(Search { accepted, tentative, curves, rest, with_curves, left_over, may_be_shape })
}

/// The names that stand beside error curves too: what a curve of a joint's own angle explains as well was never that effect.
fn beside_curves(
    rooms: &mut Rooms<'_>,
    accepted: Vec<Accepted>,
    curves: &[Candidate],
    rest: &Room,
    config: &DiagnosisConfig,
) -> Result<Vec<Accepted>, DiagnoseError> {
    if curves.is_empty() {
        return Ok(accepted);
    }
    let kept = confirm(rooms, known(&named(&accepted), rest), curves, config)?;
    if kept.len() == accepted.len() {
        return Ok(accepted);
    }
    let mut steps = named(&accepted);
    steps.retain(|c| kept.iter().any(|k| k.candidate.spec == c.spec));
    confirm(rooms, known(&steps, rest), &[], config)
}

fn named(accepted: &[Accepted]) -> Vec<Candidate> {
    accepted.iter().map(|a| a.candidate.clone()).collect()
}

fn known(names: &[Candidate], rest: &Room) -> Vec<Step> {
    names.iter().map(|c| Step::known(c.clone(), rest.weighed.metrics[0].projection.rss)).collect()
}

/// Judges every step among the others and drops the weakest until all may be named. `cells` stay in the base.
fn confirm(
    rooms: &mut Rooms<'_>,
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
        let mut weakest: Option<(f64, usize)> = None;
        for k in 0..steps.len() {
            let mut others: Vec<Candidate> = steps.iter().map(|s| s.candidate.clone()).collect();
            let own = others.remove(k);
            others.extend_from_slice(cells);
            let room = rooms.with(&others)?;
            let weighed = &room.weighed;
            let Some(entry) = entry_of(weighed, &own) else {
                weakest = Some((f64::NEG_INFINITY, k));
                break;
            };
            let (verdict, instead_of) = lead::as_known(&room, room.judge(entry, config), config);
            let verdict = lead::as_measured(&room, lead::as_possible(&room, verdict, config), config);
            let entry = verdict.entry;
            let grade = verdict.grade(weighed, config);
            let ln = weighed.entries[entry].ln_evidence;
            if grade == Grade::Refused && weakest.is_none_or(|w| ln < w.0) {
                weakest = Some((ln, k));
            }
            let candidate = weighed.entries[entry].candidate.clone();
            judged.push(Accepted { candidate, judged: verdict, room: room.clone(), grade, instead_of });
        }
        match weakest {
            Some((_, k)) => drop(steps.remove(k)),
            None => return Ok(judged),
        }
    }
}

/// Whether something is missing: improbable as nothing, and an explanation helps where the fit did not look: the best of
/// all, the best that has a place and a driver, or the best listed one.
fn something(room: &Room, config: &DiagnosisConfig) -> bool {
    let weighed = &room.weighed;
    if weighed.p_nothing >= config.max_probability_nothing {
        return false;
    }
    let best = weighed.best().map(|b| b.0);
    let cell = weighed.best_cell().filter(|c| c.ln_evidence >= config.margin_nats).map(|c| &c.what.columns);
    let listed = weighed.ranking().first().map(|k| &weighed.entries[*k]);
    let listed = listed.filter(|e| e.ln_evidence >= config.margin_nats).map(|e| &e.candidate.columns);
    best.into_iter().chain(cell).chain(listed).any(|columns| room.predicts_with(columns, config))
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
        entry.or_else(|| weighed.entries.iter().position(|e| moved(&candidate.spec, &e.candidate.spec)))
    })
}

/// Accepts the best candidate again and again while it is promising. `cells` stay in the base.
fn forward(
    rooms: &mut Rooms<'_>,
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
        let room = rooms.with(&accepted)?;
        let weighed = &room.weighed;
        if weighed.p_nothing >= config.max_probability_nothing {
            break;
        }
        let Some(top) = weighed.ranking().first().copied() else { break };
        let mut judged = room.judge(top, config);
        let mut named = judged.grade(weighed, config) == Grade::Named;
        if !named && let Some(first) = best_pair(&room.problem, weighed, config).filter(|k| *k != top) {
            let other = room.judge(first, config);
            if other.promising(weighed, config) {
                named = other.grade(weighed, config) == Grade::Named;
                judged = other;
            }
        }
        let entry = &weighed.entries[judged.entry];
        // Before an unlisted shape beats it, it may show what it does at its own size.
        if !named && entry.ln_evidence >= config.margin_nats && rooms.refine(&accepted, &entry.candidate)? {
            continue;
        }
        if !judged.promising(weighed, config) {
            break;
        }
        let fall = judged.own().score * weighed.scale.powi(2);
        if let Some(first) = steps.first()
            && fall < config.leftover_share * first.fall
            && switches_alike(&first.candidate, &entry.candidate)
        {
            may_be_shape = true;
            break;
        }
        let count = weighed.unlisted.iter().filter(|u| u.what.channel.is_some()).count().max(1) as f64;
        let ln_prior = (config.prior_catalogue / weighed.entries.len().max(1) as f64).ln()
            - (0.5 * config.prior_unknown / count).ln();
        let step = Step {
            candidate: entry.candidate.clone(),
            ln_evidence: entry.ln_evidence,
            named_at_once: named,
            ln_cell: weighed.best_cell().map_or(f64::NEG_INFINITY, |u| u.ln_evidence),
            ln_prior,
            fall,
        };
        steps.extend(one_by_one(step, &room.problem));
        if cells.is_empty() {
            drop_superseded(&mut steps, rooms, config)?;
        }
        let mut names: Vec<String> = steps.iter().map(|s| s.candidate.spec.clone()).collect();
        names.sort();
        if !been_at.insert(names) {
            break;
        }
        let nameless = steps.iter().rev().take_while(|s| !s.named_at_once).count();
        if nameless >= PATIENCE && !beats_a_cell(&steps, config) {
            break;
        }
    }
    Ok((steps, may_be_shape))
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
    let one = |candidate| Step {
        candidate,
        ln_evidence: share * step.ln_evidence,
        ln_prior: 0.0,
        fall: share * step.fall,
        ..step
    };
    members.into_iter().map(one).collect()
}

/// Backward drop: an earlier effect that the later ones made superfluous leaves.
fn drop_superseded(
    steps: &mut Vec<Step>,
    rooms: &mut Rooms<'_>,
    config: &DiagnosisConfig,
) -> Result<(), DiagnoseError> {
    let mut k = 0;
    while steps.len() > 1 && k + 1 < steps.len() {
        let mut others: Vec<Candidate> = steps.iter().map(|s| s.candidate.clone()).collect();
        let own = others.remove(k);
        let Some(ln_bayes) = rooms.ln_bayes(&others, &own)? else { break };
        if ln_bayes < config.margin_nats {
            steps.remove(k);
        } else {
            k += 1;
        }
    }
    Ok(())
}

/// Whether the steps from the first one that could not be named alone say more than the best single unlisted shape at
/// that point.
fn beats_a_cell(steps: &[Step], config: &DiagnosisConfig) -> bool {
    let Some(from) = steps.iter().position(|s| !s.named_at_once) else { return true };
    let together: f64 = steps[from..].iter().map(|s| s.ln_evidence).sum();
    let cost: f64 = steps[from + 1..].iter().map(|s| s.ln_prior.min(0.0)).sum();
    together + cost - steps[from].ln_cell >= config.margin_nats
}

fn all_of(problem: &Problem) -> impl Iterator<Item = &Candidate> {
    problem.candidates.iter().chain(problem.scans.iter().flat_map(|s| &s.points))
}

#[cfg(test)]
#[path = "tests/forward.rs"]
mod tests;
