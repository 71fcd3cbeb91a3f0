//! The structured solution against the dense one, which knows nothing of recordings.

use super::rig;
use crate::fit_problem;
use crate::objective::problem::Problem;
use crate::{Calibration, Fit, FitConfig, HoldoutConfig, ModelProblem, Objective, calibrate};
use armcal_core::{Observation, Parameter, Pose};
use armcal_model::{Frame, Knowledge, Model, RecordingStart};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

/// An arm at tables of its own on every day: the model, the truth and the dwells, `sizes[k]` on day k.
fn days(sizes: &[usize], seed: u64) -> (Model, Vec<f64>, Vec<Observation>) {
    let mut rng = rig::rng(seed);
    let start = Pose::translation(0.4, 0.0, 0.1);
    let boards = (0..sizes.len()).map(|k| Frame::estimated(format!("board.day{k}"), start)).collect();
    let model = rig::model(Frame::given("base", Pose::identity()), boards);
    let truth = rig::planted(&model, &mut rng, 0.6);
    let mut observations = Vec::new();
    for (recording, &n) in sizes.iter().enumerate() {
        let pose = start * small_pose(&mut rng);
        let mut day = rig::seated(&model, &truth, &[pose], n, &mut rng);
        day.iter_mut().for_each(|o| o.dwell.recording = recording);
        observations.extend(day);
    }
    for o in &mut observations {
        o.joint_sigma_rad = vec![2e-5; 3];
    }
    (model, truth, observations)
}

fn small_pose(rng: &mut ChaCha8Rng) -> Pose {
    let mut draw = |size: f64| Vector3::from_fn(|_, _| rng.random_range(-size..size));
    Pose::new(draw(0.03), draw(0.2))
}

fn recordings(count: usize) -> Vec<RecordingStart> {
    (0..count).map(|k| RecordingStart { name: format!("day{k}"), base_in_world: None }).collect()
}

fn pooled(model: &Model, count: usize, own: &[&str]) -> Model {
    let own: Vec<String> = own.iter().map(|name| (*name).to_owned()).collect();
    model.with_own(&recordings(count), &own).unwrap()
}

/// Largest difference of two fits: of values in standard deviations, and of the covariance in units of the deviations.
fn difference(a: &Fit, b: &Fit) -> (f64, f64) {
    assert_eq!(a.estimates.len(), b.estimates.len());
    let (mut values, mut covariance): (f64, f64) = (0.0, 0.0);
    let (of_a, of_b) = (a.covariance.dense(), b.covariance.dense());
    for (i, (x, y)) in a.estimates.iter().zip(&b.estimates).enumerate() {
        assert_eq!((&x.parameter.name, x.at_bound), (&y.parameter.name, y.at_bound));
        if x.sigma > 0.0 {
            values = values.max((x.value - y.value).abs() / x.sigma);
        }
        for (j, z) in a.estimates.iter().enumerate().filter(|(_, z)| x.sigma * z.sigma > 0.0) {
            covariance = covariance.max((of_a[(i, j)] - of_b[(i, j)]).abs() / (x.sigma * z.sigma));
        }
    }
    (values, covariance)
}

fn assert_same(dense: &Calibration, structured: &Calibration) {
    let (values, covariance) = difference(&dense.fit, &structured.fit);
    println!("values {values:.1e} sigma, covariance {covariance:.1e}");
    assert!(values < 1e-9 && covariance < 1e-8, "{values} {covariance}");
    assert_eq!(dense.fit.rank, structured.fit.rank);
    let texts = |c: &Calibration| c.fit.undetermined.iter().map(|u| u.text.clone()).collect::<Vec<_>>();
    assert_eq!(texts(dense), texts(structured));
    assert!((dense.fit.sigma_scale - structured.fit.sigma_scale).abs() < 1e-9);
    assert_eq!(dense.residuals.len(), structured.residuals.len());
    for (a, b) in dense.residuals.iter().zip(&structured.residuals) {
        assert_eq!((a.dwell, a.held_out), (b.dwell, b.held_out));
        let off_m = [(a.fitted_m - b.fitted_m).norm(), (a.nominal_m - b.nominal_m).norm()];
        // Turns start where rounding has them, and iterate to a step of 1e-5 standard deviations.
        let tolerance_m = if a.held_out { 1e-9 } else { 1e-11 };
        assert!(off_m.iter().all(|off_m| *off_m < tolerance_m), "{} {off_m:?}", a.dwell);
    }
    assert_eq!(dense.fit.warnings, structured.fit.warnings);
}

fn compare(model: &Model, observations: &[Observation], count: usize, holdout: &HoldoutConfig) {
    let config = FitConfig::default();
    let dense = calibrate(model, observations, &config, holdout).unwrap();
    let structured = calibrate(&pooled(model, count, &[]), observations, &config, holdout).unwrap();
    assert_same(&dense, &structured);
}

#[test]
fn pools_of_any_size_have_the_optimum_of_one_dense_fit() {
    for (sizes, seed) in [(vec![30, 30, 30], 1), (vec![9, 60, 25, 40, 12, 33, 20], 2), (vec![15; 12], 3)] {
        let (model, truth, observations) = days(&sizes, seed);
        compare(&model, &observations, sizes.len(), &HoldoutConfig::None);
        let fit = calibrate(
            &pooled(&model, sizes.len(), &[]),
            &observations,
            &FitConfig::default(),
            &HoldoutConfig::None,
        )
        .unwrap()
        .fit;
        let off = fit.estimates.iter().zip(&truth).filter(|(e, _)| e.parameter.name.starts_with("joint"));
        for (e, truth) in off.filter(|(e, _)| e.determined) {
            assert!((e.value - truth).abs() < 4.5 * e.sigma, "{}", e.parameter.name);
        }
    }
}

#[test]
fn outliers_active_bounds_and_recordings_too_short_change_nothing_of_that() {
    let sizes = [25, 1, 40, 2, 30];
    let (mut model, truth, mut observations) = days(&sizes, 4);
    for o in observations.iter_mut().step_by(9) {
        if let armcal_core::Reference::Seated { in_board_m, .. } = &mut o.reference {
            in_board_m.x += 0.02;
        }
    }
    // The truth lies beyond this bound.
    let a2 = model.index("joint2.a").unwrap();
    let half = 0.5 * (truth[a2] - model.parameters()[a2].nominal).abs();
    model.set_parameter("joint2.a", |p| (p.lower, p.upper) = (p.nominal - half, p.nominal + half)).unwrap();
    let config = FitConfig::default();
    let dense = calibrate(&model, &observations, &config, &HoldoutConfig::None).unwrap();
    let structured =
        calibrate(&pooled(&model, 5, &[]), &observations, &config, &HoldoutConfig::None).unwrap();
    assert_same(&dense, &structured);
    assert!(structured.fit.estimates[a2].at_bound);
    assert!(structured.fit.weights.iter().filter(|w| **w < 0.25).count() >= 8);
    // One dwell leaves the turn of its board open, two the turn about their line.
    for board in ["board.day1", "board.day3"] {
        assert!(structured.fit.undetermined.iter().any(|u| u.text.contains(board)), "{board}");
    }
}

#[test]
fn a_pool_of_one_recording_is_one_fit() {
    let (model, _, observations) = days(&[50], 5);
    compare(&model, &observations, 1, &HoldoutConfig::None);
}

#[test]
fn held_out_recordings_and_cavities_are_predicted_as_by_the_dense_fit() {
    let (model, _, observations) = days(&[22, 30, 18, 25], 6);
    compare(&model, &observations, 4, &HoldoutConfig::EachRecording);
    compare(&model, &observations, 4, &HoldoutConfig::CavityFolds { k: 3 });
}

/// The problem of a pool without its structure: every block knows everything.
struct Collapsed<'a>(ModelProblem<'a>);

impl Problem for Collapsed<'_> {
    fn parameters(&self) -> &[Parameter] {
        self.0.parameters()
    }
    fn blocks(&self) -> usize {
        self.0.blocks()
    }
    fn name(&self, block: usize) -> String {
        self.0.name(block)
    }
    fn residual(&self, block: usize, p: &[f64]) -> DVector<f64> {
        self.0.residual(block, p)
    }
    fn linearised(&self, block: usize, p: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let (residual, own) = self.0.linearised(block, p);
        let known = self.0.known();
        let of = known.iter().find(|known| known.blocks.contains(&block)).unwrap();
        let mut all = DMatrix::zeros(own.nrows(), p.len());
        of.parameters.iter().zip(own.column_iter()).for_each(|(&i, c)| all.column_mut(i).copy_from(&c));
        (residual, all)
    }
    fn covariance(&self, block: usize, p: &[f64]) -> DMatrix<f64> {
        self.0.covariance(block, p)
    }
}

/// A camera set up anew every day and a belt that slipped: base and a joint's zero are each recording's own.
#[test]
fn own_bases_and_joint_zeros_are_eliminated_exactly_and_found() {
    let days = 4;
    let mut rng = rig::rng(7);
    let base = |pose| Frame {
        knowledge: Knowledge::Measured { sigma_m: 0.5e-3, sigma_rad: 1e-3 },
        ..Frame::given("base", pose)
    };
    let model = rig::model(base(Pose::identity()), Vec::new());
    let truth = rig::planted(&model, &mut rng, 0.4);
    let theta = model.index("joint3.theta").unwrap();
    let (mut observations, mut recordings, mut zeros_rad) = (Vec::new(), Vec::new(), Vec::new());
    for day in 0..days {
        let camera =
            Pose::new(Vector3::new(0.5, 0.1 * day as f64, 0.2), Vector3::new(0.0, 0.1, 0.9 * day as f64));
        let mut today = model.clone();
        today.set_base_start(0, camera);
        let mut own = truth.clone();
        let x = today.index("base.x").unwrap();
        own[x..x + 6].copy_from_slice(&today.nominal()[x..x + 6]);
        own[theta] = truth[theta] + 4e-3 * (day as f64 - 1.0);
        zeros_rad.push(own[theta]);
        let mut seen = rig::tracked(&today, &own, 40, &mut rng);
        seen.iter_mut().for_each(|o| o.dwell.recording = day);
        observations.extend(seen);
        recordings.push(RecordingStart { name: format!("day{day}"), base_in_world: Some(camera) });
    }
    let own = ["base.*".to_owned(), "joint3.theta".to_owned()];
    let pool = model.with_own(&recordings, &own).unwrap();
    assert_eq!(pool.own_parameters(2).len(), 7);
    let config = FitConfig::default();
    let free = |p: &Parameter| p.free;
    let start: Vec<f64> = pool.parameters().iter().map(|p| p.nominal).collect();
    let problem = || ModelProblem::new(&pool, &observations, &config).unwrap();
    let structured = fit_problem(&problem(), &start, &free, &config).unwrap();
    let dense = fit_problem(&Collapsed(problem()), &start, &free, &config).unwrap();
    let (values, covariance) = difference(&dense, &structured);
    println!("values {values:.1e} sigma, covariance {covariance:.1e}");
    assert!(values < 1e-9 && covariance < 1e-8);
    assert_eq!(dense.rank, structured.rank);
    // The zero itself is hardly told from the tool; how far it slipped between two days is.
    let zero = |day: usize| {
        let name = format!("day{day}.joint3.theta");
        structured.estimates.iter().position(|e| e.parameter.name == name).unwrap()
    };
    for day in 1..days {
        let (a, b, c) = (zero(0), zero(day), &structured.covariance);
        let slip_rad = structured.estimates[b].value - structured.estimates[a].value;
        let sigma_rad = (c.get(a, a) + c.get(b, b) - 2.0 * c.get(a, b)).sqrt();
        let off = (slip_rad - (zeros_rad[day] - zeros_rad[0])) / sigma_rad;
        println!("day {day}: slipped by {slip_rad:.5} ± {sigma_rad:.1e} rad, {off:.2} sigma off");
        assert!(off.abs() < 4.5 && sigma_rad < 1e-3);
    }
}

#[test]
fn threads_do_not_change_a_bit() {
    let (model, _, observations) = days(&[20, 12, 31, 8, 16], 8);
    let pool = pooled(&model, 5, &["joint1.theta"]);
    let with = |threads: usize| {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let holdout = HoldoutConfig::EachRecording;
        threads.install(|| calibrate(&pool, &observations, &FitConfig::default(), &holdout)).unwrap()
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn what_cannot_be_pooled_is_named() {
    let (model, _, observations) = days(&[10, 10], 9);
    let refused = |own: &str| {
        let all = model.with_own(&recordings(2), &[own.to_owned()]);
        all.unwrap_err().to_string()
    };
    assert!(refused("joint1.tetha").contains("joint1.theta"));
    assert!(refused("base.x").contains("fixed"));
    assert!(refused("board.*").contains("its recording's own"));
    let pool = pooled(&model, 2, &[]);
    let paper = FitConfig { objective: Objective::Paper, ..FitConfig::default() };
    let error = calibrate(&pool, &observations, &paper, &HoldoutConfig::None).unwrap_err();
    assert!(error.to_string().contains("fit.objective"));
    let mut stray = observations.clone();
    stray.last_mut().unwrap().dwell.recording = 2;
    let error = calibrate(&pool, &stray, &FitConfig::default(), &HoldoutConfig::None).unwrap_err();
    assert!(error.to_string().contains("2 recordings of the model"));
}
