//! Laws of the one order, over planted problems.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::diagnosis::CandidateReport;
use crate::judge::score::Difference;
use crate::search::settle::tests::cases;
use crate::tests::{arm, planted, quick};
use crate::{Diagnosis, LinearRefit, Problem, Verdict, diagnose_problem};

fn diagnosed(p: Problem) -> Diagnosis {
    diagnose_problem(&mut LinearRefit::new(p), &quick()).unwrap()
}

/// The rows that were scored.
fn rows(d: &Diagnosis) -> Vec<(&CandidateReport, Standing)> {
    d.candidates.iter().filter_map(|c| Some((c, c.standing?))).collect()
}

/// Problems with one, two, no and an unlisted effect.
fn all() -> Vec<(String, Diagnosis)> {
    let unlisted = {
        let mut r = arm::rng(40);
        let poses = arm::design(0, &mut r);
        let (_, _, _, effect) = arm::outside(1.0).remove(0);
        arm::problem(&poses, &[(effect, vec![])], arm::Noise::White, &mut r, false)
    };
    let named = cases().into_iter().map(|(p, names)| (names.join(" + "), p));
    let others = [("nothing".to_owned(), planted(&[], 0, 6)), ("unlisted".to_owned(), unlisted)];
    named.chain(others).map(|(name, p)| (name, diagnosed(p))).collect()
}

/// Law: headline, first row, mark and order agree.
fn assert_one_order(name: &str, d: &Diagnosis) {
    let rows = rows(d);
    let scored = d.candidates.iter().take_while(|c| c.standing.is_some()).count();
    assert_eq!(scored, rows.len(), "{name}: what was scored comes first");
    assert_eq!(rows.iter().any(|(_, s)| s.in_answer), !d.effects.is_empty(), "{name}");
    if !d.effects.is_empty() {
        let answer: Vec<&str> = d.effects.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(rows[0].0.spec, answer.join("+"), "{name}: the answer is the first row");
        assert_eq!((rows[0].1.behind_nats, rows[0].1.behind_se), (0.0, 0.0), "{name}");
        // Each member of a set, and these alone, is a row of the answer.
        let members: usize = d.effects.iter().map(|e| e.set.len() - 1).sum();
        let unnamed = d.effects.iter().flat_map(|e| &e.set).filter(|n| n.contains("not listed")).count();
        assert_eq!(rows.iter().filter(|(_, s)| s.in_answer).count(), 1 + members - unnamed, "{name}");
    }
    let marks: Vec<bool> = rows.iter().map(|(_, s)| s.in_answer).collect();
    assert!(marks.is_sorted_by(|a, b| a >= b), "{name}: rows of the answer come before all others");
    let others: Vec<f64> = rows.iter().filter(|(_, s)| !s.in_answer).map(|(_, s)| s.probability).collect();
    assert!(others.is_sorted_by(|a, b| a >= b), "{name}: {others:?}");
}

/// Law: shares are shares.
fn assert_shares(name: &str, d: &Diagnosis) {
    let rows = rows(d);
    assert!(rows.iter().all(|(_, s)| (0.0..=1.0).contains(&s.probability)), "{name}");
    let listed: f64 = rows.iter().map(|(_, s)| s.probability).sum();
    assert!(listed <= 1.0 + 1e-9, "{name}: {listed}");
    if d.effects.len() < 2 {
        let total = listed + d.p_nothing + if d.effects.is_empty() { 0.0 } else { p_unlisted(d) };
        assert!(total <= 1.0 + 1e-9, "{name}: {total}");
    }
}

/// What no row has of the probability of one effect's place.
fn p_unlisted(d: &Diagnosis) -> f64 {
    let scored: f64 = rows(d).iter().map(|(_, s)| s.probability).sum();
    (1.0 - scored - d.p_nothing).max(0.0)
}

/// Law: no explanation outside the answer is clearly better than it.
fn assert_no_better_loser(name: &str, d: &Diagnosis) {
    let gain: f64 = d.effects.iter().map(|e| e.gain_nats).fold(0.0, f64::max);
    for (row, s) in rows(d) {
        let ahead = Difference { nats: -s.behind_nats, se: s.behind_se };
        let detail = quick().leftover_share * gain;
        assert!(!ahead.is_clear(detail), "{name}: {} is {ahead:?} better than the answer", row.spec);
    }
}

#[test]
fn the_laws_of_one_order_of_shares_and_of_no_better_loser() {
    for (name, d) in all() {
        assert_one_order(&name, &d);
        assert_shares(&name, &d);
        assert_no_better_loser(&name, &d);
    }
}

#[test]
fn the_best_of_the_rest_is_told_as_the_rival() {
    for (name, d) in all() {
        let [found] = &d.effects[..] else { continue };
        let mut others = rows(&d).into_iter().filter(|(_, s)| !s.in_answer && s.probability > 0.0);
        let next = others.next().map(|(row, s)| (row.spec.as_str(), s.behind_nats));
        if let (Some(next), Some(rival)) = (next, &found.rival) {
            assert!(rival.behind_nats <= next.1 + 1e-9, "{name}: {next:?} {rival:?}");
        }
    }
}

#[test]
fn several_effects_have_a_row_for_each_that_could_stand_in_the_place_of_one() {
    let d = diagnosed(planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3));
    assert_eq!(d.verdict, Verdict::Identified);
    let together = rows(&d).into_iter().filter(|(row, _)| row.spec.contains(Candidate::AND));
    for (row, s) in together {
        let parts: Vec<&str> = row.spec.split(Candidate::AND).collect();
        let kept = parts.iter().filter(|part| d.names.iter().any(|n| n == *part)).count();
        assert!(kept + 1 >= parts.len() || s.probability == 0.0, "{} swaps more than one", row.spec);
    }
    // Each by itself is behind both.
    for name in &d.names {
        let (_, s) = rows(&d).into_iter().find(|(row, _)| row.spec == *name).unwrap();
        let behind = Difference { nats: s.behind_nats, se: s.behind_se };
        assert!(behind.is_clear(10.0) && s.probability == 0.0, "{name} alone is {behind:?} behind");
    }
}

#[test]
fn shares_of_several_effects_multiply() {
    use crate::search::accepted::Scored;
    use crate::search::search;
    use crate::search::settle::resolve_names;
    use crate::tests::{conditioned as first_room, entry, with_conditioned};
    let (p, config) = (planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3), quick());
    let base = first_room(&p, &config);
    with_conditioned(&p, &config, |conditioned_problems| {
        let mut found = search(conditioned_problems, &[], &config).unwrap();
        resolve_names(&mut found, conditioned_problems, &config).unwrap();
        assert_eq!(found.accepted.len(), 2);
        let shares = [("backlash:3", 0.75, 0.2, 0.05), ("zero_drift:3", 0.5, 0.4, 0.1)];
        for (a, (other, own, share, nothing)) in found.accepted.iter_mut().zip(shares) {
            let score = a.judged.score.clone();
            a.judged.significance[a.judged.entry].p_adjusted = nothing;
            let named = entry(&a.conditioned.weighed, other);
            a.judged.significance[named].p_adjusted = 0.01;
            let what = [
                (Instead::Entry(a.judged.entry), own),
                (Instead::Entry(entry(&a.conditioned.weighed, other)), share),
                (Instead::Nothing, nothing),
            ];
            a.ranked = what.map(|(what, weight)| Scored { what, score: score.clone(), weight }).to_vec();
        }
        let names: Vec<String> = found.accepted.iter().map(|a| a.candidate.spec.clone()).collect();
        let ranking = Ranking::of_answer(&found.accepted, &base, conditioned_problems, &config);
        let of = |first: &str, second: &str| {
            let row = ranking.explanations.iter().find(|e| e.effects == [first, second]).unwrap();
            row.standing.probability
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(of(&names[0], &names[1]), 0.75 * 0.5);
        near(of("backlash:3", &names[1]), 0.2 * 0.5);
        near(of(&names[0], "zero_drift:3"), 0.75 * 0.4);
        near(ranking.p_nothing, 0.05 * 0.1);
        near(ranking.p_unlisted, 0.0);
        // Of several the largest family-wise p-value: that of the name which stays, and of what takes the other one's place.
        let [a, b] = &found.accepted[..] else { panic!("two") };
        let swapped = ranking.explanations.iter().find(|e| e.effects == ["backlash:3", &names[1]]).unwrap();
        let p = |a: &Accepted, k: usize| a.judged.significance[k].p_adjusted;
        let of_other = p(a, entry(&a.conditioned.weighed, "backlash:3"));
        assert_eq!(swapped.p_adjusted, of_other.max(p(b, b.judged.entry)));
    });
}

#[test]
fn without_a_name_what_is_not_listed_has_its_share() {
    let mut r = arm::rng(40);
    let poses = arm::design(0, &mut r);
    let (_, _, _, effect) = arm::outside(1.0).remove(0);
    let p = arm::problem(&poses, &[(effect, vec![])], arm::Noise::White, &mut r, false);
    let ranking = Ranking::of_nothing(&crate::tests::conditioned(&p, &quick()), &quick());
    let listed: f64 = ranking.explanations.iter().map(|e| e.standing.probability).sum();
    assert!(ranking.p_unlisted > 0.9, "{}", ranking.p_unlisted);
    assert!((ranking.p_nothing + ranking.p_unlisted + listed - 1.0).abs() < 1e-9);
}
