//! Fine estimate: robust Gauss-Newton on offset and drift.
//!
//! ```text
//! r_k = m_k - c - g p(t_k - o - d (t_k - t_ref))
//! ```
//! `m` is the measured and `p` the predicted speed (or the logarithm of either), `g` and `c` a gain and a
//! level without meaning of their own. What the nominal model's errors do to offset and drift, and how far both
//! may be off, is worked out from here in [`super::spread`].

use armcal_core::robust::mad_sigma;
use nalgebra::{Matrix4, Vector4};

use super::profile::SpeedProfile;
use crate::stats::HUBER_K;

/// Fewest movements from which errors can be told.
pub(crate) const MIN_MOVEMENTS: usize = 6;

const MAX_ITERATIONS: usize = 60;

/// Times the scale of the residuals is taken anew.
const SCALE_ROUNDS: usize = 3;
/// A tenth of what stamps are believed to.
const CONVERGED_S: f64 = 1e-7;

/// Largest step of an iteration [s]: beyond a peak of the speed the linearisation means nothing.
const LONGEST_STEP_S: f64 = 0.1;

/// Where the iteration starts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    pub offset_s: f64,
    pub drift: f64,
}

/// A point of the sensor's profile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub t_s: f64,
    pub measured: f64,
    /// Whether the tip moves.
    pub moving: bool,
    /// Movement it belongs to.
    pub movement: usize,
    /// How much later its stamp is than those of the others, where a clock was found to have been set [s].
    pub late_s: f64,
}

/// A point with its residual, and what offset, scaled drift, gain and level change in it.
pub(crate) struct Row {
    pub point: Point,
    pub residual: f64,
    pub jacobian: Vector4<f64>,
    pub weight: f64,
    /// Time on the robot's clock [s].
    pub robot_s: f64,
}

/// The problem: points grouped in movements, and where drift is measured from.
pub(crate) struct Problem<'a> {
    robot: &'a SpeedProfile,
    points: &'a [Point],
    /// Of each point its time were its clock never set [s], and how far that lies from the reference in units of `half_s`.
    times: Vec<[f64; 2]>,
    /// Time from the reference to the far end of the recording [s].
    pub half_s: f64,
    /// The drift, where it is not estimated.
    pub fixed_drift: Option<f64>,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        robot: &'a SpeedProfile,
        points: &'a [Point],
        reference_s: f64,
        fixed_drift: Option<f64>,
    ) -> Problem<'a> {
        let half_s = points.iter().map(|p| (p.t_s - reference_s).abs()).fold(1e-3, f64::max);
        let time = |p: &Point| {
            let t_s = p.t_s - p.late_s;
            [t_s, (t_s - reference_s) / half_s]
        };
        Problem { robot, points, times: points.iter().map(time).collect(), half_s, fixed_drift }
    }

    /// Iterates from the start to offset [s], drift in seconds at the far end of the recording, gain and level;
    /// `None` when the normal equations are singular.
    pub(crate) fn solve(&self, start: Start) -> Option<Vector4<f64>> {
        let drift_s = self.fixed_drift.unwrap_or(start.drift) * self.half_s;
        let mut state = Vector4::new(start.offset_s, drift_s, 1.0, 0.0);
        (state.z, state.w) = self.first_gain(&state)?;
        for _ in 0..SCALE_ROUNDS {
            state = self.descend(state, self.huber_limit(&state))?;
        }
        Some(state)
    }

    /// The rows at a state, weighted by Huber.
    pub(crate) fn weighted_rows(&self, state: &Vector4<f64>) -> Vec<Row> {
        self.rows(state, self.huber_limit(state)).collect()
    }

    /// Times of the points on the robot's clock at a state [s].
    pub(crate) fn robot_times_s(&self, state: &Vector4<f64>) -> impl Iterator<Item = f64> {
        self.times.iter().map(|times| robot_s(state, times))
    }

    /// Gauss-Newton on Huber's cost with a fixed limit, steps halved until the cost falls.
    fn descend(&self, mut state: Vector4<f64>, limit: f64) -> Option<Vector4<f64>> {
        let mut sums = self.sums(&state, limit);
        for _ in 0..MAX_ITERATIONS {
            let mut step = sums.normal.lu().solve(&sums.gradient)?;
            step *= (LONGEST_STEP_S / step.x.abs().max(step.y.abs()).max(LONGEST_STEP_S)).min(1.0);
            loop {
                let (next, longest_s) = (state + step, step.x.abs().max(step.y.abs()));
                let next_sums = self.sums(&next, limit);
                if next_sums.cost < sums.cost {
                    (state, sums) = (next, next_sums);
                } else if longest_s > CONVERGED_S {
                    step *= 0.5;
                    continue;
                }
                if longest_s <= CONVERGED_S {
                    return Some(state);
                }
                break;
            }
        }
        Some(state)
    }

    /// Straight line of measured against predicted.
    fn first_gain(&self, state: &Vector4<f64>) -> Option<(f64, f64)> {
        let (mut n, mut m, mut p, mut mp, mut pp) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (point, times) in self.points.iter().zip(&self.times) {
            if let Some((predicted, _)) = self.robot.at(robot_s(state, times)) {
                n += 1.0;
                m += point.measured;
                p += predicted;
                mp += point.measured * predicted;
                pp += predicted * predicted;
            }
        }
        let gain = (mp - m * p / n) / (pp - p * p / n);
        (gain.is_finite() && gain > 0.0).then_some((gain, (m - gain * p) / n))
    }

    fn rows(&self, state: &Vector4<f64>, limit: f64) -> impl Iterator<Item = Row> {
        let state = *state;
        self.points.iter().zip(&self.times).filter_map(move |(point, times)| {
            let robot_s = robot_s(&state, times);
            let (p, rate) = self.robot.at(robot_s)?;
            let by_offset = -state.z * rate;
            let far = if self.fixed_drift.is_some() { 0.0 } else { times[1] };
            let jacobian = Vector4::new(by_offset, by_offset * far, p, 1.0);
            let residual = point.measured - state.z * p - state.w;
            let weight = if residual.abs() > limit { limit / residual.abs() } else { 1.0 };
            Some(Row { point: *point, residual, jacobian, weight, robot_s })
        })
    }

    /// Huber's limit in the scale of the moving rows: the many at rest agree far better and tell nothing of
    /// time.
    fn huber_limit(&self, state: &Vector4<f64>) -> f64 {
        let moving = self.rows(state, f64::INFINITY).filter(|r| r.point.moving).map(|r| r.residual);
        let limit = HUBER_K * mad_sigma(&moving.collect::<Vec<f64>>());
        if limit > 0.0 { limit } else { f64::INFINITY }
    }

    fn sums(&self, state: &Vector4<f64>, limit: f64) -> Sums {
        let (mut normal, mut gradient) = (Matrix4::zeros(), Vector4::zeros());
        let (mut loss, mut rows) = (0.0, 0.0);
        for r in self.rows(state, limit) {
            let weighted = r.weight * r.jacobian;
            // The lower half, which is all that a symmetric matrix has.
            for (k, weighted) in weighted.iter().enumerate() {
                (k..4).for_each(|l| normal[(l, k)] += weighted * r.jacobian[l]);
            }
            gradient += r.residual * weighted;
            let size = r.residual.abs();
            loss += if size <= limit { 0.5 * size * size } else { limit * (size - 0.5 * limit) };
            rows += 1.0;
        }
        normal.fill_upper_triangle_with_lower_triangle();
        if self.fixed_drift.is_some() {
            normal[(1, 1)] = 1.0;
        }
        Sums { normal, gradient, cost: loss / f64::max(rows, 1.0) }
    }
}

/// The time of a point on the robot's clock [s].
fn robot_s(state: &Vector4<f64>, [t_s, far]: &[f64; 2]) -> f64 {
    t_s - state.x - state.y * far
}

/// Normal equations of all rows, and the mean of Huber's loss: the number of rows that find a counterpart changes with the
/// state.
struct Sums {
    normal: Matrix4<f64>,
    gradient: Vector4<f64>,
    cost: f64,
}

/// Groups points into movements: cut at rest once `shortest_s` long, and anywhere at three times that.
pub(crate) fn group_movements(points: &[(f64, f64)], moving_above: f64, shortest_s: f64) -> Vec<Point> {
    let (mut began_s, mut movement) = (f64::NEG_INFINITY, 0);
    let mut grouped: Vec<Point> = Vec::with_capacity(points.len());
    for &(t_s, measured) in points {
        let moving = measured > moving_above;
        let length_s = t_s - began_s;
        if (length_s > shortest_s && !moving) || length_s > 3.0 * shortest_s {
            movement += usize::from(!grouped.is_empty());
            began_s = t_s;
        }
        grouped.push(Point { t_s, measured, moving, movement, late_s: 0.0 });
    }
    grouped
}
