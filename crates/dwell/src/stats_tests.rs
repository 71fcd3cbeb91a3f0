use super::*;
use crate::testkit::{Random, ar1};

#[test]
fn effective_samples_follow_the_closed_form_of_ar1() {
    // n_eff = n (1 - rho) / (1 + rho); median over seeds, long series.
    for rho in [0.0, 0.5, 0.9] {
        let n = 4000;
        let found: Vec<f64> =
            (0..40).map(|seed| effective_samples(&ar1(&mut Random::new(seed), n, rho, 1.0))).collect();
        let truth = n as f64 * (1.0 - rho) / (1.0 + rho);
        let ratio = median(&found) / truth;
        assert!((0.85..1.1).contains(&ratio), "rho {rho}: {ratio:.3} of the closed form");
    }
}

#[test]
fn long_series_are_blocked_without_changing_the_answer() {
    let n = 100_000;
    for rho in [0.0, 0.9] {
        let found: Vec<f64> =
            (0..8).map(|seed| effective_samples(&ar1(&mut Random::new(seed), n, rho, 1.0))).collect();
        let ratio = median(&found) / (n as f64 * (1.0 - rho) / (1.0 + rho));
        assert!((0.85..1.1).contains(&ratio), "rho {rho}: {ratio:.3}");
    }
}

#[test]
fn two_sigma_cover_the_mean_of_a_dwell() {
    // 100 readings, the length of a one-second dwell; a Student-like loss at high correlation is expected.
    for (rho, least) in [(0.0, 0.93), (0.5, 0.91), (0.8, 0.88)] {
        let inside = (0..500)
            .filter(|&seed| {
                let x: Vec<f64> =
                    ar1(&mut Random::new(seed), 100, rho, 1e-4).iter().map(|v| v + 0.7).collect();
                let m = Mean::of(&x, 0.0).expect("values");
                (m.mean - 0.7).abs() < 2.0 * m.sigma
            })
            .count();
        let share = inside as f64 / 500.0;
        assert!((least..=0.99).contains(&share), "rho {rho}: {share}");
    }
}

#[test]
fn a_constant_reading_keeps_the_quantisation_error() {
    let m = Mean::of(&[0.5; 50], 1e-3).expect("values");
    assert_eq!((m.mean, m.spread, m.effective), (0.5, 0.0, None));
    assert!((m.sigma - 1e-3 / 12f64.sqrt()).abs() < 1e-15);
}

#[test]
fn dithered_quantised_readings_average_to_the_truth() {
    let step = 1e-3;
    let mut inside = 0;
    for seed in 0..300 {
        let mut r = Random::new(seed);
        let truth = 0.3 + r.uniform() * step;
        let x: Vec<f64> =
            (0..100).map(|_| ((truth + 0.6 * step * r.normal()) / step).round() * step).collect();
        let m = Mean::of(&x, step).expect("values");
        assert!(m.sigma < 0.15 * step);
        inside += usize::from((m.mean - truth).abs() < 2.0 * m.sigma);
    }
    assert!((276..=297).contains(&inside), "{inside} of 300");
}

#[test]
fn outliers_barely_move_the_mean() {
    let mut x = ar1(&mut Random::new(3), 95, 0.0, 1e-4);
    x.extend([1.0; 5]);
    let m = Mean::of(&x, 0.0).expect("values");
    assert!(m.mean.abs() < 1e-4, "{}", m.mean);
    assert!(m.sigma < 1e-4);
}

#[test]
fn the_step_of_counts_is_found_and_of_noise_is_not() {
    let mut r = Random::new(1);
    let step = std::f64::consts::TAU / 4096.0;
    let counts: Vec<f64> =
        (0..500).map(|i| (i as f64 * 0.37 + 3.0 * r.normal()).round() * step + 0.1).collect();
    let found = quantisation_step(&counts).expect("quantised");
    assert!((found / step - 1.0).abs() < 1e-6);
    let noise: Vec<f64> = (0..500).map(|i| (f64::from(i) * 0.01).sin() + 1e-5 * r.normal()).collect();
    assert_eq!(quantisation_step(&noise), None);
    assert_eq!(quantisation_step(&[1.0; 100]), None);
}
