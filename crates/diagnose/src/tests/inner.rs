//! What the verdict says, against counts and sums written out.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::problem::{Candidate, Columns};
use crate::search::accepted::{Instead, Scored};
use crate::tests::arm::SIGMA_M;
use crate::tests::{arm, conditioned, entry, own, planted, quick, scatter, with_conditioned};
use armcal_core::DwellId;
use std::sync::Arc;

/// The entry of a problem's first conditioned problem as it would be accepted.
fn accepted(p: &Problem, spec: &str) -> Accepted {
    let config = quick();
    let conditioned = conditioned(p, &config);
    let judged = conditioned.judge(entry(&conditioned.weighed, spec), &config);
    let grade = judged.grade(&config);
    let set = vec![judged.entry];
    let (instead_of, ranked) = Default::default();
    Accepted { candidate: own(p, spec), grade, judged, conditioned, instead_of, set, ranked }
}

fn searched(p: &Problem) -> Search {
    let config = quick();
    with_conditioned(p, &config, |conditioned_problems| {
        let mut found = search(conditioned_problems, &[], &config)?;
        resolve_names(&mut found, conditioned_problems, &config)?;
        Ok::<_, DiagnoseError>(found)
    })
    .unwrap()
}

fn codes(all: &[Warning]) -> Vec<&str> {
    all.iter().map(|w| w.code.as_str()).collect()
}

fn assembled(p: &Problem, search: &Search) -> Diagnosis {
    let config = quick();
    let conditioned = conditioned(p, &config);
    let ranking = with_conditioned(p, &config, |conditioned_problems| {
        Ranking::of(search, &conditioned, conditioned_problems, &config)
    });
    let before = Before::of(&conditioned, ranking, &config);
    assemble(before, (p.dwells.len(), Vec::new()), search, &config)
}

/// Probability of what is not listed where no name was found.
fn p_unlisted(p: &Problem) -> f64 {
    let (config, nothing_found) = (quick(), searched(&planted(&[], 0, 6)));
    let ranking = with_conditioned(p, &config, |conditioned_problems| {
        Ranking::of(&nothing_found, &conditioned(p, &config), conditioned_problems, &config)
    });
    ranking.p_unlisted
}

#[test]
fn nothing_found_is_told_with_the_probability_of_nothing() {
    let p = planted(&[], 0, 6);
    let mut s = searched(&p);
    let d = assembled(&p, &s);
    assert_eq!((d.verdict, d.probability, d.names.len()), (Verdict::NothingMissing, Some(d.p_nothing), 0));
    assert!(d.p_nothing > 0.5 && d.unknown.is_none() && d.unlisted.is_empty());
    let config = quick();
    let first = conditioned(&p, &config);
    let top = first.judge(first.weighed.ranking()[0], &config);
    assert_eq!(d.p_adjusted, top.own().p_adjusted, "that of what stands out most");
    assert!(d.p_adjusted > 0.05, "{}", d.p_adjusted);
    s.left_over = true;
    let d = assembled(&p, &s);
    assert_eq!((d.verdict, d.probability), (Verdict::Unknown, Some(p_unlisted(&p))));
}

#[test]
fn what_was_found_is_told_with_its_numbers() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let s = searched(&p);
    let d = assembled(&p, &s);
    assert_eq!((d.verdict, &d.names[..]), (Verdict::Identified, &["backlash:1".to_string()][..]));
    assert_eq!((d.probability, d.p_adjusted), (Some(d.effects[0].probability), d.effects[0].p_adjusted));
    assert!(d.unknown.is_none() && d.unlisted.is_empty() && d.set_aside.is_empty());
    // The mean over dwells of the left-out errors, before and with the effect in the model.
    let mean = |p: &Problem| {
        let e = left_out(p, None, &by_place(p), 1.0);
        let norm = |i: usize| e.rows(3 * i, 3).norm() * SIGMA_M;
        (0..p.dwells.len()).map(norm).sum::<f64>() / p.dwells.len() as f64 * 1e3
    };
    assert!((d.holdout_mm.before - mean(&p)).abs() < 1e-9);
    assert!((d.holdout_mm.after - mean(&s.with_curves.problem)).abs() < 1e-9);
    assert!(d.holdout_mm.after < 0.6 && d.holdout_mm.before > 1.0);
    // 2 sqrt(2 / pi) sigma for three coordinates.
    let floor_mm = 1e3 * SIGMA_M * 2.0 * (2.0 / std::f64::consts::PI).sqrt();
    assert!((d.floor_mm - floor_mm).abs() < 1e-3 * floor_mm, "{} {floor_mm}", d.floor_mm);
}

#[test]
fn two_names_or_a_doubt_are_ambiguous() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let mut s = searched(&p);
    s.accepted[0].grade = Grade::OrUnlisted;
    let d = assembled(&p, &s);
    assert_eq!(d.verdict, Verdict::Ambiguous);
    assert_eq!(d.names, ["backlash:1", NOT_LISTED]);
    let mut s = searched(&p);
    let other = entry(&s.accepted[0].conditioned.weighed, "scale:2");
    s.accepted[0].set.push(other);
    let d = assembled(&p, &s);
    assert_eq!(
        (d.verdict, &d.names[..]),
        (Verdict::Ambiguous, &["backlash:1".to_string(), "scale:2".into()][..])
    );
}

#[test]
fn several_effects_are_as_sure_as_all_of_them_together() {
    let p = planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3);
    let mut s = searched(&p);
    assert_eq!(s.accepted.len(), 2);
    let (first, second) = (s.accepted[0].judged.entry, s.accepted[1].judged.entry);
    s.accepted[0].judged.significance[first].p_adjusted = 0.004;
    s.accepted[1].judged.significance[second].p_adjusted = 0.007;
    let d = assembled(&p, &s);
    assert_eq!(d.p_adjusted, 0.007);
    assert_eq!(d.probability, Some(d.effects[0].probability * d.effects[1].probability));
}

#[test]
fn an_effects_probability_is_that_of_its_set_and_of_nothing_else() {
    let config = quick();
    let mut a = searched(&planted(&[("backlash:1", 1.0)], 0, 3)).accepted.remove(0);
    let score = a.ranked[0].score.clone();
    let other = entry(&a.conditioned.weighed, "scale:2");
    let share = |what, weight| Scored { what, score: score.clone(), weight };
    let own = Instead::Entry(a.judged.entry);
    a.ranked = vec![share(own, 0.5), share(Instead::Entry(other), 0.3)];
    a.ranked.extend([share(Instead::Nothing, 0.15), share(Instead::Unlisted, 0.05)]);
    a.set = vec![a.judged.entry];
    let found = found_effect(&a, &config);
    assert_eq!((found.probability, &found.set[..]), (0.5, &["backlash:1".to_string()][..]));
    assert_eq!(found.rival.as_ref().map(|r| (r.name.as_str(), r.behind_nats)), Some(("scale:2", 0.0)));
    a.set.push(other);
    let found = found_effect(&a, &config);
    assert!((found.probability - 0.8).abs() < 1e-12 && found.rival.is_none(), "{}", found.probability);
    assert_eq!((found.gain_nats, found.gain_se), (a.judged.gain.nats, a.judged.gain.se));
    assert_eq!(found.above_unlisted_nats, a.judged.unlisted.as_ref().map(|u| -u.above.nats));
    a.grade = Grade::OrUnlisted;
    assert_eq!(found_effect(&a, &config).set, ["backlash:1", "scale:2", NOT_LISTED]);
}

#[test]
fn alike_signatures_are_listed_as_pairs() {
    let config = quick();
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    let all = |p: &Problem| {
        let r = conditioned(p, &config);
        confusable_pairs(&r.problem, &r.weighed, &config)
    };
    assert!(!all(&p).iter().any(|pair| pair.contains(&"backlash:1".to_string())));
    let a = own(&p, "backlash:1");
    let half = |c: &Columns| Columns::Dense(Arc::new(0.5 * c.dense(&p.dwells, 1.0)));
    let twin = Candidate { spec: "twin".into(), columns: half(&a.columns), ..a.clone() };
    // Its columns are so small that these data do not show it: no pair.
    let tiny = Columns::Dense(Arc::new(1e-3 * a.columns.dense(&p.dwells, 1.0)));
    let unseen = Candidate { spec: "unseen".into(), columns: tiny, ..a.clone() };
    let group = Candidate { spec: "backlash:1+else".into(), ..a };
    p.candidates.splice(0..0, [group, unseen, twin]);
    let pairs = all(&p);
    let has = |a: &str, b: &str| pairs.iter().any(|pair| pair[0] == a && pair[1] == b);
    assert!(has("twin", "backlash:1"), "{pairs:?}");
    assert!(
        !pairs.iter().any(|p| p[0] == p[1] || p[0] == "unseen" || p[0] == "backlash:1+else"),
        "{pairs:?}"
    );
}

#[test]
fn noise_that_is_declared_wrongly_is_a_notice() {
    let s = searched(&planted(&[], 0, 5));
    let of = |sigma_ratio: f64, places: f64| {
        let all = warnings(&scatter(sigma_ratio, places), &[], 198, &s, &quick());
        codes(&all).iter().map(|c| c.to_string()).collect::<Vec<_>>()
    };
    assert!(of(1.0, 0.1).is_empty() && of(1.4, 0.1).is_empty() && of(0.5, 0.1).is_empty());
    assert_eq!(of(1.41, 0.1), ["scatter-larger"]);
    assert_eq!(of(0.49, 0.1), ["noise-overdeclared"]);
    assert_eq!(of(1.0, 0.5), ["scatter-correlated"]);
    let noise = scatter(1.0, 0.0);
    let id = DwellId { recording: 1, dwell: 5 };
    let all = warnings(&noise, &[id], 198, &s, &quick());
    assert_eq!(codes(&all), ["suspect-dwell"]);
    assert!(all[0].message.starts_with("1 of 198 dwells"), "{}", all[0].message);
}

#[test]
fn a_change_between_recordings_may_be_a_load_that_is_not_declared() {
    let mut p = planted(&[("tool_shift@1", 1.0)], 0, 3);
    let noise = scatter(1.0, 0.0);
    let of = |p: &Problem, spec: &str| {
        let mut s = searched(&planted(&[], 0, 5));
        s.accepted = vec![accepted(p, spec)];
        codes(&warnings(&noise, &[], 198, &s, &quick())).iter().map(|c| c.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(of(&p, "tool_shift@1"), ["event-or-load"]);
    let mut two = searched(&planted(&[], 0, 5));
    two.accepted = vec![accepted(&p, "tool_shift@1"), accepted(&p, "scale:1"), accepted(&p, "tool_shift@1")];
    assert_eq!(codes(&warnings(&noise, &[], 198, &two, &quick()))[0], "one-event");
    assert!(of(&p, "scale:1").is_empty());
    p.dwells.iter_mut().for_each(|d| d.load_kg = if d.id.recording == 1 { 2.0 } else { 0.0 });
    assert!(of(&p, "tool_shift@1").is_empty(), "the load is declared");
}

#[test]
fn directions_that_a_play_contradicts_are_named() {
    let mut p = planted(&[("backlash:1", 2.0)], 0, 3);
    let turned = [30, 90, 150];
    for i in turned {
        p.dwells[i].arrival[0] *= -1.0;
        for c in p.candidates.iter_mut().filter(|c| c.spec == "backlash:1") {
            let mut dense = c.columns.dense(&p.dwells, 1.0);
            dense.rows_mut(3 * i, 3).neg_mut();
            c.columns = Columns::Dense(Arc::new(dense));
        }
    }
    let a = accepted(&p, "backlash:1");
    let wrong = direction_suspects(&a);
    assert_eq!(wrong, turned.map(|i| p.dwells[i].id));
    let mut s = searched(&planted(&[], 0, 5));
    s.accepted = vec![a];
    let noise = scatter(1.0, 0.0);
    let all = warnings(&noise, &[], 198, &s, &quick());
    assert_eq!(codes(&all), ["suspect-direction"]);
    assert!(all[0].message.starts_with("3 dwells fit backlash:1"), "{}", all[0].message);
    // Those that are right are not.
    let right = accepted(&planted(&[("backlash:1", 2.0)], 0, 3), "backlash:1");
    assert!(direction_suspects(&right).is_empty());
}

#[test]
fn what_was_set_aside_is_reported() {
    let mut r = arm::rng(101);
    let poses = arm::design(0, &mut r);
    let p = arm::problem(&poses, &[], arm::Noise::Swaps, &mut r, false);
    let d = diagnose_problem(&mut crate::LinearRefit::new(p.clone()), &quick()).unwrap();
    assert_eq!(d.verdict, Verdict::NothingMissing);
    assert!(!d.set_aside.is_empty() && codes(&d.warnings).contains(&"suspect-dwell"));
    let bad = DiagnosisConfig { resamplings: 3, ..quick() };
    assert!(
        diagnose_problem(&mut crate::LinearRefit::new(p), &bad).is_err(),
        "a bad configuration is refused"
    );
}

#[test]
fn curves_come_first_and_else_the_best_unlisted() {
    let mut r = arm::rng(40);
    let poses = arm::design(0, &mut r);
    let (_, channel, driver, effect) = arm::outside(1.0).remove(0);
    let p = arm::problem(&poses, &[(effect, vec![])], arm::Noise::White, &mut r, false);
    let s = searched(&p);
    let d = assembled(&p, &s);
    assert_eq!((d.verdict, d.unlisted.len()), (Verdict::Unknown, 1));
    let u = d.unknown.as_ref().unwrap();
    assert_eq!((&u.channel, u.driver), (&channel, driver));
    assert_eq!(d.probability, Some(p_unlisted(&p)));
    assert!(d.probability > Some(0.9), "{:?}", d.probability);
}
