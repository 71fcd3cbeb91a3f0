//! The density against Student's own, and what the size of the noise may depend on.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::crossval::{by_place, left_out};
use crate::tests::arm::{SIGMA_M, overconfident, rng};
use crate::tests::{own, planted};
use nalgebra::{Matrix3, Matrix3xX, Rotation3, Vector3};
use rand_distr::{Distribution, StandardNormal};
use statrs::distribution::{Continuous, StudentsT};

/// Ratio of two neighbours on the path of sizes.
const STEP: f64 = 1.26;

/// A problem of which the dwells alone are asked, in sixteen groups.
fn dwells() -> (Problem, Vec<Vec<usize>>) {
    let p = planted(&[], 0, 1);
    let groups = (0..16).map(|g| (0..p.dwells.len()).filter(|i| i % 16 == g).collect()).collect();
    (p, groups)
}

/// Errors of so many declared standard deviations, drawn.
fn gaussian(p: &Problem, sigma: f64, seed: u64) -> DVector<f64> {
    let mut r = rng(seed);
    DVector::from_fn(p.rows(), |_, _| {
        let z: f64 = StandardNormal.sample(&mut r);
        sigma * z
    })
}

/// Standard deviation per axis that a size gives to points declared with this one.
fn sigma_m(size: &Size, declared_m: f64) -> f64 {
    (size.declared * declared_m).hypot(size.beside_m)
}

#[test]
fn errors_have_students_density_and_it_is_one_in_all() {
    let size = Size { declared: 0.5, beside_m: 3e-4 };
    let declared_m2 = 4e-8;
    let scale_m = sigma_m(&size, 2e-4);
    let student = StudentsT::new(0.0, scale_m, 5.0).unwrap();
    let ln = |error_m: f64| ln_density(&[vec![(error_m, declared_m2)]], size);
    for error_m in [0.0, 1e-4, -1e-4, 2e-3, -0.5] {
        assert!((ln(error_m) - student.ln_pdf(error_m)).abs() < 1e-8, "{error_m}");
    }
    let step_m = scale_m / 50.0;
    let total: f64 = (-20_000..=20_000).map(|k| ln(f64::from(k) * step_m).exp() * step_m).sum();
    assert!((total - 1.0).abs() < 1e-6, "{total}");
    // Axes and points are independent.
    let several = [vec![(1e-4, declared_m2), (2e-3, declared_m2)], vec![(-0.5, declared_m2)]];
    assert!((ln_density(&several, size) - ln(1e-4) - ln(2e-3) - ln(-0.5)).abs() < 1e-9);
}

#[test]
fn the_size_is_that_of_the_errors_whatever_is_declared() {
    let (p, groups) = dwells();
    let errors = gaussian(&p, 1.0, 3);
    // Heavy tails take part of a Gaussian's width: their best scale is 0.86 of it.
    let best = |declared: f64| {
        let p = overconfident(p.clone(), 1.0 / declared);
        let kind = Kind::of(&p, &(&errors / declared), &groups, false).unwrap();
        let at = kind.sizes_by_others();
        assert!(at.iter().all(|k| *k == at[0]), "198 dwells agree");
        sigma_m(&kind.sizes[at[0]], declared * SIGMA_M) / SIGMA_M
    };
    for declared in [0.03, 0.1, 1.0, 10.0, 25.0] {
        let found = best(declared);
        assert!((1.0 / STEP..STEP).contains(&(found / 0.86)), "declared {declared} times: {found}");
    }
}

#[test]
fn a_group_is_judged_by_the_size_of_the_others() {
    let (p, groups) = dwells();
    let sound = gaussian(&p, 1.0, 4);
    let mut wild = sound.clone();
    for row in groups[0].iter().flat_map(|i| p.dwells[*i].range()) {
        wild[row] *= 1000.0;
    }
    let of = |rows: &DVector<f64>| Kind::of(&p, rows, &groups, false).unwrap();
    let (before, after) = (of(&sound), of(&wild));
    let [at, now] = [&before, &after].map(Kind::sizes_by_others);
    assert_eq!(at[0], now[0], "its own errors say nothing of its size");
    assert!((1..16).all(|g| now[g] > at[g]), "it says something of theirs: {at:?} {now:?}");
    let errors = groups[0].iter().map(|i| axes(&p.dwells[*i].parts[0], &wild.rows(3 * i, 3).into_owned()));
    let by_hand = ln_density(&errors.collect::<Vec<_>>(), before.sizes[at[0]]);
    assert!((ln_by_group(&p, &wild, &groups)[0] - by_hand).abs() < 1e-9);
}

#[test]
fn tracked_and_seated_points_have_sizes_of_their_own() {
    let (mut p, groups) = dwells();
    let mut rows = gaussian(&p, 1.0, 5);
    for d in p.dwells.iter_mut().step_by(3) {
        d.parts[0].tracked = true;
        rows.rows_mut(d.first_row, 3).scale_mut(30.0);
    }
    let sigma = |tracked: bool| {
        let kind = Kind::of(&p, &rows, &groups, tracked).unwrap();
        sigma_m(&kind.sizes[kind.sizes_by_others()[0]], SIGMA_M) / SIGMA_M
    };
    assert!((1.0 / STEP..STEP).contains(&(sigma(false) / 0.86)), "{}", sigma(false));
    assert!((1.0 / STEP..STEP).contains(&(sigma(true) / (30.0 * 0.86))), "{}", sigma(true));
    let sum = ln_by_group(&p, &rows, &groups).iter().sum::<f64>();
    p.dwells.iter_mut().for_each(|d| d.parts[0].tracked = true);
    assert!(ln_by_group(&p, &rows, &groups).iter().sum::<f64>() < sum - 50.0, "one size for both says less");
}

/// The same errors and covariances seen in a world that is turned.
fn turned(mut p: Problem, by: &Rotation3<f64>) -> Problem {
    p.dwells.iter_mut().flat_map(|d| &mut d.parts).for_each(|part| {
        part.metres = Matrix3xX::from_columns(&part.metres.column_iter().map(|c| by * c).collect::<Vec<_>>());
    });
    p
}

fn by() -> Rotation3<f64> {
    Rotation3::from_euler_angles(0.7, -1.1, 2.3)
}

#[test]
fn the_axes_of_the_world_do_not_matter_where_the_covariance_has_its_own() {
    let (mut p, groups) = dwells();
    let shape = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 0.3));
    p.dwells.iter_mut().flat_map(|d| &mut d.parts).for_each(|part| part.metres = shape * &part.metres);
    let rows = gaussian(&p, 3.0, 6);
    let before = ln_by_group(&p, &rows, &groups);
    let after = ln_by_group(&turned(p.clone(), &by()), &rows, &groups);
    assert!(before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-6), "{before:?} {after:?}");
}

#[test]
fn the_axes_of_the_world_do_not_matter_where_the_covariance_is_alike_in_all() {
    let p = planted(&[("backlash:1", 1.0)], 0, 3);
    let groups = by_place(&p).into_iter().map(|g| g.scored).collect::<Vec<_>>();
    let effect = own(&p, "backlash:1").columns.dense(&p.dwells, 1.0);
    let score = |p: &Problem| {
        let rows = [None, Some(&effect)].map(|e| left_out(p, e, &by_place(p), 1.0));
        rows.map(|rows| ln_by_group(p, &rows, &groups).iter().sum::<f64>())
    };
    let ([nothing, play], [nothing_turned, play_turned]) = (score(&p), score(&turned(p.clone(), &by())));
    assert!((nothing - nothing_turned).abs() < 0.1, "{nothing} {nothing_turned}");
    assert!((play - play_turned).abs() < 0.1, "{play} {play_turned}");
}

#[test]
fn declared_noise_says_little_of_which_explanation_is_better_where_errors_are_beyond_it() {
    let p = planted(&[("backlash:1", 1.0), ("zero_drift:2", 1.0)], 0, 3);
    let folds = by_place(&p);
    let groups = folds.iter().map(|g| g.scored.clone()).collect::<Vec<_>>();
    let with = |spec: &str| left_out(&p, Some(&own(&p, spec).columns.dense(&p.dwells, 1.0)), &folds, 1.0);
    let [play, drift] = ["backlash:1", "zero_drift:2"].map(with);
    let apart = |smaller: f64| {
        let p = overconfident(p.clone(), smaller);
        let score = |rows: &DVector<f64>| ln_by_group(&p, &(rows * smaller), &groups).iter().sum::<f64>();
        score(&play) - score(&drift)
    };
    let as_it_is = apart(3.0);
    assert!(as_it_is.abs() > 30.0, "{as_it_is}");
    for smaller in [10.0, 30.0, 300.0] {
        let found = apart(smaller);
        assert!((found - as_it_is).abs() < 0.03 * as_it_is.abs() + 1.0, "{smaller}: {found} {as_it_is}");
    }
}

#[test]
fn a_direction_that_was_not_measured_says_nothing() {
    let (mut p, groups) = dwells();
    let rows = gaussian(&p, 1.0, 7);
    let flat = Matrix3xX::from_columns(&[Vector3::x() * SIGMA_M, Vector3::y() * SIGMA_M, Vector3::zeros()]);
    p.dwells.iter_mut().flat_map(|d| &mut d.parts).for_each(|part| part.metres = flat.clone());
    let seen = ln_by_group(&p, &rows, &groups);
    let mut else_there = rows.clone();
    (0..p.dwells.len()).for_each(|i| else_there[3 * i + 2] = 1e6);
    assert_eq!(seen, ln_by_group(&p, &else_there, &groups));
    assert_eq!(axes(&p.dwells[0].parts[0], &rows.rows(0, 3).into_owned()).len(), 2);
    assert!(Kind::of(&p, &rows, &groups, true).is_none(), "nothing is tracked");
}
