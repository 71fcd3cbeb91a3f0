//! Fine estimate: robust Gauss-Newton on offset and drift, with errors by the jackknife.
//!
//! ```text
//! r_k = m_k - c - g p(t_k - o - d (t_k - t_ref))
//! ```
//! `m` is the measured and `p` the predicted speed (or the logarithm of either), `g` and `c` a gain and a
//! level without meaning of their own. The nominal model is wrong by some percent, so the residuals are not
//! noise but smooth, and repeat wherever a path is repeated. A wrong zero of joint j changes the predicted speed
//! by `dp/dq_j`, of which a part looks like a shift in time; so the last step estimates those zeros along with
//! the clocks. What is left is correlated for as long as a movement lasts: the errors come from leaving out one
//! movement at a time (cluster jackknife, CR3; MacKinnon, Nielsen and Webb, J. Appl. Econometrics 38, 2023,
//! eq. 10), not from the residuals one by one.

use armcal_core::robust::mad_sigma;
use nalgebra::{DMatrix, DVector, Matrix2, Matrix4, Vector4};

use super::profile::SpeedProfile;
use crate::stats::HUBER_K;

/// Fewest movements from which errors can be told.
pub(crate) const MIN_MOVEMENTS: usize = 6;

const MAX_ITERATIONS: usize = 60;

/// Times the scale of the residuals is taken anew.
const SCALE_ROUNDS: usize = 3;
const CONVERGED_S: f64 = 1e-9;

/// Largest step of an iteration [s]: beyond a peak of the speed the linearisation means nothing.
const LONGEST_STEP_S: f64 = 0.1;

/// Angle by which each joint is bent to see how its zero changes the speed [rad].
pub(crate) const BEND_RAD: f64 = 0.01;

/// Zeros of joints further off than this are not expected [rad]; it decides only where the motion does not
/// tell (the first joint of an arm that stands upright turns the whole path and changes no speed).
const ZERO_SIGMA_RAD: f64 = 0.05;

/// Where the iteration starts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    pub offset_s: f64,
    pub drift: f64,
}

/// The fine estimate. Offset at the reference time, drift about it.
#[derive(Debug, Clone)]
pub(crate) struct Fine {
    pub offset_s: f64,
    pub drift: f64,
    /// Whether the drift was estimated; zero otherwise.
    pub with_drift: bool,
    /// Covariance of (offset [s], drift), already widened for the number of movements.
    pub covariance: Matrix2<f64>,
    /// What each window of the recording alone would add to the offset: time [s], offset [s], sigma [s].
    pub windows: Vec<(f64, f64, f64)>,
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
}

struct Row {
    point: Point,
    residual: f64,
    jacobian: Vector4<f64>,
    weight: f64,
}

/// Normal equations of one movement, or of all.
type Sums = (DMatrix<f64>, DVector<f64>);

/// The problem: points grouped in movements, and where drift is measured from.
pub(crate) struct Problem<'a> {
    robot: &'a SpeedProfile,
    /// The same with each joint bent by [`BEND_RAD`] in turn.
    bent: &'a [SpeedProfile],
    points: &'a [Point],
    reference_s: f64,
    half_s: f64,
    with_drift: bool,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(
        robot: &'a SpeedProfile,
        bent: &'a [SpeedProfile],
        points: &'a [Point],
        reference_s: f64,
        with_drift: bool,
    ) -> Problem<'a> {
        let half_s = points.iter().map(|p| (p.t_s - reference_s).abs()).fold(1e-3, f64::max);
        Problem { robot, bent, points, reference_s, half_s, with_drift }
    }

    /// Iterates from the start; `None` when the normal equations are singular or the movements too few.
    pub(crate) fn solve(&self, start: Start) -> Option<Fine> {
        // State: offset [s], drift scaled to seconds at the far end of the recording, gain, level.
        let drift_s = if self.with_drift { start.drift * self.half_s } else { 0.0 };
        let mut state = Vector4::new(start.offset_s, drift_s, 1.0, 0.0);
        (state.z, state.w) = self.first_gain(&state)?;
        for _ in 0..SCALE_ROUNDS {
            let limit = self.huber_limit(&self.rows(&state, f64::INFINITY));
            state = self.descend(state, limit)?;
        }
        let rows = self.rows(&state, self.huber_limit(&self.rows(&state, f64::INFINITY)));
        self.finish(state, &rows)
    }

    /// Gauss-Newton on Huber's cost with a fixed limit, steps halved until the cost falls.
    fn descend(&self, mut state: Vector4<f64>, limit: f64) -> Option<Vector4<f64>> {
        let mut rows = self.rows(&state, limit);
        let mut cost = huber_cost(&rows, limit);
        for _ in 0..MAX_ITERATIONS {
            let (normal, gradient) = self.normal(&rows);
            let mut step = normal.lu().solve(&gradient)?;
            step *= (LONGEST_STEP_S / step.x.abs().max(step.y.abs()).max(LONGEST_STEP_S)).min(1.0);
            loop {
                let (next, longest_s) = (state + step, step.x.abs().max(step.y.abs()));
                let next_rows = self.rows(&next, limit);
                let next_cost = huber_cost(&next_rows, limit);
                if next_cost < cost {
                    (state, rows, cost) = (next, next_rows, next_cost);
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
        for point in self.points {
            if let Some((predicted, _)) = self.robot.at(self.robot_s(state, point.t_s)) {
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

    fn robot_s(&self, state: &Vector4<f64>, t_s: f64) -> f64 {
        t_s - state.x - state.y * (t_s - self.reference_s) / self.half_s
    }

    fn rows(&self, state: &Vector4<f64>, limit: f64) -> Vec<Row> {
        let row = |point: &Point| {
            let (p, rate) = self.robot.at(self.robot_s(state, point.t_s))?;
            let by_offset = -state.z * rate;
            let far = if self.with_drift { (point.t_s - self.reference_s) / self.half_s } else { 0.0 };
            let jacobian = Vector4::new(by_offset, by_offset * far, p, 1.0);
            let residual = point.measured - state.z * p - state.w;
            Some(Row { point: *point, residual, jacobian, weight: (limit / residual.abs()).min(1.0) })
        };
        self.points.iter().filter_map(row).collect()
    }

    /// Huber's limit in the scale of the moving rows: the many at rest agree far better and tell nothing of
    /// time.
    fn huber_limit(&self, rows: &[Row]) -> f64 {
        let moving: Vec<f64> = rows.iter().filter(|r| r.point.moving).map(|r| r.residual).collect();
        let limit = HUBER_K * mad_sigma(&moving);
        if limit > 0.0 { limit } else { f64::INFINITY }
    }

    fn normal(&self, rows: &[Row]) -> (Matrix4<f64>, Vector4<f64>) {
        let (mut normal, gradient) = sums(rows);
        if !self.with_drift {
            normal[(1, 1)] = 1.0;
        }
        (normal, gradient)
    }

    /// One more step with the zeros of the joints, where there are movements enough to tell them; then the
    /// jackknife.
    fn finish(&self, state: Vector4<f64>, rows: &[Row]) -> Option<Fine> {
        let by_movement: Vec<&[Row]> = rows.chunk_by(|a, b| a.point.movement == b.point.movement).collect();
        let groups = by_movement.len();
        if groups < MIN_MOVEMENTS {
            return None;
        }
        let enough = groups >= 2 * (4 + self.bent.len());
        let with_zeros = enough.then(|| self.jackknife(&state, &by_movement, self.bent)).flatten();
        let (step, covariance) = match with_zeros {
            Some(found) => found,
            None => self.jackknife(&state, &by_movement, &[])?,
        };
        let scale = Matrix2::new(1.0, 0.0, 0.0, 1.0 / self.half_s);
        Some(Fine {
            offset_s: state.x + step[0],
            drift: (state.y + step[1]) / self.half_s,
            with_drift: self.with_drift,
            covariance: scale * covariance * scale,
            windows: windows(&by_movement),
        })
    }

    /// The last step from `state` and the covariance of offset and scaled drift after it. None when the step
    /// is too long for the linearisation, or the equations are singular.
    fn jackknife(
        &self,
        state: &Vector4<f64>,
        by_movement: &[&[Row]],
        bent: &[SpeedProfile],
    ) -> Option<(DVector<f64>, Matrix2<f64>)> {
        let groups = by_movement.len() as f64;
        let parts: Vec<Sums> = by_movement.iter().map(|rows| self.wide_sums(state, rows, bent)).collect();
        let size = 4 + bent.len();
        let (mut whole, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (normal, pull) in &parts {
            whole += normal;
            gradient += pull;
        }
        if !self.with_drift {
            whole[(1, 1)] = 1.0;
        }
        let moving = by_movement.iter().flat_map(|rows| rows.iter()).filter(|r| r.point.moving);
        let scale = mad_sigma(&moving.map(|r| r.residual).collect::<Vec<_>>());
        for zero in 4..size {
            whole[(zero, zero)] += (scale / ZERO_SIGMA_RAD).powi(2).max(f64::MIN_POSITIVE);
        }
        let step = whole.clone().lu().solve(&gradient)?;
        if step[0].hypot(step[1]) > LONGEST_STEP_S {
            return None;
        }
        let mut covariance = Matrix2::zeros();
        for (normal, pull) in &parts {
            let change = (&whole - normal).lu().solve(&(pull - normal * &step))?;
            let change = change.fixed_rows::<2>(0);
            covariance += change * change.transpose();
        }
        let free = groups - (if self.with_drift { 4.0 } else { 3.0 }) - bent.len() as f64;
        covariance *= (groups - 1.0) / groups * student_widening(free).powi(2);
        // Lengths and twists are wrong as well and not estimated here; they shift about as much as the zeros did.
        let shift = step.fixed_rows::<2>(0);
        Some((step.clone(), covariance + shift * shift.transpose()))
    }

    /// [`sums`] with a column for the zero of each bent joint.
    fn wide_sums(&self, state: &Vector4<f64>, rows: &[Row], bent: &[SpeedProfile]) -> Sums {
        let size = 4 + bent.len();
        let (mut normal, mut gradient) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for r in rows {
            let robot_s = self.robot_s(state, r.point.t_s);
            let by_zero = bent.iter().map(|b| {
                let bent = b.at(robot_s).map_or(r.jacobian.z, |(speed, _)| speed);
                state.z * (bent - r.jacobian.z) / BEND_RAD
            });
            let jacobian = DVector::from_iterator(size, r.jacobian.iter().copied().chain(by_zero));
            normal.ger(r.weight, &jacobian, &jacobian, 1.0);
            gradient.axpy(r.weight * r.residual, &jacobian, 1.0);
        }
        (normal, gradient)
    }
}

/// Groups points into movements: cut at rest once `shortest_s` long, and anywhere at three times that.
pub(crate) fn movements(points: &[(f64, f64)], moving_above: f64, shortest_s: f64) -> Vec<Point> {
    let (mut began_s, mut movement) = (f64::NEG_INFINITY, 0);
    let mut grouped: Vec<Point> = Vec::with_capacity(points.len());
    for &(t_s, measured) in points {
        let moving = measured > moving_above;
        let length_s = t_s - began_s;
        if (length_s > shortest_s && !moving) || length_s > 3.0 * shortest_s {
            movement += usize::from(!grouped.is_empty());
            began_s = t_s;
        }
        grouped.push(Point { t_s, measured, moving, movement });
    }
    grouped
}

/// Mean of Huber's loss: the number of rows that find a counterpart changes with the state.
fn huber_cost(rows: &[Row], limit: f64) -> f64 {
    let loss = |r: f64| if r <= limit { 0.5 * r * r } else { limit * (r - 0.5 * limit) };
    rows.iter().map(|r| loss(r.residual.abs())).sum::<f64>() / rows.len().max(1) as f64
}

fn sums(rows: &[Row]) -> (Matrix4<f64>, Vector4<f64>) {
    let mut normal = Matrix4::zeros();
    let mut gradient = Vector4::zeros();
    for r in rows {
        normal += r.weight * r.jacobian * r.jacobian.transpose();
        gradient += r.weight * r.residual * r.jacobian;
    }
    (normal, gradient)
}

/// What each eighth of the movements alone would add to the offset.
fn windows(by_movement: &[&[Row]]) -> Vec<(f64, f64, f64)> {
    let each = by_movement.len().div_ceil(8).max(3);
    let window = |movements: &[&[Row]]| {
        let one = |rows: &[Row]| {
            let bend: f64 = rows.iter().map(|r| r.weight * r.jacobian.x * r.jacobian.x).sum();
            let pull: f64 = rows.iter().map(|r| r.weight * r.jacobian.x * r.residual).sum();
            (bend, pull)
        };
        let parts: Vec<(f64, f64)> = movements.iter().map(|rows| one(rows)).collect();
        let bend: f64 = parts.iter().map(|p| p.0).sum();
        let offset_s = parts.iter().map(|p| p.1).sum::<f64>() / bend;
        let n = parts.len() as f64;
        let spread: f64 = parts.iter().map(|p| (p.1 - p.0 * offset_s).powi(2)).sum();
        let sigma_s = (spread * n / (n - 1.0)).sqrt() / bend;
        let mid =
            movements.get(movements.len() / 2).and_then(|rows| rows.first()).map_or(0.0, |r| r.point.t_s);
        (mid, offset_s, sigma_s)
    };
    by_movement.chunks(each).filter(|c| c.len() >= 3).map(window).collect()
}

/// Ratio of the 97.5 % points of Student's t and of the normal distribution (Cornish and Fisher's
/// expansion; within 1 % from three degrees of freedom on).
fn student_widening(free: f64) -> f64 {
    let v = free.max(1.0);
    1.0 + 1.2101 / v + 1.4402 / (v * v) + 1.3 / v.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_widening_matches_the_table() {
        // t(0.975): 3 -> 3.1824, 5 -> 2.5706, 10 -> 2.2281, 30 -> 2.0423.
        for (free, t) in [(3.0, 3.1824), (5.0, 2.5706), (10.0, 2.2281), (30.0, 2.0423)] {
            assert!((student_widening(free) * 1.959_964 / t - 1.0).abs() < 0.01, "{free}");
        }
    }
}
