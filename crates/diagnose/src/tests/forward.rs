//! Steps forward and back, against planted effects and against the rules written out.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::LinearRefit;
use crate::problem::Columns;
use crate::tests::{arm, conditioned, entry, outside, own, quick, with_conditioned};
use crate::weigh::weigh;
use std::rc::Rc;
use std::sync::Arc;

/// Half of the cavities: as clear, and a fraction of the time.
pub(crate) fn planted(names: &[(&str, f64)], free: usize, seed: u64) -> Problem {
    let p = crate::tests::planted(names, free, seed);
    let kept = |d: &crate::DwellRow| d.place.as_ref().is_none_or(|c| c.ends_with(['0', '2', '4', '6', '8']));
    p.without(&p.dwells.iter().map(kept).collect::<Vec<_>>())
}

fn step(candidate: Candidate, [gain_nats, unlisted_nats]: [f64; 2], named_at_once: bool) -> Step {
    Step { candidate, named_at_once, gain_nats, unlisted_nats, fall: 12.0 }
}

fn names(steps: &[Step]) -> Vec<&str> {
    steps.iter().map(|s| s.candidate.spec.as_str()).collect()
}

pub(crate) fn strong(p: &Problem, specs: &[&str]) -> Vec<Step> {
    specs.iter().map(|s| Step::known(own(p, s), 1.0)).collect()
}

#[test]
fn steps_together_must_say_more_than_an_unlisted_shape_and_what_they_cost() {
    let c = own(&planted(&[], 0, 1), "backlash:1");
    let config = quick();
    let step = |nats, named| step(c.clone(), nats, named);
    assert!(
        beats_a_cell(&[step([50.0, 90.0], true)], &config),
        "what had a name at once needs no comparison"
    );
    // 10 + 8, 3 nats for each of the two.
    let two = |cell| {
        let steps = [step([50.0, 90.0], true), step([10.0, cell], false), step([8.0, 99.0], false)];
        beats_a_cell(&steps, &config)
    };
    assert!(two(12.0) && !two(12.1));
}

#[test]
fn four_steps_without_a_name_end_the_search_where_they_say_no_more_than_an_unlisted_shape() {
    let c = own(&planted(&[], 0, 1), "backlash:1");
    let ends = |unlisted: f64, named: [bool; 4]| {
        let steps = named.map(|n| step(c.clone(), [10.0, unlisted], n));
        patience_ends(&steps, &quick())
    };
    // 40 nats together, 3 for each of the four.
    assert!(ends(28.1, [false; 4]) && !ends(28.0, [false; 4]));
    assert!(!ends(99.0, [true, false, false, false]) && !ends(99.0, [false, false, false, true]));
}

/// A planted play judged alone, as often as asked, with these grades and gains; and what is asked of all.
fn of_judged<T>(all: &[(Grade, f64)], ask: impl Fn(&[Accepted]) -> T) -> T {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let conditioned = conditioned(&p, &quick());
    let verdict = conditioned.judge(entry(&conditioned.weighed, "backlash:1"), &quick());
    let with = |(grade, nats): &(Grade, f64)| {
        let mut judged = verdict.clone();
        judged.gain.nats = *nats;
        Accepted {
            candidate: own(&p, "backlash:1"),
            judged,
            conditioned: conditioned.clone(),
            grade: *grade,
            set: vec![0],
            instead_of: Vec::new(),
            ranked: Vec::new(),
        }
    };
    ask(&all.iter().map(with).collect::<Vec<_>>())
}

#[test]
fn of_what_is_refused_that_leaves_which_says_least() {
    use Grade::{Named, OrUnlisted, Refused};
    let refused = [(Named, -5.0), (Refused, 9.0), (Refused, 7.0), (OrUnlisted, 1.0), (Refused, 8.0)];
    assert_eq!(of_judged(&refused, weakest), Some(2));
    assert_eq!(of_judged(&[(Named, -5.0), (OrUnlisted, 1.0)], weakest), None);
}

#[test]
fn what_says_less_than_a_hundredth_of_another_one_is_a_detail_of_it() {
    let of = |nats: &[f64]| {
        let all: Vec<(Grade, f64)> = nats.iter().map(|n| (Grade::Named, *n)).collect();
        of_judged(&all, |judged| find_shape_detail(judged, &quick()))
    };
    assert_eq!(of(&[20.0, 1000.0, 9.9, 3.0]), Some(2));
    assert_eq!(of(&[20.0, 1000.0, 10.0]), None);
    assert_eq!(of(&[]), None);
}

#[test]
fn the_fall_by_a_name_is_of_the_declared_noise() {
    let ratio = of_judged(&[(Grade::Named, 1.0)], |judged| {
        let mut conditioned = (*judged[0].conditioned).clone();
        conditioned.weighed.scale *= 3.0;
        let scaled = Accepted { conditioned: Rc::new(conditioned), ..judged[0].clone() };
        scaled.fall() / judged[0].fall()
    });
    assert!((ratio - 9.0).abs() < 1e-9, "the same fall of noise three times as large: {ratio}");
}

#[test]
fn what_switches_leaves_only_what_switches_alike() {
    let p = planted(&[], 0, 1);
    let alike = |a: &str, b: &str| switches_alike(&own(&p, a), &own(&p, b));
    assert!(alike("scale:1", "backlash:1") && alike("scale:1", "scale:2"));
    assert!(alike("backlash:1", "friction_windup:2") && alike("zero_drift:1", "thermal"));
    assert!(!alike("backlash:1", "scale:1") && !alike("backlash:1", "zero_drift:1"));
    assert!(alike("zero_slip:1@1", "tool_shift@2") && !alike("zero_slip:1@1", "thermal"));
}

#[test]
fn a_group_enters_as_its_members() {
    let p = planted(&[], 0, 1);
    let alone = one_by_one(step(own(&p, "backlash:1"), [8.0, 1.0], true), &p);
    assert_eq!((names(&alone), alone[0].gain_nats), (vec!["backlash:1"], 8.0));
    let group = Candidate { spec: "backlash:1+backlash:3".into(), ..own(&p, "backlash:1") };
    let members = one_by_one(step(group, [8.0, 1.0], true), &p);
    assert_eq!(names(&members), ["backlash:1", "backlash:3"]);
    for m in &members {
        assert_eq!((m.gain_nats, m.unlisted_nats, m.fall), (4.0, 1.0, 6.0));
        assert!(m.named_at_once);
    }
}

#[test]
fn a_candidate_is_found_by_name_and_else_by_family_and_target() {
    let p = planted(&[], 0, 1);
    let weighed = weigh(&p, &quick());
    let at = |spec: &str| weighed.entries.iter().position(|e| e.candidate.spec == spec);
    assert_eq!(entry_of(&weighed, &own(&p, "scale:2")), at("scale:2"));
    let other = Candidate { spec: "scale:2,shape=3".into(), ..own(&p, "scale:2") };
    assert_eq!(entry_of(&weighed, &other), at("scale:2"));
    assert_eq!(entry_of(&weighed, &Candidate { target: "joint7".into(), ..other.clone() }), None);
    assert_eq!(entry_of(&weighed, &Candidate { family: "else".into(), ..other }), None);
}

/// A conditioned problem in which only what is given was weighed; `predicts` are the columns of the planted effect.
pub(crate) fn told(entry: (&str, f64), unlisted: &[(&str, bool, f64)]) -> ConditionedProblem {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let mut r = Rc::try_unwrap(conditioned(&p, &config)).expect("the room is ours");
    r.weighed.p_nothing = 0.01;
    r.weighed.entries.retain(|e| e.candidate.spec == entry.0);
    r.weighed.entries[0].ln_evidence = entry.1;
    r.weighed.unlisted = unlisted.iter().map(|(s, cell, ln)| outside(&p, s, *cell, *ln)).collect();
    r
}

#[test]
fn an_earlier_step_that_later_ones_made_superfluous_leaves() {
    let p = planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3);
    let config = quick();
    let left = |specs: &[&str]| {
        let mut steps = strong(&p, specs);
        with_conditioned(&p, &config, |conditioned_problems| {
            let conditioned = conditioned_problems.with(&[]).unwrap();
            drop_superseded(&mut steps, conditioned_problems, &conditioned, &config);
        });
        steps.into_iter().map(|s| s.candidate.spec).collect::<Vec<_>>()
    };
    assert_eq!(left(&["scale:2", "backlash:1", "zero_drift:2"]), ["backlash:1", "zero_drift:2"]);
    assert_eq!(left(&["scale:2", "scale:1", "backlash:1", "zero_drift:2"]), ["backlash:1", "zero_drift:2"]);
    assert_eq!(left(&["backlash:1", "scale:2", "zero_drift:2"]), ["backlash:1", "zero_drift:2"]);
    assert_eq!(left(&["backlash:1", "zero_drift:2"]), ["backlash:1", "zero_drift:2"]);
    assert_eq!(left(&["backlash:1", "scale:2"]), ["backlash:1", "scale:2"], "the last one has no later one");
    assert_eq!(left(&["scale:2"]), ["scale:2"]);
}

#[test]
fn steps_are_confirmed_among_each_other() {
    let p = planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3);
    let config = quick();
    let confirmed = |p: &Problem, steps: Vec<Step>, cells: &[Candidate]| {
        let found = with_conditioned(p, &config, |conditioned_problems| {
            confirm(conditioned_problems, steps, cells, &config)
        })
        .unwrap();
        found.into_iter().map(|a| (a.candidate.spec, a.grade)).collect::<Vec<_>>()
    };
    let both = ["backlash:1", "zero_drift:2"].map(|s| (s.to_string(), Grade::Named));
    assert_eq!(confirmed(&p, strong(&p, &["backlash:1", "zero_drift:2"]), &[]), both);
    assert_eq!(confirmed(&p, strong(&p, &["backlash:1", "scale:2", "zero_drift:2", "scale:1"]), &[]), both);
    assert!(confirmed(&p, strong(&p, &["scale:2"]), &[]).is_empty());
    // What explains it already stands in the base.
    assert!(confirmed(&p, strong(&p, &["backlash:1"]), &[own(&p, "backlash:1")]).is_empty());
    // One that is not listed here leaves, the others stay.
    let mut steps = strong(&p, &["backlash:1", "zero_drift:2"]);
    let unknown = Candidate { spec: "else".into(), family: "else".into(), ..own(&p, "scale:1") };
    steps.insert(0, Step::known(unknown, 1.0));
    assert_eq!(confirmed(&p, steps, &[]), both);
    // Without a name at once, and alone: judged by itself.
    let doubtful =
        |ln| vec![Step::known(own(&p, "backlash:1"), 1.0), step(own(&p, "zero_drift:2"), ln, false)];
    assert_eq!(confirmed(&p, doubtful([90.0, 95.0]), &[]), both);
    assert_eq!(confirmed(&p, doubtful([90.0, 1.0]), &[]), both);
    // More than a cell by itself: what comes later and says less than it costs takes no name from it.
    let first = step(own(&p, "backlash:1"), [10.0, 5.0], false);
    let weak = step(own(&p, "zero_drift:2"), [0.5, 5.0], false);
    assert_eq!(confirmed(&p, vec![first, weak], &[]), both[..1]);
}

#[test]
fn of_two_that_hide_each_other_the_weaker_leaves() {
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    // Play with a tenth of another's: alone each says nearly all, beside the other nothing.
    let (a, b) = (own(&p, "backlash:1"), own(&p, "scale:1"));
    let mixed = a.columns.dense(&p.dwells, 1.0) + 0.02 * b.columns.dense(&p.dwells, 1.0);
    let twin = Candidate {
        spec: "twin".into(),
        family: "twin".into(),
        columns: Columns::Dense(Arc::new(mixed)),
        ..a
    };
    p.candidates.push(twin);
    let left = |specs: &[&str]| {
        let found = with_conditioned(&p, &config, |conditioned_problems| {
            confirm(conditioned_problems, strong(&p, specs), &[], &config)
        })
        .unwrap();
        found.into_iter().map(|a| a.candidate.spec).collect::<Vec<_>>()
    };
    let one = left(&["backlash:1", "twin"]);
    assert_eq!(one.len(), 1);
    assert_eq!(left(&["twin", "backlash:1"]), one, "whatever the order");
    let alone = |spec: &str| {
        let other = own(&p, if spec == "twin" { "backlash:1" } else { "twin" });
        let conditioned = with_conditioned(&p, &config, |conditioned_problems| {
            conditioned_problems.with(&[other]).unwrap()
        });
        let entry = entry_of(&conditioned.weighed, &own(&p, spec)).unwrap();
        conditioned.judge(entry, &config).gain.nats
    };
    let stronger = if alone("twin") > alone("backlash:1") { "twin" } else { "backlash:1" };
    assert_eq!(one, [stronger]);
}

fn stepped(p: &Problem, known: Vec<Step>, config: &DiagnosisConfig) -> (Vec<Step>, bool) {
    with_conditioned(p, config, |conditioned_problems| {
        forward_selection(conditioned_problems, known, &[], config)
    })
    .unwrap()
}

#[test]
fn forward_steps_end_when_nothing_is_left_or_enough_were_found() {
    let config = quick();
    assert!(stepped(&planted(&[], 0, 5), Vec::new(), &config).0.is_empty());
    let p = planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3);
    let (steps, may_be_shape) = stepped(&p, Vec::new(), &config);
    assert_eq!((names(&steps), may_be_shape), (vec!["backlash:1", "zero_drift:2"], false));
    let one = DiagnosisConfig { max_effects: 1, ..quick() };
    assert_eq!(names(&stepped(&p, Vec::new(), &one).0), ["backlash:1"]);
    assert_eq!(stepped(&p, Vec::new(), &DiagnosisConfig { max_effects: 0, ..quick() }).0.len(), 0);
    // What stands in the base already is not found again.
    let shapes = [own(&p, "backlash:1")];
    let (steps, _) = with_conditioned(&p, &config, |conditioned_problems| {
        forward_selection(conditioned_problems, Vec::new(), &shapes, &config)
    })
    .unwrap();
    assert_eq!(names(&steps), ["zero_drift:2"]);
}

#[test]
fn a_step_carries_what_it_said() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let (steps, _) = stepped(&p, Vec::new(), &config);
    let r = conditioned(&p, &config);
    let weighed = &r.weighed;
    let entry = entry_of(weighed, &own(&p, "backlash:1")).unwrap();
    let s = &steps[0];
    assert!(s.named_at_once && steps.len() == 1);
    let judged = r.judge(entry, &config);
    let unlisted = judged.unlisted.as_ref().unwrap();
    assert_eq!((s.gain_nats, s.unlisted_nats), (judged.gain.nats, judged.gain.nats + unlisted.above.nats));
    assert!(s.gain_nats > s.unlisted_nats);
    let score = r.judge(entry, &config).own().score;
    assert!((s.fall - score * weighed.scale * weighed.scale).abs() < 1e-9 * score);
}

#[test]
fn the_fall_is_in_units_of_the_declared_noise() {
    // Declared ten times too small: everything is weighed again, and the fall is a hundred times as large.
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let fall = stepped(&p, Vec::new(), &config).0[0].fall;
    let large = stepped(&arm::overconfident(p, 10.0), Vec::new(), &config).0[0].fall;
    assert!((large / fall - 100.0).abs() < 5.0, "{large} {fall}");
}

#[test]
fn a_detail_is_small_in_the_squared_error_and_in_the_score_and_switches_alike() {
    let p = planted(&[], 0, 1);
    let earlier = |spec: &str| Step { fall: 1000.0, ..step(own(&p, spec), [300.0, 0.0], true) };
    let is_detail = |of: &str, fall: f64, nats: f64| {
        let rest = Step { fall, ..step(own(&p, "eccentricity:3"), [nats, 0.0], true) };
        rest.may_be_detail_of(&earlier(of), &quick())
    };
    assert!(is_detail("eccentricity:2", 9.9, 44.9));
    assert!(!is_detail("eccentricity:2", 10.0, 44.9) && !is_detail("eccentricity:2", 9.9, 45.0));
    assert!(!is_detail("backlash:1", 9.9, 44.9), "an eccentricity is no shape of a play");
    let confirmed = Step::known(own(&p, "eccentricity:2"), 1000.0);
    let rest = Step { fall: 9.9, ..step(own(&p, "eccentricity:3"), [500.0, 0.0], true) };
    assert!(rest.may_be_detail_of(&confirmed, &quick()));
}

#[test]
fn steps_end_where_the_next_one_may_be_a_detail_of_any_before_it() {
    let two = ["backlash:1", "eccentricity:2"];
    let p = planted(&[(two[0], 2.0), (two[1], 4.0), ("eccentricity:3", 0.4)], 60, 3);
    let at = |leftover_share| stepped(&p, Vec::new(), &DiagnosisConfig { leftover_share, ..quick() });
    let (steps, may_be_shape) = at(1e-4);
    assert_eq!((&names(&steps)[..2], steps.len(), may_be_shape), (&two[..], 3, false));
    let share = steps[2].fall / steps[1].fall;
    assert!(steps[2].gain_nats < 0.15 * steps[1].gain_nats, "{} {}", steps[2].gain_nats, steps[1].gain_nats);
    let (steps, may_be_shape) = at(1.1 * share);
    assert_eq!((names(&steps), may_be_shape), (two.to_vec(), true));
}

/// Says once that a candidate acts otherwise at its own size.
struct Refined {
    linear: LinearRefit,
    asked: Vec<String>,
}

impl crate::Refit for Refined {
    fn problem(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        self.linear.problem(accepted)
    }

    fn refine(&mut self, _: &[Candidate], candidate: &Candidate) -> Result<bool, DiagnoseError> {
        self.asked.push(candidate.spec.clone());
        Ok(self.asked.len() == 1)
    }
}

#[test]
fn only_what_has_no_name_at_once_is_tried_at_its_own_size() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let asked = |config: &DiagnosisConfig| {
        let mut refit = Refined { linear: LinearRefit::new(p.clone()), asked: Vec::new() };
        let first = (p.clone(), weigh(&p, config));
        let mut conditioned_problems =
            ConditionedProblems::new(&mut refit, vec![true; p.dwells.len()], first, config);
        let (steps, _) = forward_selection(&mut conditioned_problems, Vec::new(), &[], config).unwrap();
        (refit.asked, steps.len())
    };
    assert_eq!(asked(&quick()), (vec![], 1));
    // No p-value of 199 resamplings is so small: nothing has a name at once.
    let strict = DiagnosisConfig { max_p_adjusted: 1e-6, ..quick() };
    let (asked, _) = asked(&strict);
    assert_eq!(asked[..2], ["backlash:1", "backlash:1"]);
}

/// A listed effect beside twice the size of one that is not.
pub(crate) fn beside(outside: &str, spec: &str, size: f64) -> Problem {
    let mut r = arm::rng(3);
    let poses = arm::design(30, &mut r);
    let list = arm::catalogue(&poses);
    let own = list.iter().find(|l| l.spec == spec).unwrap();
    let (_, _, _, effect) = arm::outside(2.0).into_iter().find(|o| o.0 == outside).unwrap();
    let hidden = [(own.effect.clone(), own.typical.iter().map(|t| size * t).collect()), (effect, vec![])];
    arm::problem(&poses, &hidden, arm::Noise::White, &mut r, false)
}

#[test]
fn doubtful_steps_are_given_a_few_more() {
    // Play that grows with the angle: plain play is a part of it, without a name. The play of another joint says less, and has
    // none either beside what is left of it.
    let (steps, _) = stepped(&beside("worn", "backlash:3", 0.8), Vec::new(), &quick());
    assert!(steps.len() > 1 && steps.iter().all(|s| !s.named_at_once), "{:?}", names(&steps));
    assert_eq!(names(&steps), ["backlash:1", "backlash:3"]);
}

#[test]
fn what_something_else_explains_clearly_better_does_not_lead() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let alone = conditioned(&p, &config);
    let leads = |spec: &str| {
        let at = entry(&alone.weighed, spec);
        let judged = alone.judge(at, &config);
        let accepted = Accepted {
            candidate: own(&p, spec),
            grade: judged.grade(&config),
            judged,
            conditioned: alone.clone(),
            set: vec![at],
            instead_of: Vec::new(),
            ranked: Vec::new(),
        };
        accepted.leads(&config)
    };
    assert!(leads("backlash:1"));
    assert!(!leads("scale:2"), "the play is clearly better");
}
