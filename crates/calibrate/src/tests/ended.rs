//! A fit with something held, from the one without, against fitting it so.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use crate::tests::linear::random_problem;
use crate::{FitConfig, Objective, fitted_values};

#[test]
fn of_a_linear_problem_the_others_end_where_a_fit_of_them_alone_does() {
    let config = FitConfig { objective: Objective::LeastSquares, ..FitConfig::default() };
    for seed in 0..20 {
        let mut problem = random_problem(seed);
        let all = fitted_values(&problem, &[0.0; 4], None, &config).unwrap();
        let derived = all.with_held(&[(1, 0.0), (3, 0.1)]).unwrap();
        for (held, value) in [(1, 0.0), (3, 0.1)] {
            problem.parameters[held].free = false;
            problem.parameters[held].nominal = value;
        }
        let anew = fitted_values(&problem, &[0.0, 0.0, 0.0, 0.1], None, &config).unwrap();
        let moved = (all.values[0] - anew.values[0]).abs();
        for (derived, anew) in derived.iter().zip(&anew.values) {
            assert!((derived - anew).abs() < 1e-9, "seed {seed}: {derived} and {anew}");
        }
        assert!(moved > 1e-4, "seed {seed}: holding something made no difference");
    }
}

#[test]
fn what_is_held_beyond_a_bound_takes_the_others_no_further_than_theirs() {
    let config = FitConfig { objective: Objective::LeastSquares, ..FitConfig::default() };
    let problem = random_problem(7);
    let all = fitted_values(&problem, &[0.0; 4], None, &config).unwrap();
    let far = all.with_held(&[(1, 1e6)]).unwrap();
    let within = |(value, p): (&f64, &armcal_core::Parameter)| *value >= p.lower && *value <= p.upper;
    assert!([0, 2, 3].iter().all(|k| within((&far[*k], &problem.parameters[*k]))), "{far:?}");
    assert_eq!(far[1], 1e6);
}
