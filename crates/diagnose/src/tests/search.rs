//! Whole searches, against planted effects.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::LinearRefit;
use crate::problem::{Columns, Problem};
use crate::search::forward::tests::{beside, planted, strong, told};
use crate::search::settle::resolve_names;
use crate::tests::{arm, own, quick, with_conditioned};
use crate::weigh::weigh;
use std::sync::Arc;

#[test]
fn something_is_missing_where_an_explanation_predicts() {
    let config = quick();
    let cell = |spec| [(spec, true, 0.5)];
    let mut r = told(("backlash:2", 1.0), &cell("backlash:1"));
    assert!(r.is_something_missing(&config), "however little the weighing likes it");
    r.weighed.p_nothing = config.max_probability_nothing;
    assert!(!r.is_something_missing(&config), "nothing may be missing");
    // Another joint's play predicts nothing, and a listed one is no shape without a name.
    assert!(!told(("backlash:1", 50.0), &cell("backlash:2")).is_something_missing(&config));
    assert!(!told(("backlash:1", 50.0), &[]).is_something_missing(&config));
}

#[test]
fn a_search_tells_names_curves_and_what_is_left() {
    let config = quick();
    let searched = |p: &Problem| {
        with_conditioned(p, &config, |conditioned_problems| search(conditioned_problems, &[], &config))
            .unwrap()
    };
    let specs = |of: &[Accepted]| of.iter().map(|a| a.candidate.spec.clone()).collect::<Vec<_>>();
    let s = searched(&planted(&[], 0, 5));
    assert!(s.accepted.is_empty() && s.curves.is_empty() && !s.left_over && !s.may_be_shape);
    let s = searched(&planted(&[("backlash:1", 1.0)], 0, 3));
    assert_eq!(specs(&s.accepted), ["backlash:1"]);
    assert!(s.curves.is_empty() && s.tentative.is_empty() && !s.left_over && !s.may_be_shape);
    // A play, and an error curve of another joint that no name explains.
    let mut r = arm::rng(8);
    let poses = arm::design(60, &mut r);
    let list = arm::catalogue(&poses);
    let play = list.iter().find(|l| l.spec == "backlash:1").unwrap();
    let curve = arm::on_joint(2, |p, _, _| 5e-3 * (25.0 * p.q[2]).sin().powi(3));
    let hidden = [(play.effect.clone(), play.typical.clone()), (curve, vec![])];
    let s = searched(&arm::problem(&poses, &hidden, arm::Noise::White, &mut r, false));
    assert_eq!(specs(&s.accepted), ["backlash:1"]);
    let curves: Vec<_> = s.curves.iter().map(|c| c.candidate.spec.as_str()).collect();
    assert_eq!(curves, ["joint3 <- q3"]);
    assert!(s.left_over && !s.may_be_shape);
    let mean = |r: &ConditionedProblem| r.weighed.base.rss;
    assert!(mean(&s.with_curves) < 0.7 * mean(&s.rest), "the curve is in the model");
}

#[test]
fn names_of_fewer_dwells_are_a_beginning_and_nothing_more() {
    let config = quick();
    let p = planted(&[("backlash:1", 1.0), ("eccentricity:2", 1.0)], 60, 3);
    // How many conditioned problems were made, and what was found.
    let searched = |proposed: &[&str]| {
        let proposed: Vec<Candidate> = proposed.iter().map(|spec| own(&p, spec)).collect();
        let mut refit = Counted { inner: LinearRefit::new(p.clone()), asked: 0 };
        let found = {
            let keep = vec![true; p.dwells.len()];
            let weighed = weigh(&p, &config);
            let mut conditioned_problems =
                ConditionedProblems::new(&mut refit, keep, (p.clone(), weighed), &config);
            search(&mut conditioned_problems, &proposed, &config).unwrap()
        };
        let mut names: Vec<String> = found.accepted.iter().map(|a| a.candidate.spec.clone()).collect();
        names.sort();
        (names, found.left_over, refit.asked)
    };
    let (names, left_over, alone) = searched(&[]);
    assert_eq!((names.join(" "), left_over), ("backlash:1 eccentricity:2".into(), false));
    let (both, left_over, with_both) = searched(&["backlash:1", "eccentricity:2"]);
    assert_eq!((&both, left_over), (&names, false));
    assert!(with_both < alone, "{with_both} of {alone} rooms");
    // One is half of the way; what is not there, or stands for something else, leads nowhere.
    for proposed in
        [&["eccentricity:2"][..], &["scale:3"], &["backlash:1", "scale:3"], &["friction_windup:2"]]
    {
        assert_eq!(searched(proposed).0, names, "{proposed:?}");
    }
}

/// Counts the problems that are asked for.
struct Counted {
    inner: LinearRefit,
    asked: usize,
}

impl crate::Refit for Counted {
    fn problem(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        self.asked += 1;
        self.inner.problem(accepted)
    }
}

#[test]
fn a_name_that_a_curve_explains_as_well_was_never_that_effect() {
    // A narrow bump over joint 1's own angle: eccentricity and the like have a part of it.
    let config = quick();
    let mut r = arm::rng(44);
    let poses = arm::design(0, &mut r);
    let bump = arm::on_joint(0, |p, _, _| 9e-3 * (-((p.q[0] - 0.05) / 0.05).powi(2)).exp());
    let p = arm::problem(&poses, &[(bump, vec![])], arm::Noise::White, &mut r, false);
    let s = with_conditioned(&p, &config, |conditioned_problems| search(conditioned_problems, &[], &config))
        .unwrap();
    assert!(s.accepted.is_empty(), "{:?}", s.accepted.iter().map(|a| &a.candidate.spec).collect::<Vec<_>>());
    assert_eq!(s.curves[0].candidate.spec, "joint1 <- q1");
}

#[test]
fn of_names_that_the_data_leave_the_known_one_is_told() {
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let a = own(&p, "backlash:1");
    let mixed = a.columns.dense(&p.dwells, 1.0) + 1e-3 * own(&p, "scale:1").columns.dense(&p.dwells, 1.0);
    let columns = Columns::Dense(Arc::new(mixed));
    let twin = Candidate { spec: "twin".into(), family: "twin".into(), columns, ..a };
    p.candidates.push(twin);
    let told = |p: &Problem| {
        let s = with_conditioned(p, &config, |conditioned_problems| {
            let mut s = search(conditioned_problems, &[], &config)?;
            resolve_names(&mut s, conditioned_problems, &config)?;
            Ok::<_, DiagnoseError>(s)
        });
        let [one] = &s.unwrap().accepted[..] else { panic!("one effect was planted") };
        let name = |k: &usize| one.conditioned.weighed.entries[*k].candidate.spec.clone();
        let set: Vec<String> = one.set.iter().map(name).collect();
        (one.candidate.spec.clone(), set, one.instead_of.clone())
    };
    let (_, both, others) = told(&p);
    assert_eq!((both.len(), others.len()), (2, 0), "{both:?}");
    for (known, other) in [("twin", "backlash:1"), ("backlash:1", "twin")] {
        let mut p = p.clone();
        p.candidates.iter_mut().filter(|c| c.spec == known).for_each(|c| c.known = Some("seen".into()));
        assert_eq!(told(&p), (known.to_string(), vec![known.to_string()], vec![other.to_string()]));
    }
    // What is known and does not show is not told for it.
    p.candidates.iter_mut().filter(|c| c.spec == "scale:2").for_each(|c| c.known = Some("seen".into()));
    assert_eq!(told(&p).1, both);
}

#[test]
fn what_shows_only_beside_an_unlisted_shape_is_tentative() {
    let config = quick();
    let p = beside("bump", "backlash:3", 0.4);
    let s = with_conditioned(&p, &config, |conditioned_problems| search(conditioned_problems, &[], &config))
        .unwrap();
    let curves: Vec<_> = s.curves.iter().map(|c| c.candidate.spec.as_str()).collect();
    let tentative: Vec<_> = s.tentative.iter().map(|t| t.candidate.spec.as_str()).collect();
    assert_eq!((curves, tentative), (vec!["joint1 <- q1"], vec!["backlash:3"]));
    assert!(s.accepted.is_empty() && s.left_over);
    // Where no joint errs over its own angle the best cell stands for what is not listed.
    let p = beside("crossed", "zero_drift:1", 0.4);
    let s = with_conditioned(&p, &config, |conditioned_problems| search(conditioned_problems, &[], &config))
        .unwrap();
    let tentative: Vec<_> = s.tentative.iter().map(|t| t.candidate.spec.as_str()).collect();
    assert_eq!((s.curves.len(), tentative), (0, vec!["zero_drift:1"]));
}

#[test]
fn a_name_falls_to_a_curve_that_says_the_same_and_to_no_other() {
    let p = planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3);
    let config = quick();
    let beside = |spec: &str| {
        let curve = Candidate { spec: "curve".into(), family: "unlisted".into(), ..own(&p, spec) };
        with_conditioned(&p, &config, |conditioned_problems| {
            let steps = strong(&p, &["backlash:1", "zero_drift:2"]);
            let accepted = confirm(conditioned_problems, steps, &[], &config).unwrap();
            let rest = conditioned_problems.with(&accepted_candidates(&accepted)).unwrap();
            let kept = beside_curves(conditioned_problems, accepted, &[curve], &rest, &config).unwrap();
            kept.into_iter()
                .map(|a| (a.candidate.spec, a.conditioned.problem.geometry.ncols()))
                .collect::<Vec<_>>()
        })
    };
    // What stays is judged without the curve again: 21 columns of geometry, and the other effect where there is one.
    let both = [("backlash:1".to_string(), 22), ("zero_drift:2".to_string(), 22)];
    assert_eq!(beside("scale:3"), both);
    assert_eq!(beside("zero_drift:2"), [("backlash:1".to_string(), 21)]);
}

/// A shape joins the base with the size that the data give it, however far the noise is from the declared one.
#[test]
fn a_curve_that_joined_leaves_little_of_its_own_evidence_whatever_the_noise() {
    let config = quick();
    let mut r = arm::rng(8);
    let poses = arm::design(60, &mut r);
    let curve = arm::on_joint(2, |p, _, _| 5e-3 * (25.0 * p.q[2]).sin().powi(3));
    let sound = arm::problem(&poses, &[(curve, vec![])], arm::Noise::White, &mut r, false);
    for declared in [1.0, 15.0] {
        let p = arm::overconfident(sound.clone(), declared);
        with_conditioned(&p, &config, |conditioned_problems| {
            let bare = conditioned_problems.with(&[]).unwrap();
            let cell = bare.weighed.best_cell().unwrap();
            assert_eq!(cell.what.name(), "joint3 <- q3");
            let with = conditioned_problems.with(&[as_candidate(&cell.what, &bare, &config)]).unwrap();
            let own = with.weighed.unlisted.iter().filter(|u| u.what.name() == cell.what.name());
            let left = own.map(|u| u.ln_evidence).fold(0.0, f64::max);
            assert!(left < 0.2 * cell.ln_evidence, "{declared}: {left} of {}", cell.ln_evidence);
        });
    }
}
