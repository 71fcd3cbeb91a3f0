//! Pearson's correlation of the sensor's points with the robot's profile, at many lags at once.
//!
//! The points lie on a grid. At lags of whole steps of it they ask for the same few values of the robot's profile: these are
//! looked up once, and a lag is a sum of products. Sums over several runs of points add up, each run at a lag of its own.

use super::profile::SpeedProfile;
use nalgebra::{DVector, DVectorView};

/// Steps of the sensor's profile from one point to the next. At 0.4 half-widths of the kernel from each other, points
/// still tell all that the smoothed speed holds.
const EVERY: usize = 4;

/// A lag within so many steps, half of them negative.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lags {
    /// Largest one, in steps.
    pub most: i64,
    /// Time from one lag to the next, and from one point to the next [s].
    pub step_s: f64,
}

impl Lags {
    /// All lags up to one [s].
    pub fn within(sensor: &SpeedProfile, most_s: f64) -> Lags {
        let step_s = sensor.step_s() * EVERY as f64;
        Lags { most: (most_s / step_s).ceil() as i64, step_s }
    }

    /// Lags that go further by so many seconds.
    pub fn further(self, by_s: f64) -> Lags {
        Lags { most: self.most + (by_s / self.step_s).ceil() as i64, ..self }
    }
}

/// The points of a profile that lags are tried on: time [s] and speed [m/s].
pub(crate) fn points(sensor: &SpeedProfile) -> Vec<(f64, f64)> {
    sensor.points(EVERY)
}

/// What correlation is made of.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sums {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    yy: f64,
    xy: f64,
}

impl Sums {
    /// One more point: measured and predicted.
    pub fn push(&mut self, x: f64, y: f64) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.yy += y * y;
        self.xy += x * y;
    }

    /// Those of other points too.
    pub fn add(&mut self, other: &Sums) {
        self.n += other.n;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.yy += other.yy;
        self.xy += other.xy;
    }

    /// Pearson's correlation; NaN where fewer than two fifths of so many points have a counterpart.
    pub fn correlation(&self, points: usize) -> f64 {
        let Sums { n, x, y, xx, yy, xy } = self;
        if *n < 0.4 * points as f64 || *n < 8.0 {
            return f64::NAN;
        }
        (xy - x * y / n) / ((xx - x * x / n) * (yy - y * y / n)).sqrt()
    }
}

/// Sums over points with the robot's speeds earlier by each lag, from the most negative to the largest. `robot_s` is the time
/// on the robot's clock at lag zero.
pub(crate) fn sums(
    points: &[(f64, f64)],
    robot: &SpeedProfile,
    robot_s: impl Fn(f64) -> f64,
    lags: Lags,
) -> Vec<Sums> {
    let count = 2 * lags.most as usize + 1;
    let mut sums = vec![Sums::default(); count];
    let on_grid = |a: &(f64, f64), b: &(f64, f64)| (b.0 - a.0 - lags.step_s).abs() < 1e-3 * lags.step_s;
    for run in points.chunk_by(on_grid) {
        let first_s = robot_s(run[0].0);
        let at = |k: usize| robot.at(first_s + (k as i64 - lags.most) as f64 * lags.step_s).map(|at| at.0);
        // What is not known counts as nothing.
        let predicted: Vec<Option<f64>> = (0..run.len() + count - 1).map(at).collect();
        let known: Vec<f64> = predicted.iter().map(|y| f64::from(y.is_some())).collect();
        let predicted: Vec<f64> = predicted.into_iter().map(Option::unwrap_or_default).collect();
        let [n, y, yy] = [
            running_sums(&known, |one| one),
            running_sums(&predicted, |y| y),
            running_sums(&predicted, |y| y * y),
        ];
        let measured = DVector::from_iterator(run.len(), run.iter().map(|point| point.1));
        let squares = measured.map(|x| x * x);
        for (from, sums) in (0..count).rev().zip(&mut sums) {
            let to = from + run.len();
            let [known, predicted] =
                [&known, &predicted].map(|of| DVectorView::from_slice(&of[from..to], run.len()));
            sums.add(&Sums {
                n: n[to] - n[from],
                x: measured.dot(&known),
                y: y[to] - y[from],
                xx: squares.dot(&known),
                yy: yy[to] - yy[from],
                xy: measured.dot(&predicted),
            });
        }
    }
    sums
}

/// Running sums: of the numbers before each, and of all.
fn running_sums(numbers: &[f64], of: fn(f64) -> f64) -> Vec<f64> {
    let mut sum = 0.0;
    let sums = numbers.iter().map(|number| {
        sum += of(*number);
        sum
    });
    std::iter::once(0.0).chain(sums).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn sums_at_every_lag_are_those_of_its_pairs(
            rate in 0.5..4.0f64, broken in any::<bool>(), from_s in 1.0..3.0f64, most_s in 0.05..0.8f64
        ) {
            let time_s: Vec<f64> =
                (0..800).map(|i| f64::from(i) * 0.01 + if broken && i >= 300 { 1.0 } else { 0.0 }).collect();
            let at = |t: &f64| Vector3::new((rate * t).sin(), (0.7 * rate * t).cos(), 0.3 * t);
            let position_m: Vec<Vector3<f64>> = time_s.iter().map(at).collect();
            let unbroken = if broken { vec![0..300, 300..800] } else { std::iter::once(0..800).collect() };
            let robot = SpeedProfile::new(&time_s, &position_m, &unbroken, 0.1, 0.01);
            let lags = Lags::within(&robot, most_s);
            let point = |k: i32| (from_s + f64::from(k) * lags.step_s, (f64::from(k) * 0.3).sin());
            let points: Vec<(f64, f64)> = (0..60).map(point).collect();
            for (k, found) in sums(&points, &robot, |t_s| t_s, lags).iter().enumerate() {
                let later_s = (k as i64 - lags.most) as f64 * lags.step_s;
                let mut own = Sums::default();
                for (t_s, x) in &points {
                    if let Some((y, _)) = robot.at(t_s - later_s) {
                        own.push(*x, y);
                    }
                }
                let numbers = |s: &Sums| [s.n, s.x, s.y, s.xx, s.yy, s.xy];
                for (a, b) in numbers(found).iter().zip(numbers(&own)) {
                    prop_assert!((a - b).abs() < 1e-6, "{:?} {:?}", found, own);
                }
            }
        }
    }
}
