//! Differences, weights and groups against sums written out.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::tests::{planted, quick};
use crate::weigh::crossval::{by_place, by_stretch};
use proptest::prelude::*;
use rand_distr::{Distribution, Exp1};
use std::collections::BTreeSet;

pub(crate) fn score(by_group: &[f64]) -> Score {
    Score { by_group: by_group.to_vec() }
}

#[test]
fn a_difference_is_a_sum_and_its_error_that_of_a_sum() {
    // Differences 1, 2, -3, 4: mean 1, squares about it 0 + 1 + 16 + 9 = 26, times 4/3.
    let (a, b) = (score(&[3.0, 2.0, -1.0, 9.0]), score(&[2.0, 0.0, 2.0, 5.0]));
    let d = a.above(&b);
    assert_eq!(d.nats, 4.0);
    assert!((d.se - (26.0f64 * 4.0 / 3.0).sqrt()).abs() < 1e-12, "{}", d.se);
    let back = b.above(&a);
    assert_eq!((back.nats, back.se), (-d.nats, d.se));
    assert_eq!(a.above(&a), Difference { nats: 0.0, se: 0.0 });
    // One group tells no error.
    assert_eq!(score(&[5.0]).above(&score(&[1.0])), Difference { nats: 4.0, se: 0.0 });
}

proptest! {
    #[test]
    fn differences_are_antisymmetric_and_add_up(
        all in prop::collection::vec(prop::array::uniform3(-50.0..50.0f64), 2..16)
    ) {
        let of = |k: usize| score(&all.iter().map(|g| g[k]).collect::<Vec<_>>());
        let (a, b, c) = (of(0), of(1), of(2));
        let (ab, ba) = (a.above(&b), b.above(&a));
        prop_assert!((ab.nats + ba.nats).abs() < 1e-9 && (ab.se - ba.se).abs() < 1e-9);
        prop_assert!((ab.nats + b.above(&c).nats - a.above(&c).nats).abs() < 1e-9);
        prop_assert!(a.above(&c).se <= ab.se + b.above(&c).se + 1e-9);
        prop_assert!(!(ab.is_clear(0.0) && ba.is_clear(0.0)), "both ways");
    }
}

#[test]
fn a_difference_is_clear_beyond_chance_beyond_four_nats_and_beyond_a_detail() {
    let clear = |nats: f64, se: f64, detail: f64| Difference { nats, se }.is_clear(detail);
    assert_eq!([3.9, 4.1].map(|nats| clear(nats, 0.0, 0.0)), [false, true]);
    assert_eq!([23.2, 23.4].map(|nats| clear(nats, 10.0, 0.0)), [false, true]);
    assert_eq!([19.9, 20.1].map(|nats| clear(nats, 1.0, 20.0)), [false, true]);
    assert!(!clear(-1e9, 1.0, 0.0) && !clear(f64::NAN, 1.0, 0.0));
}

#[test]
fn what_an_explanation_costs_is_taken_from_its_score() {
    assert_eq!((score(&[1.0, 2.5]).worth(0.0), score(&[1.0, 2.5]).worth(6.0)), (3.5, -2.5));
}

#[test]
fn weights_are_shares_and_what_is_alike_shares_alike() {
    let config = quick();
    let (a, b) = (score(&[3.0, -2.0, 7.0, 1.0]), score(&[1.0, 4.0, 2.0, 0.0]));
    let all = bootstrap_weights(&[(&a, 3.0), (&b, 3.0), (&a, 3.0), (&b, 6.0)], &config);
    assert!((all.iter().sum::<f64>() - 1.0).abs() < 1e-12 && all.iter().all(|w| (0.0..=1.0).contains(w)));
    assert!((all[0] - all[2]).abs() < 1e-12, "{all:?}");
    assert!((all[1] / all[3] - 3f64.exp()).abs() < 1e-9, "one amplitude more: {all:?}");
    assert_eq!(bootstrap_weights(&[(&a, 27.0)], &config), [1.0]);
    assert!(bootstrap_weights(&[], &config).is_empty());
    // Far behind it is nothing, and no number that is not one.
    let far = bootstrap_weights(&[(&a, 3.0), (&score(&[-1e5; 4]), 3.0)], &config);
    assert!((far[0] - 1.0).abs() < 1e-12 && far[1] < 1e-12, "{far:?}");
}

#[test]
fn weights_do_not_depend_on_the_order_of_explanations() {
    let config = quick();
    let all = [score(&[3.0, -2.0, 7.0]), score(&[1.0, 4.0, 2.0]), score(&[0.0, 5.0, 3.5])];
    let forth = bootstrap_weights(&[(&all[0], 3.0), (&all[1], 6.0), (&all[2], 3.0)], &config);
    let back = bootstrap_weights(&[(&all[2], 3.0), (&all[1], 6.0), (&all[0], 3.0)], &config);
    assert!(forth.iter().zip(back.iter().rev()).all(|(a, b)| (a - b).abs() < 1e-12), "{forth:?} {back:?}");
}

#[test]
fn weights_are_those_of_a_bayesian_bootstrap() {
    let (a, b) = ([2.0, -3.0, 6.0, 0.5, -1.0, 1.0], [0.0, 1.0, 1.0, 0.0, 2.0, 0.5]);
    // Dirichlet(1, .., 1) drawn by itself, and the share of each draw: the logistic of n sum_g w_g d_g - 3.
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let (n, draws) = (a.len() as f64, 40_000);
    let shares: Vec<f64> = (0..draws)
        .map(|_| {
            let w: Vec<f64> = (0..a.len()).map(|_| Exp1.sample(&mut rng)).collect();
            let mean = (0..a.len()).map(|g| w[g] * (a[g] - b[g])).sum::<f64>() / w.iter().sum::<f64>();
            1.0 / (1.0 + (3.0 - n * mean).exp())
        })
        .collect();
    let mean = shares.iter().sum::<f64>() / f64::from(draws);
    let variance = shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / f64::from(draws);
    let config = DiagnosisConfig { resamplings: 20_000, ..quick() };
    let found = bootstrap_weights(&[(&score(&a), 6.0), (&score(&b), 3.0)], &config)[0];
    let error = (variance / 20_000.0 + variance / f64::from(draws)).sqrt();
    assert!((found - mean).abs() < 4.0 * error, "{found} {mean} +- {error}");
    assert!((0.1..0.9).contains(&mean) && variance > 0.05, "{mean} {variance}");
}

/// Every dwell in one group, and no more than sixteen of these.
fn assert_partition(exam: &Exam, dwells: usize) {
    let mut all: Vec<usize> = exam.groups.iter().flatten().copied().collect();
    all.sort_unstable();
    assert_eq!(all, (0..dwells).collect::<Vec<_>>());
    assert!(exam.groups.len() <= GROUPS && exam.groups.iter().all(|g| !g.is_empty()));
    // Folds stay whole.
    let group_of = |i: usize| exam.groups.iter().position(|g| g.contains(&i));
    let whole = |fold: &Group| fold.scored.iter().all(|i| group_of(*i) == group_of(fold.scored[0]));
    assert!(exam.folds.iter().all(whole));
}

#[test]
fn every_dwell_is_in_one_group_by_pose_and_by_time() {
    for free in [0, 60] {
        let p = planted(&[], free, 2);
        for exam in [Exam::by_pose(&p, by_place(&p)), Exam::by_time(&p, by_stretch(&p))] {
            assert_partition(&exam, p.dwells.len());
            assert_eq!(exam.groups.len(), GROUPS);
        }
    }
    let few = planted(&[], 0, 2);
    let few = few.without(&few.dwells.iter().map(|d| d.place.as_deref() < Some("c05")).collect::<Vec<_>>());
    let exam = Exam::by_pose(&few, by_place(&few));
    assert_partition(&exam, few.dwells.len());
    assert_eq!(exam.groups.len(), exam.folds.len().min(GROUPS), "no more groups than folds");
}

#[test]
fn groups_by_time_are_stretches_that_follow_each_other() {
    let p = planted(&[], 0, 2);
    let exam = Exam::by_time(&p, by_stretch(&p));
    let mut spans: Vec<[f64; 2]> = (exam.groups.iter())
        .map(|g| {
            let times = || g.iter().map(|i| p.dwells[*i].time_s);
            [times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max)]
        })
        .collect();
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert!(spans.windows(2).all(|w| w[0][1] < w[1][0]), "{spans:?}");
}

/// Groups as sets of what the dwells are called.
fn named(exam: &Exam, name: impl Fn(usize) -> usize) -> BTreeSet<BTreeSet<usize>> {
    exam.groups.iter().map(|g| g.iter().map(|i| name(*i)).collect()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn the_order_of_dwells_makes_no_other_groups(order in Just((0..258usize).collect::<Vec<_>>()).prop_shuffle()) {
        let p = planted(&[], 60, 2);
        let mut permuted = p.clone();
        permuted.dwells = order.iter().map(|i| p.dwells[*i].clone()).collect();
        let before = Exam::by_pose(&p, by_place(&p));
        let after = Exam::by_pose(&permuted, by_place(&permuted));
        assert_partition(&after, 258);
        prop_assert_eq!(named(&before, |i| i), named(&after, |i| order[i]));
    }
}

#[test]
fn a_part_is_halved_along_its_longest_side_wherever_it_lies() {
    // Short where its numbers are large, long where they are small.
    let centres: Vec<Vec<f64>> = [0.0, 3.0, 1.0, 2.0].iter().map(|x| vec![100.0 - x / 10.0, *x]).collect();
    assert_eq!(halves(&[0, 1, 2, 3], &centres), [vec![0, 2], vec![3, 1]]);
    let along_the_first: Vec<Vec<f64>> = [0.0, 3.0, 1.0, 2.0].iter().map(|x| vec![-x, 50.0]).collect();
    assert_eq!(halves(&[0, 1, 2, 3], &along_the_first), [vec![1, 3], vec![2, 0]]);
    assert_eq!(halves(&[2], &centres), [vec![2]]);
}
