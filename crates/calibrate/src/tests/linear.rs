use crate::fit_problem;
use crate::objective::problem::Problem;
use crate::{FitConfig, Objective, Scale, Status};
use armcal_core::{Code, Parameter, Role, Unit};
use nalgebra::{DMatrix, DVector};
use rand::RngExt as _;

/// `r_j = y_j - A_j p`, identity covariance times `variance`.
pub struct Linear {
    pub parameters: Vec<Parameter>,
    pub blocks: Vec<(DVector<f64>, DMatrix<f64>)>,
    pub variance: f64,
}

impl Problem for Linear {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }
    fn blocks(&self) -> usize {
        self.blocks.len()
    }
    fn name(&self, block: usize) -> String {
        format!("block {block}")
    }
    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        let (y, a) = &self.blocks[block];
        y - a * DVector::from_column_slice(p)
    }
    fn linearised(&self, block: usize, p: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        (self.residual(block, p), -&self.blocks[block].1)
    }
    fn covariance(&self, block: usize, _: &[f64]) -> DMatrix<f64> {
        let rows = self.blocks[block].0.len();
        DMatrix::identity(rows, rows) * self.variance
    }
}

pub fn parameter(name: &str, bound: f64, prior_sigma: Option<f64>) -> Parameter {
    Parameter {
        name: name.to_string(),
        unit: Unit::Metre,
        nominal: 0.0,
        lower: -bound,
        upper: bound,
        prior_sigma,
        usual: None,
        assumed: None,
        free: true,
        role: Role::Robot,
        meaning: String::new(),
    }
}

/// 20 random 3-row blocks over 4 parameters with priors, no bound near.
pub fn random_problem(seed: u64) -> Linear {
    let mut rng = super::rig::rng(seed);
    let truth = DVector::from_column_slice(&[0.3, -0.2, 0.1, 0.4]);
    let blocks = (0..20)
        .map(|_| {
            let a = DMatrix::from_fn(3, 4, |_, _| rng.random_range(-1.0..1.0));
            let noise = DVector::from_fn(3, |_, _| rng.random_range(-0.02..0.02));
            (&a * &truth + noise, a)
        })
        .collect();
    let sigmas = [0.5, 0.3, 1.0, 0.2];
    let parameters = sigmas
        .iter()
        .enumerate()
        .map(|(k, s)| parameter(&format!("p{k}"), f64::INFINITY, Some(*s)))
        .collect();
    Linear { parameters, blocks, variance: 1e-4 }
}

#[test]
fn least_squares_with_prior_is_the_normal_equations() {
    let problem = random_problem(1);
    let config = FitConfig { objective: Objective::LeastSquares, ..FitConfig::default() };
    let fit = fit_problem(&problem, &[0.0; 4], &|p| p.free, &config).unwrap();
    let prior = DMatrix::from_diagonal(&DVector::from_iterator(
        4,
        problem.parameters.iter().map(|p| p.prior_sigma.unwrap().powi(-2)),
    ));
    let (mut information, mut right) = (DMatrix::zeros(4, 4), DVector::zeros(4));
    for (y, a) in &problem.blocks {
        information += a.transpose() * a / problem.variance;
        right += a.transpose() * y / problem.variance;
    }
    let expected = (&information + &prior).try_inverse().unwrap() * right;
    let found = DVector::from_vec(fit.values());
    assert!((&found - &expected).amax() < 1e-12, "{found} {expected}");
    // chi-square over degrees of freedom, p = tr(D C), written out independently.
    let chi: f64 =
        problem.blocks.iter().map(|(y, a)| (y - a * &found).norm_squared() / problem.variance).sum();
    let scale_at = |variance: f64| {
        let c = (&information / variance + &prior).try_inverse().unwrap();
        60.0 - (&information / variance * c).trace()
    };
    let freedom = scale_at(1.0);
    assert!(
        (fit.sigma_scale.powi(2) - chi / freedom).abs() < 1e-4,
        "{} {}",
        fit.sigma_scale.powi(2),
        chi / freedom
    );
    let variance = (chi / freedom).max(1.0);
    let covariance = (&information / variance + &prior).try_inverse().unwrap();
    assert!((fit.covariance.dense() - &covariance).amax() < 1e-9 * covariance.amax());
    assert_eq!((fit.status, fit.rank), (Status::Converged, 4));
    assert!(fit.estimates.iter().all(|e| e.determined && !e.at_bound));
}

#[test]
fn an_active_bound_is_met_exactly_and_the_others_adjust() {
    let mut problem = random_problem(2);
    // The free optimum is near 0.4: a bound of 0.25 must hold, exactly.
    problem.parameters[3].upper = 0.25;
    let config = FitConfig { objective: Objective::LeastSquares, ..FitConfig::default() };
    let fit = fit_problem(&problem, &[0.0; 4], &|p| p.free, &config).unwrap();
    assert_eq!(fit.estimates[3].value, 0.25);
    assert!(fit.estimates[3].at_bound && !fit.estimates[0].at_bound);
    assert!(fit.estimates[3].ci95[1] <= 0.25);
    assert!(fit.warnings.iter().any(|w| w.code == Code::AtBound && w.subject.contains("p3")));
    // The other three solve the problem in which p3 is fixed at 0.25.
    let mut fixed = random_problem(2);
    fixed.parameters[3].free = false;
    let other = fit_problem(&fixed, &[0.0, 0.0, 0.0, 0.25], &|p| p.free, &config).unwrap();
    for k in 0..3 {
        assert!((fit.estimates[k].value - other.estimates[k].value).abs() < 1e-10);
    }
    assert_eq!(other.estimates[3].sigma, 0.0);
}

#[test]
fn information_decides_what_is_determined() {
    // Two parameters enter only as their sum; a third alone; a fourth not at all.
    let mut problem = random_problem(3);
    for (_, a) in &mut problem.blocks {
        let first = a.column(0).into_owned();
        a.set_column(1, &first);
        a.column_mut(3).fill(0.0);
    }
    problem.parameters.iter_mut().for_each(|p| p.prior_sigma = Some(0.5));
    let config = FitConfig { scale: Scale::Declared, ..FitConfig::default() };
    let fit = fit_problem(&problem, &[0.0; 4], &|p| p.free, &config).unwrap();
    let determined: Vec<bool> = fit.estimates.iter().map(|e| e.determined).collect();
    assert_eq!(determined, [false, false, true, false]);
    assert_eq!(fit.rank, 2);
    let texts: Vec<&str> = fit.undetermined.iter().map(|d| d.text.as_str()).collect();
    assert_eq!(
        texts,
        ["p0 - p1: p0 and p1 move the tip alike over these dwells", "p3: no observation depends on it"]
    );
    // The sum is shared out evenly by the equal priors; the unseen one stays at nominal.
    assert!((fit.estimates[0].value - fit.estimates[1].value).abs() < 1e-9);
    assert_eq!(fit.estimates[3].value, 0.0);
    assert!((fit.estimates[3].sigma - 0.5).abs() < 1e-12);
}
