//! Products that were never put together against the same columns put together.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::*;
use crate::problem::Candidate;
use crate::problem::columns::Cut;
use crate::tests::planted;
use crate::weigh::evidence::project_out_geometry;

/// Columns of every form: a product of a base of two columns, waves, events that begin, end and never act, and dense ones.
pub(crate) fn forms(problem: &Problem) -> Vec<Columns> {
    let (rows, n) = (problem.rows(), problem.dwells.len());
    let base = Arc::new(DMatrix::from_fn(rows, 2, |i, k| ((i + 3 * k) as f64 * 0.7).sin()));
    let basis = Arc::new(DMatrix::from_fn(n, 3, |i, k| ((i * (k + 2)) as f64 * 0.11).cos()));
    let angle_rad = Arc::new((0..n).map(|i| (i as f64 * 0.37).sin()).collect::<Vec<_>>());
    // The order of time is not that of the rows.
    let places = Arc::new((0..n).map(|i| (i * 7) % n).collect::<Vec<_>>());
    assert!(n % 7 != 0, "a permutation");
    let wave = |per_turn| Columns::Wave {
        base: base.clone(),
        angle_rad: angle_rad.clone(),
        per_turn,
        sizes: [0.3, -1.2],
    };
    let within = |on| Columns::Within { base: base.clone(), places: places.clone(), on };
    let dense = Arc::new(DMatrix::from_fn(rows, 2, |i, k| ((i * i + k) as f64).cos()));
    vec![
        Columns::Product { base: base.clone(), basis, size: 0.8 },
        wave(4.0),
        within(5..n),
        Columns::Dense(dense.clone()),
        within(9..31),
        wave(23.5),
        within(0..0),
        within(n - 1..n),
        Columns::Together(vec![wave(3.0), within(0..n), Columns::Dense(dense.clone()), wave(11.0)]),
    ]
}

#[test]
fn products_weigh_as_what_they_stand_for() {
    let mut problem = planted(&[("backlash:1", 1.0)], 0, 3);
    problem.dwells.iter_mut().step_by(3).for_each(|d| {
        d.parts[0].tracked = true;
        d.place = None;
    });
    let forms = forms(&problem);
    let terms: Vec<&Columns> = forms.iter().collect();
    let base = project_out_geometry(&problem, 1.3);
    let mut seen = 0;
    each_gram(&terms, &problem, 1.0 / 1.3, &base, &mut |k, found| {
        let whole = base.gram(&terms[k].dense(&problem.dwells, 1.0 / 1.3));
        let size = whole.raw.max().max(1.0);
        assert!((&found.a - &whole.a).amax() < 1e-10 * size, "term {k}: A");
        assert!((&found.g - &whole.g).amax() < 1e-10 * size, "term {k}: g");
        assert!((&found.raw - &whole.raw).amax() < 1e-10 * size, "term {k}: norms");
        assert!((&found.spent - &whole.spent).amax() < 1e-10 * size, "term {k}: Q'G");
        seen += 1;
    });
    assert_eq!(seen, terms.len(), "each once");
}

#[test]
fn what_is_left_of_products_without_some_dwells_is_what_is_left_of_their_columns() {
    let problem = planted(&[], 0, 4);
    let keep: Vec<bool> = (0..problem.dwells.len()).map(|i| i % 5 != 2).collect();
    let kept: Vec<usize> = (0..keep.len()).filter(|i| keep[*i]).collect();
    let rows: Vec<usize> = kept.iter().flat_map(|i| problem.dwells[*i].range()).collect();
    let fewer = problem.without(&keep);
    let mut cut = crate::problem::columns::Cut::default();
    for columns in forms(&problem) {
        let expected = columns.dense(&problem.dwells, 1.0).select_rows(&rows);
        let found = columns.select(&kept, &rows, &mut cut).dense(&fewer.dwells, 1.0);
        assert_eq!(found, expected);
    }
}

#[test]
fn what_dwells_are_cut_from_is_as_before_and_functions_are_cut_once_for_all_fits() {
    let mut problem = planted(&[("backlash:1", 1.0)], 0, 3);
    let like = problem.candidates[0].clone();
    problem.candidates =
        forms(&problem).into_iter().map(|columns| Candidate { columns, ..like.clone() }).collect();
    let keep: Vec<bool> = (0..problem.dwells.len()).map(|i| i % 5 != 2).collect();
    let rows: Vec<usize> =
        problem.dwells.iter().zip(&keep).filter(|(_, keep)| **keep).flat_map(|(d, _)| d.range()).collect();
    let mut cut = Cut::default();
    let mut bases = Vec::new();
    for _ in 0..2 {
        cut.of_another_fit();
        let kept = problem.cut_to(&keep, &mut cut);
        for (whole, own) in problem.candidates.iter().zip(&kept.candidates) {
            let expected = whole.columns.dense(&problem.dwells, 0.7).select_rows(&rows);
            assert_eq!(own.columns.dense(&kept.dwells, 0.7), expected);
        }
        let Columns::Product { base, basis, .. } = &kept.candidates[0].columns else { panic!("a product") };
        bases.push((base.clone(), basis.clone()));
    }
    assert!(Arc::ptr_eq(&bases[0].1, &bases[1].1), "functions are those of the dwells");
    assert!(!Arc::ptr_eq(&bases[0].0, &bases[1].0), "a base is that of a fit");
}
