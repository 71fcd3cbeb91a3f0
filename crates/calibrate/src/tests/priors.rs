//! Is what is learnt of a prior the textbook's?

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use crate::fit::fit_problem::{Near, fit_near, fit_where_priors};
use crate::fit::priors::scales_of;
use crate::fit_problem;
use crate::objective::problem::{Linearised, Problem};
use crate::{FitConfig, Objective, Scale};
use armcal_core::{Code, Parameter, ParameterKind, Role, Unit};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SIGMA_M: f64 = 1e-4;

/// Each parameter measured by itself, three of them a block.
struct OneEach {
    parameters: Vec<Parameter>,
    measured: Vec<f64>,
}

impl Problem for OneEach {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn blocks(&self) -> usize {
        self.measured.len() / 3
    }

    fn name(&self, block: usize) -> String {
        format!("block {block}")
    }

    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        DVector::from_fn(3, |k, _| self.measured[3 * block + k] - p[3 * block + k])
    }

    fn linearised(&self, block: usize, p: &[f64]) -> Linearised {
        let mut jacobian = DMatrix::zeros(3, p.len());
        (0..3).for_each(|k| jacobian[(k, 3 * block + k)] = -1.0);
        (self.residual(block, p), jacobian)
    }

    fn covariance(&self, _block: usize, _p: &[f64]) -> DMatrix<f64> {
        DMatrix::identity(3, 3) * SIGMA_M.powi(2)
    }
}

fn problem(kinds: &[(ParameterKind, f64)], each: usize, seed: u64) -> OneEach {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut all = OneEach { parameters: Vec::new(), measured: Vec::new() };
    for (kind, spread) in kinds {
        for _ in 0..each {
            let [true_m, noise_m] = [*spread, SIGMA_M].map(|s| s * rng.sample::<f64, _>(StandardNormal));
            all.measured.push(true_m + noise_m);
            all.parameters.push(Parameter {
                name: format!("p{}", all.parameters.len()),
                unit: Unit::Metre,
                nominal: 0.0,
                lower: -5e-3,
                upper: 5e-3,
                prior_sigma: Some(4e-3),
                usual: None,
                assumed: Some(*kind),
                free: true,
                role: Role::Robot,
                meaning: String::new(),
            });
        }
    }
    all
}

fn config() -> FitConfig {
    FitConfig { objective: Objective::LeastSquares, scale: Scale::Declared, ..FitConfig::default() }
}

/// The learnt prior of the parameters of each kind.
fn learnt(problem: &OneEach, config: &FitConfig) -> Vec<f64> {
    let start = vec![0.0; problem.parameters.len()];
    let fit = fit_problem(problem, &start, &|p| p.free, config).unwrap();
    fit.estimates.iter().map(|e| e.parameter.prior_sigma.unwrap()).collect()
}

#[test]
fn the_most_probable_scale_is_the_scatter_beyond_the_noise() {
    // y ~ N(0, s^2 + sigma^2): the maximum of the evidence is at s^2 = mean(y^2) - sigma^2.
    for seed in 0..10 {
        let problem = problem(&[(ParameterKind::Length, 3e-4), (ParameterKind::JointZero, 1.5e-3)], 30, seed);
        let sigma_m = learnt(&problem, &config());
        for (measured, learnt_m) in problem.measured.chunks(30).zip(sigma_m.chunks(30)) {
            let mean_square = measured.iter().map(|y| y * y).sum::<f64>() / 30.0;
            let expected_m = (mean_square - SIGMA_M.powi(2)).sqrt();
            assert!(
                (learnt_m[0] / expected_m - 1.0).abs() < 0.03,
                "seed {seed}: {} {expected_m}",
                learnt_m[0]
            );
            assert!(learnt_m.iter().all(|s| *s == learnt_m[0]));
        }
    }
}

#[test]
fn a_perfect_arm_is_taken_for_one_and_a_bad_one_keeps_the_default() {
    let perfect = learnt(&problem(&[(ParameterKind::Angle, 0.0)], 60, 3), &config());
    assert!(perfect[0] < 0.5 * SIGMA_M, "{}", perfect[0]);
    let mut bad = problem(&[(ParameterKind::Angle, 0.0)], 60, 3);
    bad.measured.iter_mut().enumerate().for_each(|(k, y)| *y += if k % 2 == 0 { 4.9e-3 } else { -4.9e-3 });
    assert_eq!(learnt(&bad, &config())[0], 4e-3);
}

/// A turn of a hold-out begins at the scales of the fit to everything, and ends at its own.
#[test]
fn from_the_scales_of_other_data_a_fit_comes_to_its_own() {
    let all = problem(&[(ParameterKind::Length, 3e-4)], 30, 6);
    let mut own = problem(&[(ParameterKind::Length, 3e-4)], 30, 6);
    own.measured.iter_mut().for_each(|y| *y *= 2.0);
    let fit = fit_problem(&all, &[0.0; 30], &|p| p.free, &config()).unwrap();
    let near = Near {
        values: fit.values(),
        sigma_scale: fit.sigma_scale,
        prior_scales: scales_of(fit.estimates.iter().zip(&all.parameters)),
        looked: None,
    };
    let turn = fit_near(&own, near, &|p| p.free, &config()).unwrap();
    let (found, alone) = (turn.estimates[0].parameter.prior_sigma.unwrap(), learnt(&own, &config())[0]);
    assert!((found / alone - 1.0).abs() < 0.02, "{found} and {alone}");
    assert!(found > 1.5 * fit.estimates[0].parameter.prior_sigma.unwrap());
}

/// Priors that begin between the default ones and those that the data ask for are learnt to the same widths, and said; at the default
/// ones too, where the data ask for no narrower.
#[test]
fn from_above_priors_are_learnt_alike_wherever_they_begin() {
    for (spread_m, wider) in [(3e-4, 3.0), (3e-4, 10.0), (9e-3, 1.0)] {
        let all = problem(&[(ParameterKind::Length, spread_m), (ParameterKind::JointZero, 1e-3)], 30, 7);
        let alone = fit_problem(&all, &[0.0; 60], &|p| p.free, &config()).unwrap();
        let mut scales = scales_of(alone.estimates.iter().zip(&all.parameters));
        assert_eq!(scales.len(), 2);
        scales.values_mut().for_each(|scale| *scale = (*scale * wider).min(1.0));
        let begun = fit_where_priors(&all, (&alone.values(), &scales), &|p| p.free, &config()).unwrap();
        for (a, b) in alone.estimates.iter().zip(&begun.estimates) {
            let [alone, begun] = [a, b].map(|e| e.parameter.prior_sigma.unwrap());
            assert!((begun / alone - 1.0).abs() < 0.02, "{begun} and {alone}");
            assert!((a.value - b.value).abs() < 0.01 * a.sigma, "{}", a.parameter.name);
        }
        let codes =
            [&alone, &begun].map(|fit| fit.warnings.iter().map(|w| w.code.as_str()).collect::<Vec<_>>());
        assert_eq!(codes[0], codes[1]);
        assert!(codes[0].contains(&"priors-learnt"), "{codes:?}");
    }
}

/// An arm of which one length is 6 mm off: a millimetre more than anybody assumed.
#[test]
fn bounds_that_nobody_declared_are_widened_where_that_explains_the_errors() {
    let outcome = |off_m: f64, others_m: f64, declared: bool| {
        let mut all = problem(&[(ParameterKind::Length, 1e-3)], 30, 6);
        all.measured[0] = off_m;
        // What no parameter can follow: an error of the block that is not its own.
        all.measured[1] += others_m;
        if declared {
            all.parameters.iter_mut().for_each(|p| p.assumed = None);
        }
        let fit = fit_problem(&all, &[0.0; 30], &|p| p.free, &config()).unwrap();
        let said = fit.warnings.iter().find(|w| w.code == Code::BoundWidened).map(|w| w.message.clone());
        (fit.estimates[0].value, fit.estimates[0].parameter.upper, said)
    };
    let (value, upper, said) = outcome(6e-3, 0.0, false);
    assert!((value - 6e-3).abs() < 1e-4 && (upper - 7.5e-3).abs() < 1e-12, "{value} {upper}");
    let said = said.unwrap();
    assert!(said.contains("p0 is off by +") && said.contains("5.000 was assumed"), "{said}");
    // Within the bounds nothing is said; further than half as wide again, or beside errors of another kind, they stay.
    assert_eq!(outcome(4.9e-3, 0.0, false).2, None);
    assert_eq!((outcome(9e-3, 0.0, false).1, outcome(9e-3, 0.0, false).2), (5e-3, None));
    assert_eq!((outcome(6e-3, 0.02, false).1, outcome(6e-3, 0.02, false).2), (5e-3, None));
    // So do those that were declared.
    assert_eq!((outcome(6e-3, 0.0, true).1, outcome(6e-3, 0.0, true).2), (5e-3, None));
}

#[test]
fn what_is_declared_is_kept() {
    let mut problem = problem(&[(ParameterKind::Length, 1e-3)], 6, 4);
    let off = FitConfig { learn_priors: false, ..config() };
    assert!(learnt(&problem, &off).iter().all(|s| *s == 4e-3));
    problem.parameters[0].assumed = None;
    let sigma_m = learnt(&problem, &config());
    assert_eq!(sigma_m[0], 4e-3);
    assert!(sigma_m[1] < 3e-3, "{sigma_m:?}");
}

#[test]
fn what_was_learnt_is_said() {
    let problem = problem(&[(ParameterKind::JointZero, 1e-3)], 6, 5);
    let fit = fit_problem(&problem, &[0.0; 6], &|p| p.free, &config()).unwrap();
    let said = fit.warnings.iter().find(|w| w.code == Code::PriorsLearnt).unwrap();
    let mm = 1e3 * fit.estimates[0].parameter.prior_sigma.unwrap();
    assert!(said.message.contains(&format!("joint zeros {mm:.2} mm")), "{}", said.message);
    assert!(fit.estimates.iter().all(|e| e.determined), "the data know each of them");
}
