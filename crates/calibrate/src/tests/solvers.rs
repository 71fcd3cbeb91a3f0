use super::linear::parameter;
use super::rig;
use crate::fit;
use crate::fit_problem;
use crate::objective::problem::Problem;
use crate::{CalibrateError, FitConfig, Objective, Scale, WhitenedProblem, whitened_problem};
use armcal_core::{Parameter, Unit};
use basin::{BoundedLevenbergMarquardt, BoxBounds, ConstraintDescription, ConstraintSet, Executor};
use nalgebra::{DMatrix, DVector};
use std::time::Instant;

/// A planar 2R arm, ten poses, one of them 36 mm wrong; two rows a block.
struct Planar {
    parameters: Vec<Parameter>,
    poses: Vec<([f64; 2], DVector<f64>)>,
}

const NOMINAL: [f64; 4] = [0.0, 0.0, 0.4, 0.3];

fn forward(p: &[f64], q: &[f64; 2]) -> DVector<f64> {
    let (t1, t12) = (p[0] + q[0], p[0] + q[0] + p[1] + q[1]);
    DVector::from_column_slice(&[p[2] * t1.cos() + p[3] * t12.cos(), p[2] * t1.sin() + p[3] * t12.sin()])
}

impl Planar {
    fn new(bounded: bool) -> Planar {
        let bounds = [[-0.05, 0.05], [-0.05, 0.05], [0.395, 0.4025], [0.295, 0.305]];
        let names = ["theta1", "theta2", "l1", "l2"];
        let parameters = (0..4)
            .map(|k| {
                let mut p = parameter(names[k], f64::INFINITY, Some([0.03, 0.03, 0.005, 0.005][k]));
                p.nominal = NOMINAL[k];
                p.unit = if k < 2 { Unit::Radian } else { Unit::Metre };
                if bounded {
                    [p.lower, p.upper] = bounds[k];
                }
                p
            })
            .collect();
        let truth = [0.02, -0.03, 0.404, 0.297];
        let poses = (0..10)
            .map(|i| {
                let i = i as f64;
                let q = [0.1 * i - 0.4, 0.15 * i + 0.2];
                let noise = [(7.0 * i + 1.0).sin(), (5.0 * i + 2.0).cos()].map(|v| 3e-4 * v);
                let mut y = forward(&truth, &q) + DVector::from_column_slice(&noise);
                if i == 6.0 {
                    y += DVector::from_column_slice(&[0.03, -0.02]);
                }
                (q, y)
            })
            .collect();
        Planar { parameters, poses }
    }
}

impl Problem for Planar {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }
    fn blocks(&self) -> usize {
        self.poses.len()
    }
    fn name(&self, block: usize) -> String {
        format!("pose {block}")
    }
    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        &self.poses[block].1 - forward(p, &self.poses[block].0)
    }
    fn linearised(&self, block: usize, p: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let q = &self.poses[block].0;
        let (t1, t12) = (p[0] + q[0], p[0] + q[0] + p[1] + q[1]);
        let (x, y) = (p[3] * t12.cos(), p[3] * t12.sin());
        let rows =
            [[-p[2] * t1.sin() - y, -y, t1.cos(), t12.cos()], [p[2] * t1.cos() + x, x, t1.sin(), t12.sin()]];
        (self.residual(block, p), -DMatrix::from_fn(2, 4, |r, c| rows[r][c]))
    }
    fn covariance(&self, _: usize, _: &[f64]) -> DMatrix<f64> {
        DMatrix::identity(2, 2) * 3e-4_f64.powi(2)
    }
}

#[test]
fn scipy_finds_the_same_optimum() {
    // scipy 1.17.1 least_squares(method="trf", jac="3-point", xtol=ftol=1e-15, gtol=1e-13) on the same residuals,
    // prior rows included; robust: each 2-vector stretched to sqrt(2 rho(u)), c = 1.50114108. tests/scipy_planar.py.
    let cases = [
        (
            Objective::LeastSquares,
            false,
            [0.022514549998899, -0.034668277632521, 0.408951768888320, 0.292231989366975],
        ),
        (Objective::LeastSquares, true, [0.022518463181541, -0.049434986098720, 0.4025, 0.296177824059672]),
        (
            Objective::Robust,
            false,
            [0.019571434235904, -0.028411505487791, 0.404384531188270, 0.296852662071301],
        ),
        (Objective::Robust, true, [0.019673314097186, -0.033032225711236, 0.4025, 0.297954570639869]),
    ];
    for (objective, bounded, expected) in cases {
        let problem = Planar::new(bounded);
        let config = FitConfig { objective, scale: Scale::Declared, ..FitConfig::default() };
        let fit = fit_problem(&problem, &NOMINAL, &|p| p.free, &config).unwrap();
        let off = fit.values().iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{objective:?} bounded {bounded}: off by {off:.1e} after {} iterations", fit.iterations);
        assert!(off < 2e-9, "{objective:?} bounded {bounded}: {:?}", fit.values());
        assert_eq!(fit.estimates[2].at_bound, bounded);
    }
}

/// The exported problem as basin wants it.
struct ForBasin<'a> {
    problem: &'a WhitenedProblem<'a>,
    lower: DVector<f64>,
    upper: DVector<f64>,
}

impl basin::Constraints for ForBasin<'_> {
    type Set = ConstraintSet<BoxBounds<DVector<f64>>>;
    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.lower), Some(&self.upper)))
    }
}

impl basin::Residual for ForBasin<'_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;
    type Error = CalibrateError;
    fn residual(&self, x: &DVector<f64>) -> Result<DVector<f64>, CalibrateError> {
        self.problem.residual(x)
    }
}

impl basin::Jacobian for ForBasin<'_> {
    type Jacobian = DMatrix<f64>;
    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, CalibrateError> {
        self.problem.jacobian(x)
    }
}

/// Half squared norm of the exported problem at x.
fn cost(problem: &WhitenedProblem<'_>, x: &DVector<f64>) -> f64 {
    0.5 * problem.residual(x).unwrap().norm_squared()
}

#[test]
fn basin_finds_the_same_optimum_of_the_exported_problem() {
    let mut model = rig::tracked_model();
    let mut rng = rig::rng(51);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let mut observations = rig::tracked(&model, &truth, 198, &mut rng);
    observations[9].joint_rad[1] += 0.1;
    // One bound that must hold.
    let a2 = truth[model.index("joint2.a").unwrap()];
    let middle = 0.5 * (a2 + 0.4);
    model
        .set_parameter("joint2.a", |p| {
            if a2 > 0.4 {
                p.upper = middle
            } else {
                p.lower = middle
            }
            p.prior_sigma = Some(4e-3);
        })
        .unwrap();
    let config = FitConfig::default();
    let clock = Instant::now();
    let ours = fit(&model, &observations, &config).unwrap();
    let ours_took = clock.elapsed();
    assert!(ours.estimates[model.index("joint2.a").unwrap()].at_bound);
    let problem = whitened_problem(&model, &observations, &config).unwrap();
    let found = problem.x_of(&ours);
    let for_basin = || ForBasin { problem: &problem, lower: problem.lower(), upper: problem.upper() };
    let clock = Instant::now();
    let solver = BoundedLevenbergMarquardt::new().with_absolute_scaled_gradient_tolerance(1e-7);
    let theirs = Executor::from_start(for_basin(), solver, problem.start()).max_iter(500).run().unwrap();
    let bounded_took = clock.elapsed();
    let clock = Instant::now();
    let solver = basin::TrustRegionReflective::new().with_absolute_scaled_gradient_tolerance(1e-7);
    let reflective = Executor::from_start(for_basin(), solver, problem.start()).max_iter(500).run().unwrap();
    let reflective_took = clock.elapsed();
    println!(
        "ours {ours_took:.1?} in {} iterations with scale and statistics, {} evaluations of the model each; basin at a \
         given scale: bounded LM {bounded_took:.1?} in {}, reflective {reflective_took:.1?} in {}; cost {:.9} {:.9} {:.9}",
        ours.iterations,
        observations.len(),
        theirs.iter(),
        reflective.iter(),
        cost(&problem, &found),
        theirs.cost(),
        reflective.cost(),
    );
    // Both are interior methods: they end inside the bound, at a cost above ours; the bounded LM earlier than that.
    for (other, slack, distance) in [(reflective.param(), 1e-6, 1e-3), (theirs.param(), 1e-2, 0.1)] {
        let above = cost(&problem, other) - cost(&problem, &found);
        assert!((-1e-9..slack).contains(&above), "{above}");
        assert!((&found - other).amax() < distance, "{}", (&found - other).amax());
    }
}

#[test]
fn the_exported_jacobian_is_the_derivative_of_the_exported_residual() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(52);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let observations = rig::tracked(&model, &truth, 20, &mut rng);
    let config = FitConfig { scale: Scale::Declared, ..FitConfig::default() };
    let problem = whitened_problem(&model, &observations, &config).unwrap();
    // From the start, where every observation lies in the linear part of the loss, to the optimum.
    let optimum = problem.x_of(&fit(&model, &observations, &config).unwrap());
    for x in [problem.start(), optimum] {
        let jacobian = problem.jacobian(&x).unwrap();
        for k in 0..x.len() {
            let step = |h: f64| {
                let mut moved = x.clone();
                moved[k] += h;
                problem.residual(&moved).unwrap()
            };
            let numeric = (step(1e-5) - step(-1e-5)) / 2e-5;
            let error = (numeric - jacobian.column(k)).amax();
            assert!(error < 1e-5 * (1.0 + jacobian.column(k).amax()), "{}: {error}", problem.names()[k]);
        }
    }
}

#[test]
fn speed_of_a_fit_from_nominal() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(53);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let observations = rig::tracked(&model, &truth, 198, &mut rng);
    let clock = Instant::now();
    for o in &observations {
        assert_eq!(model.residual_with_jacobian(&truth, o).1.ncols(), model.parameters().len());
    }
    let jacobians = clock.elapsed().as_secs_f64();
    let mut took = Vec::new();
    let mut iterations = 0;
    for _ in 0..9 {
        let clock = Instant::now();
        iterations = fit(&model, &observations, &FitConfig::default()).unwrap().iterations;
        took.push(clock.elapsed().as_secs_f64());
    }
    took.sort_by(f64::total_cmp);
    println!(
        "198 observations, {} parameters, {iterations} iterations: {:.2} ms; the model's Jacobians once: {:.2} ms",
        model.parameters().iter().filter(|p| p.free).count(),
        1e3 * took[4],
        1e3 * jacobians
    );
    assert!(iterations <= 20, "{iterations}");
}
