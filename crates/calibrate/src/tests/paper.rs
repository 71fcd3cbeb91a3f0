use super::linear::{Linear, parameter};
use super::rig;
use crate::fit;
use crate::fit_problem;
use crate::{FitConfig, Objective, Status};
use armcal_core::Code;
use nalgebra::{DMatrix, DVector};
use rand::RngExt as _;

fn config(average_accuracy_mm: Option<f64>) -> FitConfig {
    FitConfig { objective: Objective::Paper, average_accuracy_mm, ..FitConfig::default() }
}

/// `r_j = y_j - p`: eq. 4 is the geometric median of the points.
fn points(bound: f64) -> (Linear, Vec<DVector<f64>>) {
    let mut rng = rig::rng(5);
    let points: Vec<DVector<f64>> =
        (0..9).map(|_| DVector::from_fn(3, |_, _| 1e-3 * rng.random_range(-4.0..4.0))).collect();
    let blocks = points.iter().map(|y| (y.clone(), DMatrix::identity(3, 3))).collect();
    let parameters = ["x", "y", "z"].map(|n| parameter(n, bound, None)).to_vec();
    (Linear { parameters, blocks, variance: 1e-6 }, points)
}

/// Weiszfeld's iteration.
fn geometric_median(points: &[DVector<f64>]) -> DVector<f64> {
    let mut m = points.iter().sum::<DVector<f64>>() / points.len() as f64;
    for _ in 0..20_000 {
        let weights: Vec<f64> = points.iter().map(|p| 1.0 / (p - &m).norm()).collect();
        let sum = points.iter().zip(&weights).map(|(p, w)| p * *w).sum::<DVector<f64>>();
        m = sum / weights.iter().sum::<f64>();
    }
    m
}

#[test]
fn the_minimum_of_eq_4_is_the_geometric_median() {
    let (problem, points) = points(5e-3);
    let fit = fit_problem(&problem, &[0.0; 3], &|p| p.free, &config(Some(10.0))).unwrap();
    let expected = geometric_median(&points);
    let found = DVector::from_vec(fit.values());
    println!("median off by {:.2e} m", (&found - &expected).norm());
    // The tie-breaker of nanometres and the tolerance of E leave a micrometre.
    assert!((&found - &expected).norm() < 1e-6);
    let paper = fit.paper.unwrap();
    let sum: f64 = points.iter().map(|p| (p - &expected).norm()).sum();
    assert!((paper.sum_of_distances_m - sum).abs() < 1e-9 && paper.feasible);
    assert!((paper.limit_m - 9.0 * 0.01).abs() < 1e-15);
    assert!(fit.weights.iter().all(|w| *w == 1.0));
}

#[test]
fn an_average_accuracy_out_of_reach_is_said_with_its_numbers() {
    let (problem, points) = points(5e-3);
    let median = geometric_median(&points);
    let mean_mm = 1e3 * points.iter().map(|p| (p - &median).norm()).sum::<f64>() / 9.0;
    for (asked_mm, feasible) in [(mean_mm * 1.001, true), (mean_mm * 0.999, false)] {
        let fit = fit_problem(&problem, &[0.0; 3], &|p| p.free, &config(Some(asked_mm))).unwrap();
        assert_eq!(fit.paper.unwrap().feasible, feasible, "{asked_mm}");
        let warning = fit.warnings.iter().find(|w| w.code == Code::PaperInfeasible);
        assert_eq!(warning.is_some(), !feasible);
        if let Some(warning) = warning {
            assert!(warning.message.contains(&format!("mean {mean_mm:.3} mm")), "{}", warning.message);
            assert!(warning.message.contains(&format!("a = {asked_mm:.3} mm")), "{}", warning.message);
        }
    }
}

#[test]
fn bounds_of_eq_4_hold() {
    let (problem, _) = points(0.2e-3);
    let fit = fit_problem(&problem, &[0.0; 3], &|p| p.free, &config(None)).unwrap();
    assert!(fit.estimates.iter().all(|e| e.value.abs() <= 0.2e-3));
    assert!(fit.estimates.iter().any(|e| e.at_bound), "{:?}", fit.values());
}

#[test]
fn the_planted_arm_meets_the_optimality_conditions_of_eq_4() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(11);
    let truth = rig::planted(&model, &mut rng, 0.6);
    let observations = rig::tracked(&model, &truth, 60, &mut rng);
    let fit = fit(&model, &observations, &config(Some(0.5))).unwrap();
    assert_eq!(fit.status, Status::Converged);
    let paper = fit.paper.unwrap();
    println!(
        "E = {:.3} mm, mean {:.3} mm",
        paper.sum_of_distances_m * 1e3,
        paper.sum_of_distances_m * 1e3 / 60.0
    );
    let p = fit.values();
    let at_truth: f64 = observations.iter().map(|o| model.residual(&truth, o).position_m.norm()).sum();
    assert!(paper.sum_of_distances_m < at_truth && paper.feasible);
    // 0 lies in the subdifferential: what the nonzero distances pull, the zero ones can hold.
    for (k, e) in fit.estimates.iter().enumerate().filter(|(_, e)| e.parameter.free && !e.at_bound) {
        let (mut pull, mut hold, mut size) = (0.0, 0.0, 0.0);
        for o in &observations {
            let (residual, jacobian) = model.residual_with_jacobian(&p, o);
            let column = jacobian.column(k).into_owned();
            let norm = residual.position_m.norm();
            if norm < 1e-6 {
                hold += column.norm();
            } else {
                pull += residual.position_m.normalize().dot(&column.fixed_rows::<3>(0));
            }
            size += column.norm();
        }
        assert!(pull.abs() <= hold + 2e-3 * size + 1e-9, "{}: {pull} {hold} {size}", e.parameter.name);
    }
}
