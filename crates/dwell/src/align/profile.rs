//! Speed of a point over time, smoothed by one and the same kernel for every stream.

use armcal_core::robust::percentile_in;
use nalgebra::Vector3;
use std::ops::Range;

/// Smoothed speed [m/s] on a uniform grid, in unbroken stretches.
///
/// The velocity at `t` is the mean of the position over `[t, t + h]` minus its mean over `[t - h, t]`,
/// divided by `h`: the true velocity under a triangular kernel of length `2 h`. Both means are exact
/// integrals of the broken line through the samples, so the kernel is the same whatever the rate, the
/// jitter or the phase of a stream, and two streams of one motion agree; central differences of single
/// samples would not, and would be mostly noise.
#[derive(Clone)]
pub(crate) struct SpeedProfile {
    stretches: Vec<Stretch>,
    step_s: f64,
    /// Grid points in a second [1/s].
    per_s: f64,
}

#[derive(Clone)]
struct Stretch {
    start_s: f64,
    speed_m_s: Vec<f64>,
}

impl SpeedProfile {
    /// Smooths positions [m] at times [s]; each range of rows is an unbroken stretch.
    pub(crate) fn new(
        time_s: &[f64],
        position_m: &[Vector3<f64>],
        unbroken: &[Range<usize>],
        half_width_s: f64,
        step_s: f64,
    ) -> SpeedProfile {
        let stretches = unbroken
            .iter()
            .filter_map(|rows| {
                let path = Path::new(&time_s[rows.clone()], &position_m[rows.clone()]);
                path.speeds(half_width_s, step_s)
            })
            .collect();
        SpeedProfile { stretches, step_s, per_s: 1.0 / step_s }
    }

    /// Speed [m/s] and its rate of change [m/s^2] at a time; none where the stream is broken.
    pub(crate) fn at(&self, t_s: f64) -> Option<(f64, f64)> {
        let stretch = &self.stretches[self.stretches.partition_point(|s| s.start_s <= t_s).checked_sub(1)?];
        let u = (t_s - stretch.start_s) * self.per_s;
        let i = u as usize;
        let v = &stretch.speed_m_s;
        if i == 0 || i + 2 >= v.len() {
            return None;
        }
        // Catmull and Rom's cubic: smooth enough for Gauss-Newton, exact at the grid points.
        let (a, b, c, d) = (v[i - 1], v[i], v[i + 1], v[i + 2]);
        let (k1, k2, k3) = (0.5 * (c - a), a - 2.5 * b + 2.0 * c - 0.5 * d, 0.5 * (d - a) + 1.5 * (b - c));
        let x = u - i as f64;
        let value = b + x * (k1 + x * (k2 + x * k3));
        Some((value, (k1 + x * (2.0 * k2 + x * 3.0 * k3)) * self.per_s))
    }

    /// Time from one grid point to the next [s].
    pub(crate) fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Every `every`-th grid point: time [s] and speed [m/s].
    pub(crate) fn points(&self, every: usize) -> Vec<(f64, f64)> {
        let every = every.max(1);
        let mut points =
            Vec::with_capacity(self.stretches.iter().map(|s| s.speed_m_s.len().div_ceil(every)).sum());
        for s in &self.stretches {
            let grid = s.speed_m_s.iter().enumerate().step_by(every);
            points.extend(grid.map(|(i, v)| (s.start_s + i as f64 * self.step_s, *v)));
        }
        points
    }

    /// The logarithm of the speed over `still_m_s`, flat below: `ln(1 + (v / still)^2) / 2`.
    pub(crate) fn logarithm(&self, still_m_s: f64) -> SpeedProfile {
        let of = |v: &f64| 0.5 * (v / still_m_s).powi(2).ln_1p();
        let stretches = self
            .stretches
            .iter()
            .map(|s| Stretch { start_s: s.start_s, speed_m_s: s.speed_m_s.iter().map(of).collect() });
        SpeedProfile { stretches: stretches.collect(), ..*self }
    }

    /// The `p`-quantile of the speeds [m/s]; NaN when there are none.
    pub(crate) fn quantile_m_s(&self, p: f64) -> f64 {
        let mut all: Vec<f64> = self.stretches.iter().map(|s| &s.speed_m_s[..]).collect::<Vec<_>>().concat();
        percentile_in(&mut all, p)
    }
}

/// A broken line through samples, with the running integral of the position.
struct Path<'a> {
    time_s: &'a [f64],
    position_m: Vec<Vector3<f64>>,
    integral: Vec<Vector3<f64>>,
}

impl<'a> Path<'a> {
    fn new(time_s: &'a [f64], absolute_m: &[Vector3<f64>]) -> Path<'a> {
        let origin = absolute_m.first().copied().unwrap_or_default();
        let position_m: Vec<Vector3<f64>> = absolute_m.iter().map(|p| p - origin).collect();
        let mut sum = Vector3::zeros();
        let mut integral = Vec::with_capacity(time_s.len());
        integral.push(sum);
        for (t, p) in time_s.windows(2).zip(position_m.windows(2)) {
            sum += 0.5 * (p[0] + p[1]) * (t[1] - t[0]);
            integral.push(sum);
        }
        Path { time_s, position_m, integral }
    }

    fn speeds(&self, h_s: f64, step_s: f64) -> Option<Stretch> {
        let start_s = self.time_s.first()? + h_s;
        let steps = ((self.time_s.last()? - h_s - start_s) / step_s).floor();
        if steps.is_nan() || steps < 4.0 {
            return None;
        }
        let (mut behind, mut here, mut ahead) = (0, 0, 0);
        let speed_m_s: Vec<f64> = (0..=steps as usize)
            .map(|k| {
                let t = start_s + k as f64 * step_s;
                let second = self.integral_at(t + h_s, &mut ahead) - 2.0 * self.integral_at(t, &mut here)
                    + self.integral_at(t - h_s, &mut behind);
                second.norm() / (h_s * h_s)
            })
            .collect();
        speed_m_s.iter().all(|v| v.is_finite()).then_some(Stretch { start_s, speed_m_s })
    }

    /// Integral of the position up to `t`; `row` walks forward with `t`.
    fn integral_at(&self, t_s: f64, row: &mut usize) -> Vector3<f64> {
        while *row + 2 < self.time_s.len() && self.time_s[*row + 1] <= t_s {
            *row += 1;
        }
        let (t0, t1) = (self.time_s[*row], self.time_s[*row + 1]);
        let (p0, p1) = (self.position_m[*row], self.position_m[*row + 1]);
        let dt = t_s - t0;
        self.integral[*row] + dt * p0 + (p1 - p0) * (0.5 * dt * dt / (t1 - t0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point that swings along x, sampled irregularly.
    fn swing(rate_hz: f64, jitter: f64) -> SpeedProfile {
        let n = (20.0 * rate_hz) as usize;
        let time_s: Vec<f64> =
            (0..n).map(|i| (i as f64 + jitter * (i as f64 * 12.9898).sin()) / rate_hz).collect();
        let position_m: Vec<Vector3<f64>> =
            time_s.iter().map(|t| Vector3::new(5.0 + 0.1 * (3.0 * t).sin(), 1.0, -2.0)).collect();
        SpeedProfile::new(&time_s, &position_m, std::slice::from_ref(&(0..n)), 0.1, 0.01)
    }

    #[test]
    fn a_swing_has_the_speed_of_the_triangular_kernel() {
        // Under the kernel a sine of rate w keeps sinc^2(w h / 2) of its amplitude.
        let x: f64 = 3.0 * 0.1 / 2.0;
        let kept = (x.sin() / x).powi(2);
        let profile = swing(1000.0, 0.0);
        for t in [1.0, 2.345, 7.89, 15.0] {
            let (speed, rate) = profile.at(t).expect("inside");
            let velocity = 0.3 * kept * (3.0 * t).cos();
            let acceleration = -0.9 * kept * (3.0 * t).sin() * velocity.signum();
            assert!((speed - velocity.abs()).abs() < 2e-5, "{speed} {velocity}");
            assert!((rate - acceleration).abs() < 2e-3, "{rate} {acceleration}");
        }
    }

    #[test]
    fn rate_and_jitter_of_the_stream_do_not_matter() {
        let (fast, slow) = (swing(400.0, 0.0), swing(50.0, 0.4));
        for k in 100..1800 {
            let t = f64::from(k) * 0.01 + 0.003;
            let (a, b) = (fast.at(t).expect("inside").0, slow.at(t).expect("inside").0);
            assert!((a - b).abs() < 5e-4, "{a} {b} at {t}");
        }
    }

    #[test]
    fn a_broken_stream_has_no_speed_in_the_break() {
        let time_s: Vec<f64> =
            (0..400).map(|i| f64::from(i) * 0.01 + if i >= 200 { 5.0 } else { 0.0 }).collect();
        let p = vec![Vector3::zeros(); 400];
        let profile = SpeedProfile::new(&time_s, &p, &[0..200, 200..400], 0.1, 0.01);
        assert!(profile.at(1.0).is_some() && profile.at(8.0).is_some());
        assert!(profile.at(3.0).is_none() && profile.at(-1.0).is_none() && profile.at(1e9).is_none());
    }
}
