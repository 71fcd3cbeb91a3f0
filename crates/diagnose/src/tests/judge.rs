//! When a name may be told, against the rules written out and planted effects.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::{judge as judge_among, *};
use crate::problem::Candidate;
use crate::problem::Columns;
use crate::tests::{entry, outside, own, planted, quick, room};
use crate::weigh::weigh;
use armcal_core::DwellId;
use nalgebra::DMatrix;
use std::sync::Arc;

/// Judges an entry among all that a weighed problem tries.
fn judge(problem: &Problem, weighed: &Weighed, entry: usize, config: &DiagnosisConfig) -> Judged {
    judge_among(problem, weighed, &significance(problem, weighed, config), entry, config)
}

/// A planted play, weighed and judged.
fn judged() -> (Problem, Weighed, Judged) {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let weighed = weigh(&p, &quick());
    let judged = judge(&p, &weighed, entry(&weighed, "backlash:1"), &quick());
    (p, weighed, judged)
}

#[test]
fn a_planted_play_is_judged_as_what_it_is() {
    let (p, weighed, j) = judged();
    assert_eq!(j.grade(&weighed, &quick()), Grade::Named);
    assert_eq!(j.set, [j.entry], "no other effect is the same answer");
    assert!(j.own().p_adjusted <= 0.01 && j.margin > 0.0 && j.p_other < 0.01);
    assert!(j.places.after < 0.7 * j.places.before && j.places.p < 0.01);
    assert_eq!((j.places.groups, j.recordings.unwrap().groups), (33, 3));
    assert!(j.contrast.as_ref().unwrap().agrees);
    let white = &weighed.metrics[0].projection;
    let own = white.gram(&own(&p, "backlash:1").columns.dense(&p.dwells, 1.0));
    assert!((&j.gram.a - own.a).amax() < 1e-9 && (&j.gram.g - own.g).amax() < 1e-9);
    assert_eq!(j.significance.len(), weighed.entries.len());
}

#[test]
fn one_recording_has_no_recordings_to_leave_out() {
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    p = p.without(&p.dwells.iter().map(|d| d.id.recording == 0).collect::<Vec<_>>());
    let weighed = weigh(&p, &quick());
    assert!(judge(&p, &weighed, 0, &quick()).recordings.is_none());
}

#[test]
fn what_is_real_needs_evidence_gate_and_left_out_errors() {
    let (_, mut weighed, mut j) = judged();
    let config = quick();
    let mut with = |ln_evidence: f64, p_adjusted: f64, p_raw: f64, places_p: f64| {
        weighed.entries[j.entry].ln_evidence = ln_evidence;
        let own = j.entry;
        j.significance[own].p_adjusted = p_adjusted;
        j.significance[own].p_raw = p_raw;
        j.places.p = places_p;
        (j.real(&weighed, &config), j.promising(&weighed, &config))
    };
    assert_eq!(with(3.0, 0.01, 0.05, 0.049), (true, true));
    assert_eq!(with(2.9, 0.01, 0.05, 0.049), (false, false));
    assert_eq!(with(3.0, 0.02, 0.05, 0.049), (false, true));
    assert_eq!(with(3.0, 0.01, 0.06, 0.049), (true, false));
    assert_eq!(with(3.0, 0.01, 0.05, 0.05), (false, false));
}

#[test]
fn a_name_needs_what_is_real_and_listed_and_beats_the_rest() {
    let (_, mut weighed, j) = judged();
    let config = quick();
    weighed.p_nothing = 0.2;
    let with = |change: &dyn Fn(&mut Judged)| {
        let mut changed = Judged { p_other: 0.0, margin: 1.0, ..j.clone() };
        change(&mut changed);
        changed.grade(&weighed, &config)
    };
    assert_eq!(with(&|_| ()), Grade::Named);
    assert_eq!(with(&|j| j.margin = 0.0), Grade::Named);
    assert_eq!(with(&|j| j.margin = -0.1), Grade::OrUnlisted);
    // Something is missing with 0.8: a twentieth of that is 0.04, half of it 0.4.
    assert_eq!(with(&|j| j.p_other = 0.0399), Grade::Named);
    assert_eq!(with(&|j| j.p_other = 0.041), Grade::OrUnlisted);
    assert_eq!(with(&|j| j.p_other = 0.399), Grade::OrUnlisted);
    assert_eq!(with(&|j| j.p_other = 0.401), Grade::Refused);
    assert_eq!(with(&|j| j.set = vec![0; 8]), Grade::Named);
    assert_eq!(with(&|j| j.set = vec![0; 9]), Grade::Refused);
    assert_eq!(with(&|j| j.places.p = 0.5), Grade::Refused);
    assert_eq!(with(&|j| j.contrast = None), Grade::Named);
    assert_eq!(with(&|j| j.impossible = vec!["compliance".into()]), Grade::OrUnlisted);
    assert_eq!(with(&|j| j.contrast.as_mut().unwrap().agrees = false), Grade::OrUnlisted);
}

#[test]
fn dwells_keep_their_sign_together_as_the_noise_repeats() {
    let p = planted(&[], 0, 1);
    let mut weighed = weigh(&p, &quick());
    let mut under = |noise| {
        weighed.p_noise = vec![(noise, 0.9)];
        clusters(&p, &weighed)
    };
    // 198 dwells of 33 cavities, visited twice in each of three recordings of 66.
    assert_eq!(under(Noise::White).len(), 198);
    let places = under(Noise::Place);
    assert_eq!((places.len(), places[0].len()), (33, 6));
    let visits = under(Noise::Visit);
    assert_eq!((visits.len(), visits[0].len()), (99, 2));
    for noise in [Noise::Memory, Noise::Sensor, Noise::SensorAndPlace] {
        let blocks = under(noise);
        assert_eq!((blocks.len(), &blocks[0][..], blocks[8].len()), (27, &[0, 1, 2, 3, 4, 5, 6, 7][..], 2));
    }
}

#[test]
fn too_few_clusters_are_dwells_by_themselves() {
    let p = planted(&[], 0, 1);
    let of = |dwells: usize| {
        let mut p = p.without(&(0..198).map(|i| i < dwells).collect::<Vec<_>>());
        p.dwells.iter_mut().enumerate().for_each(|(i, d)| d.id = DwellId { recording: 0, dwell: i });
        let mut weighed = weigh(&p, &quick());
        weighed.p_noise = vec![(Noise::Memory, 0.9)];
        clusters(&p, &weighed).len()
    };
    assert_eq!((of(96), of(88)), (12, 88), "eleven blocks of eight are too few");
}

#[test]
fn stretches_are_left_out_where_noise_remembers() {
    let p = planted(&[], 0, 1);
    let mut weighed = weigh(&p, &quick());
    assert_eq!(independent_groups(&p, &weighed).len(), 33);
    weighed.p_noise = vec![(Noise::Memory, 0.9)];
    let stretches = independent_groups(&p, &weighed);
    assert!(stretches.iter().any(|g| g.unseen.len() > g.scored.len()));
}

/// A problem in which another candidate is the play in joint 1 with a share of another column.
fn with_twin(share: f64) -> Problem {
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    let (a, b) = (own(&p, "backlash:1"), own(&p, "backlash:3"));
    let mixed = a.columns.dense(&p.dwells, 1.0) + share * b.columns.dense(&p.dwells, 1.0);
    let columns = Columns::Dense(Arc::new(mixed));
    p.candidates.push(Candidate { spec: "twin".into(), family: "twin".into(), columns, ..a });
    p
}

#[test]
fn what_looks_the_same_is_in_the_answer_once() {
    let config = quick();
    let set_of = |p: &Problem, change: &dyn Fn(&mut Weighed)| {
        let mut weighed = weigh(p, &config);
        change(&mut weighed);
        let j = judge(p, &weighed, entry(&weighed, "backlash:1"), &config);
        j.set.iter().map(|k| weighed.entries[*k].candidate.spec.clone()).collect::<Vec<_>>()
    };
    assert_eq!(set_of(&with_twin(0.02), &|_| ()), ["backlash:1", "twin"]);
    // While the evidence is: 3 nats behind it is another answer, however alike its signature, unless that is less than the
    // detail of a shape: a hundredth of what the data say for it.
    for (share, beyond, set) in [
        (1e-9, -0.1, &["backlash:1", "twin"][..]),
        (1e-9, 0.1, &["backlash:1"][..]),
        (0.1, -0.1, &["backlash:1", "twin"][..]),
        (0.1, 0.1, &["backlash:1"][..]),
    ] {
        let p = with_twin(0.02);
        let config = DiagnosisConfig { leftover_share: share, ..quick() };
        let mut w = weigh(&p, &config);
        let (own, k) = (entry(&w, "backlash:1"), entry(&w, "twin"));
        let of_own = w.entries[own].ln_evidence;
        assert!(0.1 * of_own > 4.0, "{of_own}");
        let nats = (share * of_own).max(3.0) + beyond;
        w.entries[own].probability += w.entries[k].probability;
        (w.entries[k].ln_evidence, w.entries[k].probability) = (of_own - nats, 0.0);
        let j = judge(&p, &w, own, &config);
        let names: Vec<&str> = j.set.iter().map(|k| w.entries[*k].candidate.spec.as_str()).collect();
        assert_eq!(names, set, "{nats} nats of {of_own}");
    }
    // Signatures that are parallel enough, though these data tell their difference.
    let near = |w: &mut Weighed| {
        let (own, k) = (entry(w, "backlash:1"), entry(w, "twin"));
        w.entries[own].probability = 1.0;
        (w.entries[k].ln_evidence, w.entries[k].probability) = (w.entries[own].ln_evidence - 1.0, 0.0);
    };
    assert_eq!(set_of(&with_twin(0.1), &near), ["backlash:1", "twin"]);
    assert_eq!(set_of(&with_twin(1.5), &near), ["backlash:1"]);
    assert_eq!(set_of(&with_twin(1.5), &|_| ()), ["backlash:1"]);
    // The set holds 95 % of what is not nothing: another entry with a large part of it belongs to it.
    let probable = |w: &mut Weighed| {
        let k = entry(w, "scale:2");
        w.entries.iter_mut().for_each(|e| e.probability = 0.0);
        (w.p_nothing, w.p_unlisted) = (0.0, 0.0);
        let own = entry(w, "backlash:1");
        (w.entries[own].probability, w.entries[k].probability) = (0.94, 0.06);
    };
    assert_eq!(set_of(&with_twin(1.5), &probable), ["backlash:1", "scale:2"]);
    let enough = |w: &mut Weighed| {
        probable(w);
        let own = entry(w, "backlash:1");
        w.entries[own].probability = 0.951;
    };
    assert_eq!(set_of(&with_twin(1.5), &enough), ["backlash:1"]);
    // Half of everything is nothing: then the rest is weighed against the other half.
    let half = |w: &mut Weighed| {
        probable(w);
        w.p_nothing = 0.5;
        let own = entry(w, "backlash:1");
        w.entries[own].probability = 0.48;
    };
    assert_eq!(set_of(&with_twin(1.5), &half), ["backlash:1"]);
    // What is not listed takes its part of the mass, and no name.
    let unlisted = |w: &mut Weighed| {
        probable(w);
        w.p_unlisted = 0.9;
        let (own, k) = (entry(w, "backlash:1"), entry(w, "scale:2"));
        (w.entries[own].probability, w.entries[k].probability) = (0.06, 0.01);
    };
    assert_eq!(set_of(&with_twin(1.5), &unlisted), ["backlash:1"]);
}

#[test]
fn groups_and_second_values_are_no_names_of_their_own() {
    let config = quick();
    let mut p = with_twin(0.02);
    let twin = own(&p, "twin");
    p.candidates.push(Candidate { spec: "twin+more".into(), ..twin.clone() });
    for shape in [2, 3] {
        let point = Candidate { spec: format!("backlash:1,shape={shape}"), ..own(&p, "backlash:1") };
        p.scans.push(crate::Scan::of("backlash:1", vec![point]));
    }
    let weighed = weigh(&p, &config);
    let j = judge(&p, &weighed, entry(&weighed, "backlash:1"), &config);
    let set: Vec<_> = j.set.iter().map(|k| weighed.entries[*k].candidate.spec.as_str()).collect();
    assert_eq!(set, ["backlash:1", "twin"]);
}

#[test]
fn the_answer_is_ordered_by_evidence_after_its_own_name() {
    let config = quick();
    let mut p = with_twin(0.02);
    let twin = own(&p, "twin");
    p.candidates.push(Candidate { spec: "third".into(), family: "third".into(), ..twin });
    let mut weighed = weigh(&p, &config);
    for (spec, ln) in [("backlash:1", 30.0), ("twin", 31.0), ("third", 32.0)] {
        let k = entry(&weighed, spec);
        weighed.entries[k].ln_evidence = ln;
    }
    let j = judge(&p, &weighed, entry(&weighed, "backlash:1"), &config);
    let set: Vec<_> = j.set.iter().map(|k| weighed.entries[*k].candidate.spec.as_str()).collect();
    assert_eq!(set, ["backlash:1", "third", "twin"]);
}

#[test]
fn a_rival_that_the_data_hardly_tell_apart_is_in_the_answer_while_it_is_as_likely() {
    // One that differs by less than `min_delta` at the fitted size, and not to the eye: a play so small that it is hardly
    // seen.
    let config = DiagnosisConfig { merge_cosine: 0.999_999, credible_mass: 0.01, ..quick() };
    let p = with_twin(0.3);
    let mut weighed = weigh(&p, &config);
    let (own, twin) = (entry(&weighed, "backlash:1"), entry(&weighed, "twin"));
    let mut set = |gap: f64, min_delta: f64| {
        weighed.entries[own].ln_evidence = 40.0;
        weighed.entries[twin].ln_evidence = 40.0 - gap;
        let config = DiagnosisConfig { min_delta, ..config.clone() };
        judge(&p, &weighed, own, &config).set.contains(&twin)
    };
    assert!(set(2.9, 1e9) && !set(3.1, 1e9));
    assert!(!set(2.9, 1e-9));
}

/// What these unlisted leave of a name: columns, cell or not, ln evidence, probability.
fn told(unlisted: &[(&str, bool, f64, f64)], config: &DiagnosisConfig) -> super::Unlisted {
    let p = with_twin(0.05);
    let mut weighed = weigh(&p, config);
    let own_entry = entry(&weighed, "backlash:1");
    weighed.entries[own_entry].ln_evidence = 40.0;
    weighed.unlisted =
        unlisted.iter().map(|(s, cell, ln, share)| outside(&p, s, *cell, *ln, *share)).collect();
    let metric = &weighed.metrics[0];
    let own = Seen::of(&weighed.entries[own_entry].candidate.columns, &p, &weighed, metric);
    against_unlisted(&p, &weighed, (metric, &own), own_entry, config)
}

/// Margin and probability of what else may be.
fn against(unlisted: &[(&str, bool, f64, f64)], config: &DiagnosisConfig) -> (f64, f64) {
    let told = told(unlisted, config);
    (told.margin, told.p_other)
}

#[test]
fn what_has_the_shape_of_a_name_counts_for_it_and_is_not_what_it_is_compared_with() {
    let config = DiagnosisConfig { leftover_share: 1e-9, ..quick() };
    let of = |unlisted: &[(&str, bool, f64, f64)]| {
        let told = told(unlisted, &config);
        (told.p_same, told.p_other, told.best_other)
    };
    assert_eq!(of(&[]), (0.0, 0.0, 0.0));
    assert_eq!(of(&[("twin", true, 90.0, 0.7), ("scale:3", true, 38.0, 0.2)]), (0.7, 0.2, 38.0));
    assert_eq!(of(&[("twin", true, 90.0, 0.7), ("scale:3", true, 20.0, 1e-9)]), (0.7, 0.0, 20.0));
}

#[test]
fn a_name_must_beat_what_is_not_listed_unless_that_is_the_same_shape() {
    // Smaller shares than any difference count as another shape.
    let config = DiagnosisConfig { leftover_share: 1e-9, ..quick() };
    let of = |unlisted: &[(&str, bool, f64, f64)]| against(unlisted, &config);
    assert_eq!(of(&[]), (f64::INFINITY, 0.0));
    let near = |a: (f64, f64), b: (f64, f64)| {
        assert!((a.0 - b.0).abs() < 1e-9 || a.0 == b.0, "{a:?} {b:?}");
        assert!((a.1 - b.1).abs() < 1e-12, "{a:?} {b:?}");
    };
    // Far behind and improbable: asked for the margin of 3 whatever its shape.
    near(of(&[("scale:3", true, 30.0, 1e-4)]), (7.0, 0.0));
    near(of(&[("backlash:1", true, 30.0, 1e-4)]), (7.0, 0.0));
    near(
        of(&[("scale:3", true, 30.0, 1e-4), ("scale:2", true, 35.0, 1e-4), ("scale:1", true, 20.0, 1e-4)]),
        (2.0, 0.0),
    );
    // Near or probable: its shape is looked at. Another shape is a rival, whose probability counts.
    near(of(&[("scale:3", true, 38.0, 0.2)]), (-1.0, 0.2));
    near(of(&[("scale:3", true, 30.0, 0.2), ("scale:2", true, 38.0, 0.1)]), (-1.0, 0.3));
    near(of(&[("scale:3", true, 38.0, 1e-4)]), (-1.0, 1e-4));
    // The same shape needs no margin, and is no other explanation.
    near(of(&[("twin", true, 39.0, 0.2)]), (1.0, 0.0));
    // What names no channel is no name to beat.
    near(of(&[("scale:3", false, 38.0, 0.2)]), (f64::INFINITY, 0.2));
    // A detail of the effect's shape needs not be beaten.
    near(
        against(&[("twin", true, 45.0, 0.2)], &DiagnosisConfig { leftover_share: 0.9, ..quick() }),
        (f64::INFINITY, 0.0),
    );
}

#[test]
fn the_gate_runs_over_entries_and_thinned_scans() {
    let mut p = planted(&[], 0, 1);
    let entries = p.candidates.len();
    let point = own(&p, "scale:2");
    let scan = |n: usize| crate::Scan::of("scan", vec![point.clone(); n]);
    let mut with = |scans: Vec<crate::Scan>| {
        p.scans = scans;
        let weighed = weigh(&p, &quick());
        gate_directions(&p, &weighed).len() - weighed.entries.len()
    };
    assert_eq!(with(Vec::new()), 0);
    assert_eq!(with(vec![scan(80)]), 80);
    // Every second of 81, every third of 161 and so on: never more than 80.
    assert_eq!(with(vec![scan(81)]), 41);
    assert_eq!(with(vec![scan(161), scan(5)]), 54 + 5);
    assert_eq!(p.candidates.len(), entries);
}

#[test]
fn the_geometry_alone_is_fitted_with_its_prior() {
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    p.geometry_offset.fill(0.3);
    p.geometry_precision.fill(2.0);
    let n = p.geometry.ncols();
    // Least squares of the rows below those of the data: sqrt(2) (delta + 0.3) = 0.
    let mut x = DMatrix::zeros(p.rows() + n, n);
    x.rows_mut(0, p.rows()).copy_from(&p.geometry);
    let mut y = DVector::zeros(p.rows() + n);
    y.rows_mut(0, p.rows()).copy_from(&p.residual);
    for k in 0..n {
        x[(p.rows() + k, k)] = 2f64.sqrt();
        y[p.rows() + k] = -0.3 * 2f64.sqrt();
    }
    let expected = x.svd(true, true).solve(&y, 1e-12).unwrap();
    assert!((base_fit(&p) - expected).amax() < 1e-9);
}

#[test]
fn a_room_judges_an_entry_once() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let r = room(&p, &quick());
    let first = r.judge(0, &quick());
    // Another seed would draw other signs: what is known is told again.
    let again = r.judge(0, &DiagnosisConfig { seed: 7, ..quick() });
    assert_eq!(first.significance, again.significance);
}

#[test]
fn an_estimate_is_as_uncertain_as_its_covariance_along_itself() {
    // 4 with variance 4 x 0.25: a quarter of itself.
    let of = |estimate: &[f64], covariance: &[f64]| OneStep {
        estimate: DVector::from_column_slice(estimate),
        covariance: DMatrix::from_diagonal(&DVector::from_column_slice(covariance)),
        absorbed: 0.0,
    };
    assert!((relative_sigma(&of(&[4.0], &[0.25]), 4.0) - 0.25).abs() < 1e-12);
    // Along (3, 4) the variance is (9 x 0.5 + 16 x 2) / 25 = 1.46, times 9; the size is 5.
    let sigma = relative_sigma(&of(&[3.0, 4.0], &[0.5, 2.0]), 9.0);
    assert!((sigma - (9.0f64 * 1.46).sqrt() / 5.0).abs() < 1e-12, "{sigma}");
    // Below zero by more than 1.96 standard deviations of 0.5 x 2.
    let amplitude = |name: &str, never_negative| Amplitude {
        name: name.into(),
        unit: armcal_core::Unit::Radian,
        typical: 1.0,
        never_negative,
    };
    let all = [amplitude("spring", true), amplitude("phase", false)];
    let names = |a: f64, b: f64| impossible(&all, &of(&[a, b], &[0.25, 0.25]), 4.0);
    assert!(names(-1.9, -9.0).is_empty() && names(3.0, -9.0).is_empty());
    assert_eq!(names(-2.0, 0.0), ["spring"]);
}

#[test]
fn what_is_left_is_the_residual_without_its_part() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let weighed = weigh(&p, &quick());
    let white = &weighed.metrics[0].projection;
    assert!((white.variance_without(0.4 * white.rss) - 0.6 * white.rss / white.dof()).abs() < 1e-12);
    assert_eq!(white.variance_without(2.0 * white.rss), 0.0);
}
