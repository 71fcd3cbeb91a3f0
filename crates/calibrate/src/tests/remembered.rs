//! Is what is remembered what the problem says?

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::{Remembered, evaluate_problem};
use crate::FitConfig;
use crate::objective::problem::{Linearised, Problem};
use armcal_core::{Parameter, Role, Unit};
use nalgebra::{DMatrix, DVector};
use std::sync::atomic::{AtomicUsize, Ordering};

/// `r_k = sin((block + 1) p_k)` for two parameters; counts what it is asked.
struct Counted {
    parameters: Vec<Parameter>,
    evaluations: AtomicUsize,
    covariances: AtomicUsize,
}

impl Counted {
    fn new() -> Counted {
        let parameter =
            |k: usize| Parameter::fixed(format!("p{k}"), Unit::Metre, 0.0, Role::Effect, String::new());
        let parameters = (0..2).map(|k| Parameter { free: true, ..parameter(k) }).collect();
        Counted { parameters, evaluations: AtomicUsize::new(0), covariances: AtomicUsize::new(0) }
    }

    fn asked(&self) -> [usize; 2] {
        [&self.evaluations, &self.covariances].map(|count| count.load(Ordering::Relaxed))
    }
}

impl Problem for Counted {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn blocks(&self) -> usize {
        4
    }

    fn name(&self, block: usize) -> String {
        format!("block {block}")
    }

    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        DVector::from_fn(2, |k, _| ((block + 1) as f64 * p[k]).sin())
    }

    fn linearised(&self, block: usize, p: &[f64]) -> Linearised {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        let slope = |k: usize| (block + 1) as f64 * ((block + 1) as f64 * p[k]).cos();
        (self.residual(block, p), DMatrix::from_diagonal(&DVector::from_vec(vec![slope(0), slope(1)])))
    }

    fn covariance(&self, _block: usize, p: &[f64]) -> DMatrix<f64> {
        self.covariances.fetch_add(1, Ordering::Relaxed);
        DMatrix::identity(2, 2) * (1.0 + p[0] * p[0])
    }
}

fn told(
    problem: &dyn Problem,
    p: &[f64],
    asked: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<(usize, Linearised)> {
    let mut all = Vec::new();
    problem.linearised_each(0..problem.blocks(), p, asked, &mut |block, own| {
        all.push((block, own.into_owned()));
    });
    all
}

#[test]
fn the_same_parameters_are_evaluated_once_and_others_again() {
    let problem = Counted::new();
    let remembered = Remembered::new(&problem, None);
    for (p, evaluations) in [([0.1, 0.2], 4), ([0.1, 0.2], 4), ([0.1, 0.3], 8), ([0.1, 0.2], 12)] {
        let all = told(&remembered, &p, &|_| true);
        assert_eq!(problem.asked()[0], evaluations);
        let exact: Vec<(usize, Linearised)> = (0..4).map(|b| (b, Counted::new().linearised(b, &p))).collect();
        assert_eq!(all, exact);
        assert_eq!(remembered.covariance(2, &p), Counted::new().covariance(2, &p));
    }
    assert_eq!(problem.asked()[1], 3, "once at each of three places in turn");
}

#[test]
fn columns_that_nobody_asked_for_are_not_taken_for_known() {
    let problem = Counted::new();
    let remembered = Remembered::new(&problem, None);
    let p = [0.1, 0.2];
    told(&remembered, &p, &|k| k == 0);
    told(&remembered, &p, &|k| k == 0);
    assert_eq!(problem.asked()[0], 4);
    told(&remembered, &p, &|_| true);
    assert_eq!(problem.asked()[0], 8);
}

#[test]
fn a_problem_with_some_of_the_blocks_begins_with_what_is_known_of_these() {
    let problem = Counted::new();
    let p = [0.1, 0.2];
    let known = evaluate_problem(&problem, &p, &|p| p.free, &FitConfig::default()).unwrap();
    assert_eq!(problem.asked(), [4, 4]);
    // The same blocks in another order: what they say is what is remembered, not what the problem itself would say.
    let fewer = Remembered::new(&problem, Some(known.of(&[3, 0, 1, 2])));
    let all = told(&fewer, &p, &|_| true);
    assert_eq!(problem.asked(), [4, 4]);
    assert_eq!(all[0].1, Counted::new().linearised(3, &p));
    // Of other blocks than there are, nothing is taken.
    let other = Remembered::new(&problem, Some(known.of(&[0, 1])));
    assert_eq!(told(&other, &p, &|_| true)[3].1, Counted::new().linearised(3, &p));
    assert_eq!(problem.asked()[0], 8);
}
