//! How late the sensor's clock still is, by the motion itself: an error along the velocity is an error of time.

use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Turning point of Huber's loss, in robust standard deviations of the errors.
const HUBER: f64 = 1.345;

/// The tip at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Passing<'a> {
    /// What neighbouring moments share: intervals treat groups as independent.
    pub group: &'a str,
    /// Velocity of the predicted tip [m/s].
    pub velocity_mps: Vector3<f64>,
    /// Measured minus predicted [m].
    pub error_m: Vector3<f64>,
}

/// A lateness of the sensor's stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lateness {
    /// How much later than thought the stamps are [s].
    pub late_s: f64,
    /// Its standard error [s].
    pub sigma_s: f64,
}

/// The lateness that explains most of the errors: with stamps late by d, measured - predicted = -d velocity, so that
/// `d = -sum w v.e / sum w v.v`, w Huber's weights on the size of what is left (two rounds). Its standard error is
/// cluster-robust. `None` where nothing moves.
pub fn lateness(passings: &[Passing<'_>]) -> Option<Lateness> {
    let mut late_s = 0.0;
    let mut weights = vec![1.0; passings.len()];
    let moved = |weights: &[f64]| -> f64 {
        passings.iter().zip(weights).map(|(p, w)| w * p.velocity_mps.norm_squared()).sum()
    };
    for _ in 0..3 {
        let square = moved(&weights);
        if !(square.is_finite() && square > 0.0) {
            return None;
        }
        let along: f64 = passings.iter().zip(&weights).map(|(p, w)| w * p.velocity_mps.dot(&p.error_m)).sum();
        late_s = -along / square;
        weights = huber_weights(passings, late_s);
    }
    let mut groups: BTreeMap<&str, f64> = BTreeMap::new();
    for (p, w) in passings.iter().zip(&weights) {
        let left_m = p.error_m + late_s * p.velocity_mps;
        *groups.entry(p.group).or_default() += w * p.velocity_mps.dot(&left_m);
    }
    let spread: f64 = groups.values().map(|score| score * score).sum::<f64>().sqrt();
    let lone = groups.len() < 2;
    Some(Lateness { late_s, sigma_s: if lone { f64::INFINITY } else { spread / moved(&weights) } })
}

fn huber_weights(passings: &[Passing<'_>], late_s: f64) -> Vec<f64> {
    let left: Vec<f64> = passings.iter().map(|p| (p.error_m + late_s * p.velocity_mps).norm()).collect();
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
                let error_m = -0.012 * velocity_mps + beside_m + wild_m;
                Passing { group: &names[(i / 100) as usize], velocity_mps, error_m }
            })
            .collect();
        let found = lateness(&passings).expect("it moves");
        assert!((found.late_s - 0.012).abs() < 3.0 * found.sigma_s, "{found:?}");
        assert!(found.sigma_s < 5e-4, "{found:?}");
    }

    #[test]
    fn what_stands_still_tells_no_time() {
        let still = Passing { group: "a", velocity_mps: Vector3::zeros(), error_m: Vector3::x() };
        assert_eq!(lateness(&[still]), None);
        assert_eq!(lateness(&[]), None);
    }
}
