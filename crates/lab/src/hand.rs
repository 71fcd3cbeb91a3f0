//! The hand that guides the tip: smooth, but never quite still.

use crate::random::Stream;
use nalgebra::Vector3;

/// Smooth random motion of unit variance per axis: white noise through two first-order low passes.
#[derive(Debug, Clone)]
pub struct Tremor {
    draw: Stream,
    keep: f64,
    scale: f64,
    inner: Vector3<f64>,
    outer: Vector3<f64>,
}

impl Tremor {
    /// Tremor with correlation time `time_s`, sampled every `step_s`.
    pub fn new(draw: Stream, time_s: f64, step_s: f64) -> Tremor {
        let keep = (-step_s / time_s).exp();
        // Variance of a unit AR(1) process after `y += (1 - a)(x - y)`: (1 + a^2) / (1 + a)^2.
        let scale = (1.0 + keep) / (1.0 + keep * keep).sqrt();
        Tremor { draw, keep, scale, inner: Vector3::zeros(), outer: Vector3::zeros() }
    }

    /// The next value.
    pub fn sample(&mut self) -> Vector3<f64> {
        let a = self.keep;
        self.inner = self.inner * a + self.draw.normal3() * (1.0 - a * a).sqrt();
        self.outer = self.outer * a + self.inner * (1.0 - a);
        self.outer * self.scale
    }
}

/// The way from 0 to 1 of a practised hand: minimum jerk (Flash and Hogan 1985). `s` is time as a share.
pub fn minimum_jerk(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Purpose;

    #[test]
    fn tremor_has_unit_variance_and_is_smooth() {
        let mut tremor = Tremor::new(Stream::new(1, Purpose::Hand, 0), 0.03, 0.002);
        let values: Vec<f64> = (0..200_000).map(|_| tremor.sample().x).collect();
        let variance = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        assert!((variance - 1.0).abs() < 0.05, "{variance}");
        let steps = values.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / values.len() as f64;
        // A first-order process would take steps of variance 2(1 - a) = 0.129.
        assert!(steps < 0.01, "{steps}");
    }

    #[test]
    fn a_hand_movement_starts_and_ends_at_rest() {
        let d = 1e-4;
        assert_eq!((minimum_jerk(0.0), minimum_jerk(1.0), minimum_jerk(0.5)), (0.0, 1.0, 0.5));
        assert!(minimum_jerk(d) / d < 1e-6 && (1.0 - minimum_jerk(1.0 - d)) / d < 1e-6);
    }
}
