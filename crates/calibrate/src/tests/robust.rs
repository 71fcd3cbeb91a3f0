use super::rig;
use crate::fit;
use crate::{Fit, FitConfig, Objective};
use armcal_core::{Code, Observation, Reference};
use nalgebra::Vector3;

fn shifted(observations: &[Observation], every: usize, by_m: f64) -> Vec<Observation> {
    let mut rng = rig::rng(99);
    let mut out = observations.to_vec();
    for o in out.iter_mut().step_by(every) {
        let direction = rig::gauss3(&mut rng, 1.0).normalize();
        if let Reference::Tracked { position_m, .. } = &mut o.reference {
            *position_m += direction * by_m;
        }
    }
    out
}

/// Largest difference in standard deviations, over the determined parameters.
fn moved(a: &Fit, b: &Fit) -> f64 {
    let free = a.estimates.iter().zip(&b.estimates).filter(|(e, _)| e.determined);
    free.map(|(x, y)| (x.value - y.value).abs() / x.sigma).fold(0.0, f64::max)
}

#[test]
fn five_percent_of_outliers_do_not_move_the_answer() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(3);
    let truth = rig::planted(&model, &mut rng, 0.9);
    let clean = rig::tracked(&model, &truth, 200, &mut rng);
    let dirty = shifted(&clean, 20, 0.05);
    let config = FitConfig::default();
    let (with, without) = (fit(&model, &dirty, &config).unwrap(), fit(&model, &clean, &config).unwrap());
    let plain = FitConfig { objective: Objective::LeastSquares, ..config };
    let square = fit(&model, &dirty, &plain).unwrap();
    println!(
        "moved by {:.2} sd (robust), {:.1} sd (least squares); scale {:.3}",
        moved(&without, &with),
        moved(&without, &square),
        with.sigma_scale
    );
    assert!(moved(&without, &with) < 1.0);
    assert!(moved(&without, &square) > 5.0);
    assert!((0.9..1.2).contains(&with.sigma_scale));
    for (j, weight) in with.weights.iter().enumerate() {
        assert_eq!(*weight < 0.05, j % 20 == 0, "observation {j}: {weight}");
    }
    assert!(with.warnings.iter().any(|w| w.code == Code::Outliers && w.message.starts_with("10 ")));
}

#[test]
fn turning_the_measuring_frame_changes_nothing() {
    // The loss is on the norm: the same data seen from a turned sensor give the same arm.
    let turn = armcal_core::Pose::rotation(Vector3::new(0.3, -1.1, 2.0));
    let mut rng = rig::rng(4);
    let straight = rig::tracked_model();
    let truth = rig::planted(&straight, &mut rng, 0.9);
    let observations = shifted(&rig::tracked(&straight, &truth, 80, &mut rng), 20, 0.05);
    let turned: Vec<Observation> = observations
        .iter()
        .map(|o| {
            let mut o = o.clone();
            if let Reference::Tracked { position_m, .. } = &mut o.reference {
                *position_m = turn.rotation * *position_m;
            }
            o
        })
        .collect();
    let other = rig::model(armcal_model::Frame::given("base", turn), Vec::new());
    let a = fit(&straight, &observations, &FitConfig::default()).unwrap();
    let b = fit(&other, &turned, &FitConfig::default()).unwrap();
    assert!(moved(&a, &b) < 1e-4, "{}", moved(&a, &b));
}

#[test]
fn declared_noise_too_small_widens_the_intervals() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(8);
    let truth = rig::planted(&model, &mut rng, 0.5);
    let mut observations = rig::tracked(&model, &truth, 100, &mut rng);
    let honest = fit(&model, &observations, &FitConfig::default()).unwrap();
    observations.iter_mut().for_each(|o| o.covariance_m2 /= 9.0);
    let boasting = fit(&model, &observations, &FitConfig::default()).unwrap();
    assert!((boasting.sigma_scale / honest.sigma_scale - 3.0).abs() < 0.05);
    for (a, b) in honest.estimates.iter().zip(&boasting.estimates).filter(|(a, _)| a.determined) {
        assert!((a.sigma / b.sigma - 1.0).abs() < 0.1, "{}: {} {}", a.parameter.name, a.sigma, b.sigma);
    }
    observations.iter_mut().for_each(|o| o.covariance_m2 *= 81.0);
    let modest = fit(&model, &observations, &FitConfig::default()).unwrap();
    // Noise declared three times too large is taken at its word: intervals do not shrink.
    assert!(modest.sigma_scale < 0.4);
    let a2 = |f: &Fit| f.estimates.iter().find(|e| e.parameter.name == "joint2.a").unwrap().sigma;
    assert!((2.3..3.3).contains(&(a2(&modest) / a2(&honest))), "{}", a2(&modest) / a2(&honest));
}

#[test]
fn data_without_noise_are_met_exactly() {
    let model = rig::tracked_model();
    let mut rng = rig::rng(12);
    let truth = rig::planted(&model, &mut rng, 0.5);
    let mut observations = rig::tracked(&model, &truth, 50, &mut rng);
    for o in &mut observations {
        let position_m = model.predicted_tip_in_world(&truth, o);
        o.reference = Reference::Tracked { position_m, orientation: None, orientation_sigma_rad: 0.0 };
    }
    for objective in [Objective::Robust, Objective::LeastSquares, Objective::Paper] {
        let found = fit(&model, &observations, &FitConfig { objective, ..FitConfig::default() }).unwrap();
        let worst = observations
            .iter()
            .map(|o| model.residual(&found.values(), o).position_m.norm())
            .fold(0.0, f64::max);
        println!("{objective:?}: worst {worst:.1e} m, scale {:.1e}", found.sigma_scale);
        // Priors hold the answer back by a part in a thousand of the noise.
        assert!(
            worst < 1e-5
                && found.sigma_scale < 0.03
                && found.covariance.dense().iter().all(|v| v.is_finite())
        );
    }
}
