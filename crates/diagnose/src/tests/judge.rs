//! When a name may be told, against the rules written out and planted effects.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::judge::judged::Grade;
use crate::judge::score::Difference;
use crate::tests::{conditioned, entry, outside, own, planted, quick, scatter};
use crate::weigh::scatter::Correlation;
use crate::weigh::weigh;

use armcal_core::DwellId;
use nalgebra::{DMatrix, DVector};
use std::rc::Rc;

/// A planted play in a conditioned problem of its own.
fn play() -> (Problem, ConditionedProblem) {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let conditioned = Rc::try_unwrap(conditioned(&p, &quick())).expect("nobody else has the room");
    (p, conditioned)
}

/// The same, judged.
fn judged() -> (Problem, ConditionedProblem, Judged) {
    let (p, conditioned) = play();
    let judged = conditioned.judge(entry(&conditioned.weighed, "backlash:1"), &quick());
    (p, conditioned, judged)
}

#[test]
fn a_planted_play_is_judged_as_what_it_is() {
    let (p, conditioned, j) = judged();
    assert_eq!(j.grade(&quick()), Grade::Named);
    assert!(j.own().p_adjusted <= 0.01 && j.unlisted.as_ref().unwrap().above.nats < 0.0);
    assert!(j.places.after < 0.7 * j.places.before && j.places.p < 0.01);
    assert_eq!((j.places.groups, j.recordings.unwrap().groups), (33, 3));
    assert!(j.contrast.as_ref().unwrap().agrees);
    let columns = own(&p, "backlash:1").columns.dense(&p.dwells, 1.0);
    let own = conditioned.weighed.base.gram(&columns);
    assert!((&j.gram.a - own.a).amax() < 1e-9 && (&j.gram.g - own.g).amax() < 1e-9);
    assert_eq!(j.significance.len(), conditioned.weighed.entries.len());
    assert_eq!(j.gain, conditioned.score_with(&columns).above(conditioned.nothing()));
    assert!(j.gain.is_clear(100.0), "{:?}", j.gain);
}

#[test]
fn one_recording_has_no_recordings_to_leave_out() {
    let mut p = planted(&[("backlash:1", 1.0)], 0, 3);
    p = p.without(&p.dwells.iter().map(|d| d.id.recording == 0).collect::<Vec<_>>());
    assert!(conditioned(&p, &quick()).judge(0, &quick()).recordings.is_none());
}

#[test]
fn what_is_real_needs_score_gate_and_left_out_errors() {
    let (_, _, mut j) = judged();
    let config = quick();
    j.cost_nats = 3.0;
    let mut with = |[nats, se]: [f64; 2], p_adjusted: f64, p_raw: f64, places_p: f64| {
        j.gain = Difference { nats, se };
        let own = j.entry;
        j.significance[own].p_adjusted = p_adjusted;
        j.significance[own].p_raw = p_raw;
        j.places.p = places_p;
        (j.real(&config), j.promising(&config))
    };
    assert_eq!(with([4.1, 1.0], 0.01, 0.05, 0.049), (true, true));
    assert_eq!(with([2.9, 1.0], 0.01, 0.05, 0.009), (false, false), "less than it costs");
    assert_eq!(with([4.1, 1.0], 0.02, 0.05, 0.049), (false, true));
    assert_eq!(with([4.1, 1.0], 0.01, 0.06, 0.049), (true, false));
    assert_eq!(with([4.1, 1.0], 0.01, 0.05, 0.05), (false, false));
    // Not clear over the groups: then places must agree beyond doubt.
    assert_eq!(with([5.0, 3.0], 0.01, 0.05, 0.011), (false, false));
    assert_eq!(with([5.0, 3.0], 0.01, 0.05, 0.01), (true, true));
    assert_eq!(with([5.0, 5.1], 0.01, 0.05, 0.001), (false, false), "no more than its standard error");
    j.cost_nats = 8.0;
    let mut real = |nats: f64| {
        (j.gain.nats, j.places.p, j.significance[j.entry].p_adjusted) = (nats, 0.01, 0.01);
        j.real(&config)
    };
    assert!(!real(7.9) && real(8.0), "it must gain what it costs");
}

#[test]
fn what_is_judged_must_gain_the_margin_for_each_amplitude() {
    let (_, conditioned, j) = judged();
    assert_eq!((j.cost_nats, conditioned.weighed.amplitudes(j.entry)), (quick().margin_nats, 1));
}

#[test]
fn a_name_needs_what_is_real_and_listed_and_beats_the_rest() {
    let (_, _, j) = judged();
    let config = quick();
    let with = |change: &dyn Fn(&mut Judged)| {
        let mut changed = j.clone();
        changed.gain = Difference { nats: 1000.0, se: 10.0 };
        change(&mut changed);
        changed.grade(&config)
    };
    assert_eq!(with(&|_| ()), Grade::Named);
    assert_eq!(with(&|j| j.unlisted = None), Grade::Named);
    let beside = |nats: f64, se: f64, cosine: f64| {
        with(&|j| {
            let unlisted = j.unlisted.as_mut().unwrap();
            (unlisted.above, unlisted.cosine) = (Difference { nats, se }, cosine);
        })
    };
    assert_eq!(beside(-0.1, 0.0, 0.5), Grade::Named);
    // A hundredth of 1000 nats is the detail of a shape; beyond that and beyond 2.33 standard errors it is clearly better.
    assert_eq!([0.1, 9.9, 10.1].map(|nats| beside(nats, 1.0, 0.5)), {
        [Grade::OrUnlisted, Grade::OrUnlisted, Grade::Refused]
    });
    assert_eq!([46.5, 46.7].map(|nats| beside(nats, 20.0, 0.5)), [Grade::OrUnlisted, Grade::Refused]);
    assert_eq!(beside(900.0, 1.0, 0.981), Grade::Named, "the shape of the name itself");
    assert_eq!(with(&|j| j.places.p = 0.5), Grade::Refused);
    assert_eq!(with(&|j| j.contrast = None), Grade::Named);
    assert_eq!(with(&|j| j.impossible = vec!["compliance".into()]), Grade::OrUnlisted);
    assert_eq!(with(&|j| j.contrast.as_mut().unwrap().agrees = false), Grade::OrUnlisted);
}

#[test]
fn dwells_keep_their_sign_together_as_the_noise_repeats() {
    let p = planted(&[], 0, 1);
    let plain = scatter(1.0, 0.0);
    // 198 dwells of 33 cavities, visited twice in each of three recordings of 66.
    assert_eq!(clusters(&p, &plain).len(), 198);
    let places = clusters(&p, &scatter(1.0, 0.5));
    assert_eq!((places.len(), places[0].len()), (33, 6));
    let alike = Some(Correlation { value: 0.5, p: 1e-9, pairs: 90 });
    for tracked in [true, false] {
        let mut s = scatter(1.0, 0.5);
        *(if tracked { &mut s.tracked_neighbours } else { &mut s.seated_neighbours }) = alike;
        let blocks = clusters(&p, &s);
        assert_eq!((blocks.len(), &blocks[0][..], blocks[8].len()), (27, &[0, 1, 2, 3, 4, 5, 6, 7][..], 2));
    }
}

/// Errors like those before them.
fn remembering() -> Scatter {
    Scatter { tracked_neighbours: Some(Correlation { value: 0.5, p: 1e-9, pairs: 90 }), ..scatter(1.0, 0.0) }
}

#[test]
fn too_few_clusters_are_dwells_by_themselves() {
    let p = planted(&[], 0, 1);
    let of = |dwells: usize| {
        let mut p = p.without(&(0..198).map(|i| i < dwells).collect::<Vec<_>>());
        p.dwells.iter_mut().enumerate().for_each(|(i, d)| d.id = DwellId { recording: 0, dwell: i });
        clusters(&p, &remembering()).len()
    };
    assert_eq!((of(96), of(88)), (12, 88), "eleven blocks of eight are too few");
}

#[test]
fn stretches_are_left_out_where_errors_are_like_those_before_them() {
    let p = planted(&[], 0, 1);
    let fresh = || Rc::try_unwrap(conditioned(&p, &quick())).expect("nobody else has the room");
    assert_eq!(fresh().exam().folds.len(), 33);
    let mut r = fresh();
    r.scatter = remembering();
    assert!(r.exam().folds.iter().any(|g| g.unseen.len() > g.scored.len()));
}

#[test]
fn what_is_not_listed_is_compared_by_its_score_and_known_by_its_shape() {
    let beside = |unlisted: &[(&str, f64)]| {
        let (p, mut conditioned) = play();
        conditioned.weighed.unlisted = unlisted.iter().map(|(s, ln)| outside(&p, s, true, *ln)).collect();
        let judged = conditioned.judge(entry(&conditioned.weighed, "backlash:1"), &quick());
        (judged.grade(&quick()), judged.unlisted.clone(), judged.score)
    };
    assert!(beside(&[]).1.is_none());
    assert!(beside(&[("scale:3", -1.0)]).1.is_none(), "what says less than nothing is not asked");
    let (grade, other, score) = beside(&[("scale:3", 90.0), ("scale:2", 80.0)]);
    let other = other.unwrap();
    assert!(grade == Grade::Named && other.above.nats < -100.0 && other.cosine < 0.5, "{other:?}");
    assert_eq!(other.above, other.score.above(&score));
    // However little the weighing likes it, while it is among the first three.
    let (grade, other, _) = beside(&[("scale:3", 90.0), ("scale:2", 80.0), ("backlash:1", 0.1)]);
    let other = other.unwrap();
    assert!(grade == Grade::Named && other.cosine > 0.999 && other.above.nats.abs() < 5.0, "{other:?}");
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
    // Noise three times as large makes the prior weigh nine times as much.
    let root = 3.0 * 2f64.sqrt();
    for k in 0..n {
        x[(p.rows() + k, k)] = root;
        y[p.rows() + k] = -0.3 * root;
    }
    let expected = x.svd(true, true).solve(&y, 1e-12).unwrap();
    let products = armcal_calibrate::gram(&p.geometry);
    assert!((p.base_fit(&products, 3.0) - expected).amax() < 1e-9);
}

#[test]
fn a_room_judges_an_entry_once() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let r = conditioned(&p, &quick());
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
    let names = |a: f64, b: f64| negative_amplitudes(&all, &of(&[a, b], &[0.25, 0.25]), 4.0);
    assert!(names(-1.9, -9.0).is_empty() && names(3.0, -9.0).is_empty());
    assert_eq!(names(-2.0, 0.0), ["spring"]);
}

#[test]
fn what_is_left_is_the_residual_without_its_part() {
    let weighed = play().1.weighed;
    let white = &weighed.base;
    assert!((white.variance_without(0.4 * white.rss) - 0.6 * white.rss / white.dof()).abs() < 1e-12);
    assert_eq!(white.variance_without(2.0 * white.rss), 0.0);
}
