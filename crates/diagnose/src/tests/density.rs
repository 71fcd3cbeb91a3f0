//! The density against Student's own, and what the size of the noise may depend on.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::tests::arm::{SIGMA_M, overconfident, rng};
use crate::tests::{own, planted};
use crate::weigh::crossval::{by_place, left_out};
use nalgebra::{Matrix3, Matrix3xX, Rotation3, Vector3};
use rand_distr::{Distribution, StandardNormal};
use statrs::distribution::{Continuous, StudentsT};
use statrs::function::gamma::ln_gamma;
use std::f64::consts::PI;

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
    // Points are independent, axes of one are not: one length of the errors, in units of the noise, tells all of them.
    let far = [(1e-4, declared_m2), (2e-3, declared_m2)];
    let several = [far.to_vec(), vec![(-0.5, declared_m2)]];
    assert!((ln_density(&several, size) - ln_density(&[far.to_vec()], size) - ln(-0.5)).abs() < 1e-9);
    let turned = vec![(1e-4f64.hypot(2e-3), declared_m2), (0.0, declared_m2)];
    assert!((ln_density(&[far.to_vec()], size) - ln_density(&[turned], size)).abs() < 1e-9);
    let off = ln_density(&[vec![(2e-3, declared_m2); 2]], size);
    assert!(off > 2.0 * ln(2e-3) + 3.0, "a point that is off is one accident: {off} {}", ln(2e-3));
}

#[test]
fn several_axes_have_the_multivariate_density_and_it_is_one_in_all() {
    let size = Size { declared: 1.0, beside_m: 0.0 };
    let variances = [1.0, 0.25, 9.0];
    for d in 1..=3 {
        let scales = &variances[..d];
        let dim = d as f64;
        let ln = |radius: f64| {
            let along = |v: &f64| (radius * (v / dim).sqrt(), *v);
            ln_density(&[scales.iter().map(along).collect()], size)
        };
        let ln_det = scales.iter().map(|v| v.ln()).sum::<f64>();
        let at_0 = ln_gamma(0.5 * (5.0 + dim)) - ln_gamma(2.5) - 0.5 * dim * (5.0 * PI).ln() - 0.5 * ln_det;
        for radius in [0.0, 0.3, 1.0, 7.0, 400.0f64] {
            let by_hand = at_0 - 0.5 * (5.0 + dim) * (radius.powi(2) / 5.0).ln_1p();
            assert!((ln(radius) - by_hand).abs() < 1e-9, "{d} axes, {radius}");
        }
        // Over shells of the whitened space, of which the surface of the unit one is 2 pi^(d/2) / G(d/2).
        let (step, unit) = (0.01, 2.0 * PI.powf(0.5 * dim) / ln_gamma(0.5 * dim).exp());
        let shell = |k: i32| {
            let radius = (f64::from(k) + 0.5) * step;
            unit * radius.powf(dim - 1.0) * (ln(radius) + 0.5 * ln_det).exp() * step
        };
        let total: f64 = (0..40_000).map(shell).sum();
        assert!((total - 1.0).abs() < 1e-5, "{d} axes: {total}");
    }
}

/// The scale of a Student's t that says most of Gaussian errors along `d` axes, in units of their standard deviation: heavy tails
/// take part of their width. It solves `E[(5 + d) r^2 / (5 s^2 + r^2)] = d`, the length r that of d standard normal numbers.
fn of_gaussian(d: i32) -> f64 {
    let step = 1e-3;
    let lengths = || (0..12_000).map(|k| (f64::from(k) + 0.5) * step);
    let weight = |r: f64| r.powi(d - 1) * (-0.5 * r * r).exp();
    let total: f64 = lengths().map(weight).sum();
    let dim = f64::from(d);
    let mean = |s: f64| {
        lengths().map(|r| weight(r) * (5.0 + dim) * r * r / (5.0 * s * s + r * r)).sum::<f64>() / total
    };
    let (mut low, mut high) = (0.5, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        *(if mean(middle) > dim { &mut low } else { &mut high }) = middle;
    }
    low
}

#[test]
fn the_size_is_that_of_the_errors_whatever_is_declared() {
    let (p, groups) = dwells();
    let errors = gaussian(&p, 1.0, 3);
    let width = of_gaussian(3);
    assert!((width - 0.8855).abs() < 1e-4 && (of_gaussian(1) - 0.8566).abs() < 1e-4, "{width}");
    let found = |declared: f64| -> Vec<f64> {
        let p = overconfident(p.clone(), 1.0 / declared);
        let kind = Kind::of(&p, &(&errors / declared), &groups, false).unwrap();
        let at = kind.sizes_by_others();
        at.iter().map(|k| sigma_m(&kind.sizes[*k], declared * SIGMA_M) / SIGMA_M).collect()
    };
    for declared in [0.03, 0.1, 1.0, 10.0, 25.0] {
        // The best size is known to a few hundredths: of the path, it is one of the two beside it.
        let found = found(declared);
        let near = |size: &f64| (1.0 / STEP..STEP).contains(&(size / width));
        assert!(found.iter().all(near), "declared {declared} times: {found:?}");
        let ends = [f64::min, f64::max].map(|of| found.iter().copied().reduce(of).unwrap());
        assert!(ends[1] / ends[0] < 1.01 * STEP, "all but one group agree to a step: {ends:?}");
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
    let errors = groups[0]
        .iter()
        .map(|i| principal_axis_errors(&p.dwells[*i].parts[0], &wild.rows(3 * i, 3).into_owned()));
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
    let width = of_gaussian(3);
    assert!((1.0 / STEP..STEP).contains(&(sigma(false) / width)), "{}", sigma(false));
    assert!((1.0 / STEP..STEP).contains(&(sigma(true) / (30.0 * width))), "{}", sigma(true));
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
    // The path ends at a thousand times what is declared: up to there the errors of the drift are on it.
    let on_the_path = |smaller: f64| {
        let p = overconfident(p.clone(), smaller);
        let kind = Kind::of(&p, &(&drift * smaller), &groups, false).unwrap();
        kind.sizes_by_others().iter().all(|k| k + 1 < kind.sizes.len())
    };
    assert!(on_the_path(100.0) && !on_the_path(300.0));
    for smaller in [10.0, 30.0, 100.0] {
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
    assert_eq!(principal_axis_errors(&p.dwells[0].parts[0], &rows.rows(0, 3).into_owned()).len(), 2);
    assert!(Kind::of(&p, &rows, &groups, true).is_none(), "nothing is tracked");
}
