//! What may be set aside, against planted accidents and against the covariance written out.

use super::*;
use crate::problem::Candidate;
use crate::tests::arm::{Noise, SIGMA_M, design, overconfident, problem, rng};
use crate::weigh::crossval::left_out;
use nalgebra::{DMatrix, Vector3};
use std::sync::Arc;

fn config() -> DiagnosisConfig {
    DiagnosisConfig { resamplings: 99, ..Default::default() }
}

/// 198 dwells in cavities, noise alone.
fn sound(seed: u64) -> Problem {
    let mut r = rng(seed);
    let poses = design(0, &mut r);
    problem(&poses, &[], Noise::White, &mut r, false)
}

/// Moves a dwell's measured point.
fn push(problem: &mut Problem, dwell: usize, by_m: Vector3<f64>) {
    let mut rows = problem.residual.rows_mut(3 * dwell, 3);
    rows += by_m / SIGMA_M;
}

fn aside(problem: &Problem) -> Vec<usize> {
    let keep = set_aside(problem.clone(), &config()).keep;
    (0..keep.len()).filter(|i| !keep[*i]).collect()
}

/// Directions that do not agree with each other.
fn apart(k: usize) -> Vector3<f64> {
    let a = 2.4 * k as f64;
    Vector3::new(a.cos(), a.sin(), (1.7 * k as f64).sin())
}

#[test]
fn the_square_is_that_of_the_left_out_error_in_its_own_covariance() {
    let mut p = sound(1);
    p.residual[0] += 3.0;
    let alone: Vec<Group> = (0..p.dwells.len()).map(|i| vec![i].into()).collect();
    let left = left_out(&p, None, &alone, 1.0);
    let square = studentised_squares(&p, &left, &left_out(&p, None, &[], 1.0));
    let precision = DMatrix::from_diagonal(&p.geometry_precision);
    for i in [0, 17, 100, 197] {
        let x = p.geometry.rows(3 * i, 3);
        let normal = p.geometry.tr_mul(&p.geometry) + &precision - x.tr_mul(&x);
        let covariance =
            DMatrix::identity(3, 3) + x * normal.try_inverse().expect("it is regular") * x.transpose();
        let e = left.rows(3 * i, 3);
        let expected = e.dot(&(covariance.try_inverse().expect("it is regular") * e));
        assert!((square[i] - expected).abs() < 1e-6 * expected.max(1.0), "{i}: {} {expected}", square[i]);
    }
}

#[test]
fn the_median_of_chi_square_is_that_of_scipy() {
    // scipy.stats.chi2.median
    for (rows, median) in [(3.0, 2.36597), (6.0, 5.34812)] {
        assert!((median_square(rows) / median - 1.0).abs() < 0.01, "{rows}");
    }
}

#[test]
fn an_error_is_suspect_from_the_declared_rarity_on_whatever_the_noise() {
    // scipy: chi2.isf(chi2.sf(25, 1), 3), the square of three coordinates as rare as five sigma of one.
    const RARE: f64 = 31.8;
    for (declared, at) in [(1.0, 20), (2.0, 101)] {
        let (mut below, mut above) = (0, 0);
        for tenths in (40..80).step_by(4) {
            let mut p = sound(3);
            push(&mut p, at, Vector3::new(0.0, 0.0, 0.1 * f64::from(tenths) * SIGMA_M));
            let p = overconfident(p, declared);
            let weighed = weigh(&p, &config());
            let best = weighed.best().filter(|b| b.1 > 0.0).map(|b| weighed.regularised(b.0, &p, &config()));
            let alone: Vec<Group> = (0..p.dwells.len()).map(|i| vec![i].into()).collect();
            let left = left_out(&p, best.as_ref(), &alone, weighed.scale);
            let square = studentised_squares(&p, &left, &left_out(&p, best.as_ref(), &[], weighed.scale));
            let ratio = square[at] * 2.38 / median(&square);
            if (ratio / RARE - 1.0).abs() < 0.03 {
                continue;
            }
            let found = suspects(&p, &weighed, &config()).contains(&at);
            assert_eq!(found, ratio > RARE, "{ratio}");
            if found { above += 1 } else { below += 1 }
        }
        assert!(below > 1 && above > 1, "{below} {above}");
    }
}

#[test]
fn accidents_are_seen_beside_a_large_effect() {
    let mut p = crate::tests::planted(&[("backlash:1", 6.0)], 0, 3);
    let planted = [5, 77, 151];
    planted.iter().enumerate().for_each(|(k, i)| push(&mut p, *i, 3.5e-3 * apart(k).normalize()));
    assert_eq!(aside(&p), planted);
}

#[test]
fn what_a_name_predicts_is_no_accident_though_another_explanation_weighs_more() {
    let few = [5, 40, 77, 120, 151, 190];
    let mut p = sound(2);
    let mut acts = DMatrix::zeros(p.rows(), 1);
    few.iter().enumerate().for_each(|(k, i)| {
        push(&mut p, *i, 6e-3 * apart(k).normalize());
        acts.view_mut((3 * i, 0), (3, 1)).copy_from(&apart(k).normalize());
    });
    let flank = Candidate { columns: Columns::Dense(Arc::new(acts)), ..p.candidates[0].clone() };
    p.candidates.push(Candidate { spec: "flank".to_owned(), ..flank });
    let mut weighed = weigh(&p, &config());
    assert!(suspects(&p, &weighed, &config()).is_empty(), "the best explanation predicts them");
    let mut louder = weighed.unlisted[0].clone();
    louder.ln_evidence = 1e6;
    weighed.unlisted.push(louder);
    assert!(suspects(&p, &weighed, &config()).is_empty(), "and so does the best that has a name");
    weighed.entries.retain(|e| e.candidate.spec != "flank");
    assert_eq!(suspects(&p, &weighed, &config()), few);
}

#[test]
fn accidents_are_set_aside_and_nothing_else() {
    let mut p = sound(2);
    let planted = [5, 40, 77, 120, 151, 190];
    planted.iter().enumerate().for_each(|(k, i)| push(&mut p, *i, 6e-3 * apart(k).normalize()));
    assert_eq!(aside(&p), planted);
    assert!(aside(&sound(3)).is_empty());
}

#[test]
fn dwells_in_a_row_are_an_event_and_stay() {
    let mut p = sound(4);
    (60..64).enumerate().for_each(|(k, i)| push(&mut p, i, 6e-3 * apart(k).normalize()));
    push(&mut p, 120, Vector3::new(0.0, 6e-3, 0.0));
    assert_eq!(aside(&p), [120]);
    // Two neighbours are no run.
    let mut p = sound(5);
    [60, 61].iter().enumerate().for_each(|(k, i)| push(&mut p, *i, 6e-3 * apart(k).normalize()));
    assert_eq!(aside(&p), [60, 61]);
    // Nor are two times two, though both of each err alike.
    let mut p = sound(6);
    let pairs = [20, 21, 100, 101];
    pairs.iter().for_each(|i| push(&mut p, *i, 6e-3 * apart(i / 50).normalize()));
    assert_eq!(aside(&p), pairs);
}

#[test]
fn a_run_ends_with_its_recording() {
    let p = sound(5);
    // Dwells 65 and 66 lie in different recordings of 66 dwells.
    let ends: BTreeSet<usize> = [64, 65, 66, 67].into();
    assert!(in_a_row(&p, &ends).is_empty());
    let run: BTreeSet<usize> = [63, 64, 65, 66, 67, 100].into();
    assert_eq!(in_a_row(&p, &run), [63, 64, 65].into());
    // The order is that of time, whatever the order of the rows.
    let mut turned = p.clone();
    turned.dwells.reverse();
    let last = turned.dwells.len() - 1;
    assert_eq!(
        in_a_row(&turned, &run.iter().map(|i| last - i).collect()),
        [last - 63, last - 64, last - 65].into()
    );
}

#[test]
fn the_share_counts_all_rounds() {
    let p = sound(6);
    let n = p.dwells.len();
    let found = |from: usize, count: usize| (0..count).map(|k| from + 2 * k).collect::<Vec<_>>();
    let none = vec![true; n];
    assert_eq!(plausible_outliers(&p, &none, found(0, 19)).len(), 19);
    assert!(plausible_outliers(&p, &none, found(0, 20)).is_empty(), "20 of 198 are more than a tenth");
    let mut before = none;
    found(1, 10).into_iter().for_each(|i| before[i] = false);
    assert_eq!(plausible_outliers(&p, &before, found(100, 9)).len(), 9);
    assert!(plausible_outliers(&p, &before, found(100, 10)).is_empty());
}

#[test]
fn what_alone_shows_a_cause_is_kept() {
    let base = sound(7);
    let alone = [10, 90, 170];
    let accident = 40;
    let suspects: BTreeSet<usize> = alone.into_iter().chain([accident]).collect();
    let changes: [fn(&mut DwellRow, bool); 4] = [
        |d, moved| d.joint_rad[1] = if moved { 1.0 } else { 0.0 },
        |d, moved| d.arrival[0] = if moved { -1.0 } else { 1.0 },
        |d, moved| d.load_kg = if moved { 2.0 } else { 0.0 },
        |d, moved| d.temperature_c = Some(if moved { 45.0 } else { 20.0 }),
    ];
    for change in changes {
        let mut p = base.clone();
        p.dwells.iter_mut().enumerate().for_each(|(i, d)| change(d, alone.contains(&i)));
        assert_eq!(needed_for_variance(&p, &suspects), alone.into());
        let keep = vec![true; p.dwells.len()];
        assert_eq!(plausible_outliers(&p, &keep, suspects.iter().copied().collect()), [accident]);
    }
    assert!(needed_for_variance(&base, &suspects).is_empty(), "the rest shows it too");
}

#[test]
fn suspects_that_err_alike_beside_each_other_are_a_cause() {
    let p = sound(8);
    let at = |i: usize| 3 * i..3 * i + 3;
    let mut alike = DVector::zeros(p.rows());
    let mut apart_rows = DVector::zeros(p.rows());
    let found = [3, 50, 95, 140];
    for (k, i) in found.iter().enumerate() {
        alike.rows_mut(at(*i).start, 3).copy_from(&Vector3::new(0.0, 0.0, 9.0));
        let sign = if k % 2 == 0 { 9.0 } else { -9.0 };
        apart_rows.rows_mut(at(*i).start, 3).copy_from(&Vector3::new(0.0, 0.0, sign));
    }
    assert!((mean_neighbour_cosine(&p, &alike, &found) - 1.0).abs() < 1e-12);
    assert!(mean_neighbour_cosine(&p, &apart_rows, &found) < MAX_AGREEMENT);
    assert_eq!(mean_neighbour_cosine(&p, &alike, &found[..3]), 0.0, "three are too few to agree");
    // Two poses, each visited twice, err in opposite ways: next to each other they agree.
    let visits = [3, 62, 20, 45];
    let mut by_pose = DVector::zeros(p.rows());
    for (i, z) in visits.into_iter().zip([9.0, 9.0, -9.0, -9.0]) {
        by_pose.rows_mut(at(i).start, 3).copy_from(&Vector3::new(0.0, 0.0, z));
    }
    assert!((mean_neighbour_cosine(&p, &by_pose, &visits) - 1.0).abs() < 1e-12);
}

#[test]
fn a_direction_is_suspect_where_the_other_one_fits_far_better() {
    let mut p = sound(9);
    p.dwells[2].arrival = vec![0.0; 3];
    let n = p.rows();
    let signature = vec![2.0; n];
    // Turned over, the square changes by -4 r s of each row: 48 for three rows of -2.
    let mut residual = vec![2.0; n];
    let mut signature = signature;
    for dwell in [2, 4] {
        residual[3 * dwell..3 * dwell + 3].fill(-2.0);
    }
    residual[9..12].fill(-1.0);
    residual[15..18].fill(-2.0);
    signature[15..18].fill(0.5);
    assert_eq!(
        flipped_arrivals(&p, &residual, &signature),
        [4],
        "24 and 12 are not enough, and dwell 2 has no direction"
    );
}
