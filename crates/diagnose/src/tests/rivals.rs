//! What refits decide, against closed forms and refits made up.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::judge::Judged;
use crate::refit::LinearRefit;
use crate::tests::{entry, in_rooms, planted, quick};
use crate::weigh::weigh;
use crate::{Problem, Refit};
use std::collections::BTreeMap;

#[test]
fn the_evidence_of_a_refit_is_that_of_a_gaussian() {
    // One observation y = a x + e, x ~ N(0, 1), e ~ N(0, s^2): y ~ N(0, a^2 + s^2).
    let (a, y, variance) = (3.0f64, 5.0f64, 2.0f64);
    let x = a * y / (a * a + variance);
    let square = (y - a * x).powi(2) + variance * x * x;
    let refit = AfterRefit { square, rows: 1, normal: DMatrix::from_element(1, 1, a * a) };
    let marginal = -0.5 * y * y / (a * a + variance) - 0.5 * (a * a / variance + 1.0).ln();
    assert!((refit.ln_evidence(variance).unwrap() - marginal).abs() < 1e-12);
    let rows = AfterRefit { square: 30.0, rows: 12, normal: DMatrix::zeros(2, 2) };
    assert_eq!(rows.variance(), 3.0);
}

/// Refits as they are told: the square that remains with these effects.
struct Told {
    linear: LinearRefit,
    square: BTreeMap<&'static str, f64>,
    asked: Vec<Vec<String>>,
}

impl Refit for Told {
    fn problem(&mut self, accepted: &[Candidate]) -> Result<Problem, DiagnoseError> {
        self.linear.problem(accepted)
    }

    fn refitted(
        &mut self,
        accepted: &[Candidate],
        keep: &[bool],
    ) -> Result<Option<AfterRefit>, DiagnoseError> {
        self.asked.push(accepted.iter().map(|c| c.spec.clone()).collect());
        let last = accepted.last().map_or("", |c| c.spec.as_str());
        let rows = 3 * keep.iter().filter(|k| **k).count();
        let after = |square: &f64| AfterRefit { square: *square, rows, normal: DMatrix::zeros(0, 0) };
        Ok(self.square.get(last).map(after))
    }
}

/// The answer to a planted play once each refit leaves so much (declared noise = 1, 594 rows).
fn answer(square: &[(&'static str, f64)]) -> (Vec<String>, Grade) {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let mut search = in_rooms(&p, &config, |rooms| crate::search::search(rooms, &[], &config)).unwrap();
    let mut refit = Told {
        linear: LinearRefit::new(p.clone()),
        square: square.iter().copied().collect(),
        asked: Vec::new(),
    };
    let first = (p.clone(), weigh(&p, &config));
    let mut rooms = Rooms::new(&mut refit, vec![true; p.dwells.len()], first, &config);
    // All entries are within reach of the name.
    let own = search.accepted[0].judged.entry;
    let room = std::rc::Rc::make_mut(&mut search.accepted[0].room);
    for (spec, _) in square {
        let at = entry(&room.weighed, spec);
        room.weighed.entries[at].ln_evidence = room.weighed.entries[own].ln_evidence - 1.0;
    }
    settle(&mut search, &mut rooms, &config).unwrap();
    let a = &search.accepted[0];
    let names = a.judged.set.iter().map(|k| a.room.weighed.entries[*k].candidate.spec.clone());
    assert_eq!(a.candidate.spec, a.room.weighed.entries[a.judged.entry].candidate.spec);
    (names.collect(), a.grade)
}

#[test]
fn a_rival_counts_as_its_refit_does() {
    let name = |s: &str| vec![s.to_string()];
    // Nothing refits: nothing changes. Far behind: the name stays alone.
    assert_eq!(answer(&[]).0, name("backlash:1"));
    assert_eq!(answer(&[("backlash:1", 500.0), ("zero_drift:1", 600.0)]), (name("backlash:1"), Grade::Named));
    // Half a square is a nat: within three they stand beside each other.
    let both = vec!["backlash:1".to_string(), "zero_drift:1".to_string()];
    assert_eq!(answer(&[("backlash:1", 500.0), ("zero_drift:1", 505.9)]).0, both);
    assert_eq!(answer(&[("backlash:1", 500.0), ("zero_drift:1", 506.1)]).0, name("backlash:1"));
    assert_eq!(answer(&[("backlash:1", 505.9), ("zero_drift:1", 500.0)]).0, both);
    // Clearly better after the refit: it has the name, or nothing has it alone.
    let (set, grade) = answer(&[("backlash:1", 560.0), ("zero_drift:1", 500.0)]);
    assert!(set == name("zero_drift:1") || (set == both && grade == Grade::OrUnlisted), "{set:?} {grade:?}");
    // What a rival without a fit would leave is not known.
    assert_eq!(answer(&[("zero_drift:1", 100.0)]).0, name("backlash:1"));
}

/// A planted play as it is found.
fn found() -> Accepted {
    let config = quick();
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let search = in_rooms(&p, &config, |rooms| crate::search::search(rooms, &[], &config)).unwrap();
    search.accepted[0].clone()
}

#[test]
fn rivals_are_as_far_behind_as_a_linearised_fit_may_put_them() {
    let mut found = found();
    let within = |found: &mut Accepted, own: f64, behind: f64| {
        let room = std::rc::Rc::make_mut(&mut found.room);
        let at = entry(&room.weighed, "zero_drift:1");
        room.weighed.entries.iter_mut().for_each(|e| e.ln_evidence = 0.0);
        room.weighed.entries[found.judged.entry].ln_evidence = own;
        room.weighed.entries[at].ln_evidence = own - behind;
        rivals(found, &found.room).contains(&at)
    };
    assert!(within(&mut found, 60.0, 39.0) && !within(&mut found, 60.0, 41.0));
    assert!(within(&mut found, 2000.0, 999.0) && !within(&mut found, 2000.0, 1001.0));
}

#[test]
fn what_is_known_is_not_asked_and_where_noise_repeats_only_what_is_no_less_simple() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let config = quick();
    let after = |change: &dyn Fn(&mut Accepted), square: &[(&'static str, f64)]| {
        let square = square.iter().copied().collect();
        let mut refit = Told { linear: LinearRefit::new(p.clone()), square, asked: Vec::new() };
        let first = (p.clone(), weigh(&p, &config));
        let mut search = in_rooms(&p, &config, |rooms| crate::search::search(rooms, &[], &config)).unwrap();
        change(&mut search.accepted[0]);
        let mut rooms = Rooms::new(&mut refit, vec![true; p.dwells.len()], first, &config);
        settle(&mut search, &mut rooms, &config).unwrap();
        let a = &search.accepted[0];
        let names = a.judged.set.iter().map(|k| a.room.weighed.entries[*k].candidate.spec.clone());
        (refit.asked.len(), names.collect::<Vec<_>>())
    };
    assert!(after(&|_| (), &[]).0 >= 1);
    assert_eq!(after(&|a| a.candidate.known = Some("seen".into()), &[]).0, 0);
    // One rival within reach, of one amplitude as the name or of more.
    let repeats = |rival: &'static str| {
        move |a: &mut Accepted| {
            let own = a.judged.entry;
            let weighed = &mut std::rc::Rc::make_mut(&mut a.room).weighed;
            weighed.p_noise = vec![(Noise::Place, 0.9)];
            weighed.entries.iter_mut().for_each(|e| e.ln_evidence = 0.0);
            let at = entry(weighed, rival);
            weighed.entries[own].ln_evidence = 500.0;
            weighed.entries[at].ln_evidence = 480.0;
        }
    };
    let alone = vec!["backlash:1".to_owned()];
    let both = vec!["backlash:1".to_owned(), "zero_drift:1".to_owned()];
    let (drift, play) = ("zero_drift:1", "backlash:1");
    assert_eq!(after(&repeats(drift), &[(play, 600.0), (drift, 605.0)]), (2, both));
    assert_eq!(after(&repeats(drift), &[(play, 600.0), (drift, 607.0)]), (2, alone.clone()));
    assert_eq!(after(&repeats("tool_shift@1"), &[(play, 600.0), ("tool_shift@1", 100.0)]), (0, alone));
}

#[test]
fn what_a_refit_puts_far_behind_leaves_the_answer_and_what_it_puts_ahead_takes_the_name() {
    let mut found = found();
    let own = found.judged.entry;
    let other = entry(&found.room.weighed, "zero_drift:1");
    std::rc::Rc::make_mut(&mut found.room).weighed.entries[own].ln_evidence = 60.0;
    found.judged.set = vec![own, other];
    // Twice three nats.
    let after = |ln: f64| decided(&found, &[(own, 100.0), (other, 100.0 + ln)], &quick());
    assert!(after(-5.9).is_none(), "it stays beside");
    let alone = after(-6.1).unwrap();
    assert_eq!(alone.judged.set, [own]);
    // Together they are as probable as they were, each in the proportion of its refit.
    let linearised = |k: usize| found.room.weighed.entries[k].probability;
    let together = linearised(own) + linearised(other);
    assert!((alone.probability(own) - together / (1.0 + (-6.1f64).exp())).abs() < 1e-12);
    assert!((alone.probability(other) - together / (1.0 + 6.1f64.exp())).abs() < 1e-12);
    assert!((alone.ln_evidence(own) - alone.ln_evidence(other) - 6.1).abs() < 1e-9);
    let third = entry(&found.room.weighed, "scale:1");
    assert_eq!(alone.probability(third), linearised(third));
    assert!(after(2.9).is_none());
    let ahead = after(3.1).unwrap();
    assert!(ahead.judged.entry == other || ahead.grade == Grade::OrUnlisted);
}

#[test]
fn what_was_found_is_settled_with_everything_else_that_was_found() {
    let p = planted(&[("backlash:1", 1.0), ("zero_drift:3", 1.0)], 0, 3);
    let config = quick();
    let mut search = in_rooms(&p, &config, |rooms| crate::search::search(rooms, &[], &config)).unwrap();
    let mut found: Vec<String> = search.accepted.iter().map(|a| a.candidate.spec.clone()).collect();
    found.sort();
    assert_eq!(found, ["backlash:1", "zero_drift:3"]);
    let mut refit = Told { linear: LinearRefit::new(p.clone()), square: BTreeMap::new(), asked: Vec::new() };
    let first = (p.clone(), weigh(&p, &config));
    let mut rooms = Rooms::new(&mut refit, vec![true; p.dwells.len()], first, &config);
    settle(&mut search, &mut rooms, &config).unwrap();
    assert!(refit.asked.iter().all(|a| a.len() == 2 && a[0] != a[1]), "{:?}", refit.asked);
    for one in &found {
        assert!(refit.asked.iter().any(|a| &a[0] == one), "beside {one}: {:?}", refit.asked);
    }
}

#[test]
fn a_name_that_a_refit_puts_behind_the_truth_is_taken_back() {
    // The drift was told where the play was planted.
    let mut found = found();
    let config = quick();
    let (truth, told) = (found.judged.entry, entry(&found.room.weighed, "zero_drift:1"));
    found.judged = Judged { entry: told, set: vec![told], ..found.judged.clone() };
    found.candidate = found.room.weighed.entries[told].candidate.clone();
    let after = decided(&found, &[(told, 100.0), (truth, 120.0)], &config).unwrap();
    assert_eq!((after.candidate.spec.as_str(), after.judged.entry), ("backlash:1", truth));
    assert_eq!((after.judged.set, after.grade), (vec![truth], Grade::Named));
}
