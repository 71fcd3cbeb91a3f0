//! How late the sensor's clock still is, by the motion itself: an error along the velocity is an error of time.

use nalgebra::{Matrix2, Vector2, Vector3};
use std::collections::BTreeMap;

/// Turning point of Huber's loss, in robust standard deviations of the errors.
const HUBER: f64 = 1.345;
/// Rounds of reweighting.
const ROUNDS: usize = 4;

/// The tip at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Passing<'a> {
    /// What neighbouring moments share: intervals treat groups as independent.
    pub group: &'a str,
    /// Time since a reference [s].
    pub since_s: f64,
    /// Velocity of the predicted tip [m/s].
    pub velocity_mps: Vector3<f64>,
    /// Measured minus predicted [m].
    pub error_m: Vector3<f64>,
}

/// How much later than thought the sensor's stamps are: `late_s + drift (t - reference - since_s)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lateness {
    /// Where the two errors below are about uncorrelated: time since the reference [s].
    pub since_s: f64,
    /// Lateness there [s].
    pub late_s: f64,
    /// Its standard error [s].
    pub sigma_s: f64,
    /// Growth of the lateness over time.
    pub drift: f64,
    /// Its standard error.
    pub drift_sigma: f64,
}

/// The lateness that explains most of the errors: with stamps late by d, measured - predicted = -d velocity. Least squares
/// for offset and drift, Huber's weights on the size of what is left, cluster-robust standard errors. `None` where nothing
/// moves.
pub fn lateness(passings: &[Passing<'_>]) -> Option<Lateness> {
    let mut weights = vec![1.0; passings.len()];
    let moved = |weights: &[f64], of: &dyn Fn(&Passing<'_>) -> f64| -> f64 {
        passings.iter().zip(weights).map(|(p, w)| w * p.velocity_mps.norm_squared() * of(p)).sum()
    };
    let all = moved(&weights, &|_| 1.0);
    let since_s = moved(&weights, &|p| p.since_s) / all;
    if !since_s.is_finite() {
        return None;
    }
    let row = |p: &Passing<'_>| Vector2::new(1.0, p.since_s - since_s);
    let mut late = Vector2::zeros();
    let mut inverse = Matrix2::zeros();
    for _ in 0..ROUNDS {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for (p, w) in passings.iter().zip(&weights) {
            let x = row(p);
            normal += w * p.velocity_mps.norm_squared() * x * x.transpose();
            right -= w * p.velocity_mps.dot(&p.error_m) * x;
        }
        inverse = normal.try_inverse()?;
        late = inverse * right;
        weights = huber_weights(passings, &|p| late.dot(&row(p)));
    }
    let mut groups: BTreeMap<&str, Vector2<f64>> = BTreeMap::new();
    for (p, w) in passings.iter().zip(&weights) {
        let left_m = p.error_m + late.dot(&row(p)) * p.velocity_mps;
        *groups.entry(p.group).or_default() += w * p.velocity_mps.dot(&left_m) * row(p);
    }
    let spread: Matrix2<f64> = groups.values().map(|score| score * score.transpose()).sum();
    let covariance = inverse * spread * inverse;
    let sigma = |k: usize| if groups.len() > 2 { covariance[(k, k)].sqrt() } else { f64::INFINITY };
    Some(Lateness { since_s, late_s: late[0], sigma_s: sigma(0), drift: late[1], drift_sigma: sigma(1) })
}

fn huber_weights(passings: &[Passing<'_>], late_s: &dyn Fn(&Passing<'_>) -> f64) -> Vec<f64> {
    let left: Vec<f64> = passings.iter().map(|p| (p.error_m + late_s(p) * p.velocity_mps).norm()).collect();
    let limit_m = HUBER * armcal_core::robust::median(&left);
    left.iter().map(|m| if *m > limit_m { limit_m / m } else { 1.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_clock_is_found_through_an_offset_and_outliers() {
        let names: Vec<String> = (0..40).map(|g| g.to_string()).collect();
        let passings: Vec<Passing<'_>> = (0..4000)
            .map(|i| {
                let a = f64::from(i) * 0.01;
                let velocity_mps = Vector3::new(0.3 * a.cos(), 0.2 * (1.7 * a).sin(), 0.1 * (0.6 * a).cos());
                // 1 mm beside, which no clock explains, and a wild frame now and then.
                let beside_m = Vector3::new(0.0, 0.0, 1e-3);
                let wild_m = if i % 97 == 0 { Vector3::new(0.05, 0.0, 0.0) } else { Vector3::zeros() };
                // 12 ms late in the middle, 50 us a second more.
                let since_s = 0.05 * f64::from(i);
                let late_s = 0.012 + 5e-5 * (since_s - 100.0);
                let error_m = -late_s * velocity_mps + beside_m + wild_m;
                Passing { group: &names[(i / 100) as usize], since_s, velocity_mps, error_m }
            })
            .collect();
        let found = lateness(&passings).expect("it moves");
        let planted_s = 0.012 + 5e-5 * (found.since_s - 100.0);
        assert!((found.late_s - planted_s).abs() < 3.0 * found.sigma_s, "{found:?}");
        assert!((found.drift - 5e-5).abs() < 3.0 * found.drift_sigma, "{found:?}");
        assert!(found.sigma_s < 5e-4 && found.drift_sigma < 1e-5, "{found:?}");
    }

    #[test]
    fn what_stands_still_tells_no_time() {
        let still =
            Passing { group: "a", since_s: 0.0, velocity_mps: Vector3::zeros(), error_m: Vector3::x() };
        assert_eq!(lateness(&[still]), None);
        assert_eq!(lateness(&[]), None);
    }
}
