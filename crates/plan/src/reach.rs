//! Where the arm can go: joint ranges, and the joint readings that bring the tip to a point.

use super::{Allowed, Known};
use armcal_core::Observation;
use nalgebra::{DVector, Matrix3, Vector3};

/// Damping of the step, against singular poses [m/rad].
const DAMPING_M: f64 = 0.01;
/// Largest change of a joint in one step [rad].
const LARGEST_STEP_RAD: f64 = 0.2;
/// Steps before a point counts as out of reach.
const STEPS: usize = 60;
/// The tip has arrived [m].
const ARRIVED_M: f64 = 1e-5;

/// Range of each joint [rad].
#[derive(Debug, Clone, PartialEq)]
pub struct Limits(pub Vec<[f64; 2]>);

impl Limits {
    /// The recorded range of each joint, widened by the margin as far as the joint goes, or what the user says.
    pub fn of(known: &Known<'_>, allowed: &Allowed) -> Limits {
        let margin_rad = allowed.margin_deg.to_radians();
        let range = |joint: usize| {
            let said = allowed.ranges_deg.iter().rev().find(|(j, _)| *j == joint);
            if let Some((_, range_deg)) = said {
                return range_deg.map(f64::to_radians);
            }
            let readings = known.observations.iter().filter_map(|o| o.joint_rad.get(joint));
            let [low, high] = readings
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| [low.min(*q), high.max(*q)]);
            let [lowest, highest] = known.model.chain().joint_limits(joint, [low, high]);
            [(low - margin_rad).max(lowest), (high + margin_rad).min(highest)]
        };
        Limits((0..known.model.joint_count()).map(range).collect())
    }

    /// The `draw`th of readings spread evenly over the ranges (Halton 1960), `away_rad` from their ends where there is room.
    pub fn drawn(&self, draw: usize, away_rad: f64) -> Vec<f64> {
        let inner = |(joint, [low, high]): (usize, &[f64; 2])| {
            let away = away_rad.min((high - low) / 4.0);
            low + away + radical_inverse(draw, nth_prime(joint)) * (high - low - 2.0 * away)
        };
        self.0.iter().enumerate().map(inner).collect()
    }

    /// Whether every joint keeps `clear_rad` away from the ends of its range.
    pub fn hold(&self, joint_rad: &[f64], clear_rad: f64) -> bool {
        joint_rad.iter().zip(&self.0).all(|(q, [low, high])| *q >= low + clear_rad && *q <= high - clear_rad)
    }
}

/// The dwell whose tip is nearest to a point in the world.
pub fn nearest_dwell<'a>(known: &Known<'a>, target_m: &Vector3<f64>) -> Option<&'a Observation> {
    let distance = |o: &Observation| (known.model.predicted_tip_in_world(&known.values, o) - target_m).norm();
    known.observations.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Joint readings that bring the tip of the fitted model to a point in the world, the nearest to where `from` has them
/// (damped least squares: Wampler 1986). `None` where the arm does not get there.
pub fn solve_position(known: &Known<'_>, from: &Observation, target_m: &Vector3<f64>) -> Option<Vec<f64>> {
    inverse_kinematics(known, from, |at| target_m - known.model.predicted_tip_in_world(&known.values, at))
}

/// The smallest change of the joints [rad] that moves the tip by `way_m` in the world.
pub fn joint_step(known: &Known<'_>, at: &Observation, way_m: &Vector3<f64>) -> Option<DVector<f64>> {
    let jacobian = known.model.joint_jacobian(&known.values, at);
    // Damped only while far away, so that the last steps converge fast.
    let damping = DAMPING_M * way_m.norm().min(1.0);
    let square = &jacobian * jacobian.transpose() + Matrix3::identity() * (damping * damping + 1e-10);
    Some(jacobian.transpose() * (square.try_inverse()? * way_m))
}

/// Joint readings of both arms that bring their tips together, or as far apart as their link is, near where `from` has them;
/// `None` where they do not meet.
pub fn solve_closure(known: &Known<'_>, from: &Observation) -> Option<Vec<f64>> {
    inverse_kinematics(known, from, |at| known.model.residual(&known.values, at).position_m)
}

/// Joint readings from which nothing of the way that `left_m` tells is left, the nearest to where `from` has them.
fn inverse_kinematics(
    known: &Known<'_>,
    from: &Observation,
    left_m: impl Fn(&Observation) -> Vector3<f64>,
) -> Option<Vec<f64>> {
    let mut at = from.clone();
    for _ in 0..STEPS {
        let left_m = left_m(&at);
        if left_m.norm() < ARRIVED_M {
            return Some(at.joint_rad);
        }
        let step = joint_step(known, &at, &left_m)?;
        let shrink = (LARGEST_STEP_RAD / step.amax()).min(1.0);
        at.joint_rad.iter_mut().zip(step.iter()).for_each(|(q, dq)| *q += shrink * dq);
    }
    None
}

/// The digits of `n` in a base, mirrored at the point: the van der Corput sequence.
fn radical_inverse(mut n: usize, base: usize) -> f64 {
    let (mut value, mut weight) = (0.0, 1.0 / base as f64);
    while n > 0 {
        value += (n % base) as f64 * weight;
        n /= base;
        weight /= base as f64;
    }
    value
}

fn nth_prime(index: usize) -> usize {
    let is_prime = |n: &usize| (2..*n).take_while(|d| d * d <= *n).all(|d| !n.is_multiple_of(d));
    (2..).filter(is_prime).nth(index).unwrap_or(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halton_points_fill_every_box_once() {
        let mut seen = [false; 36];
        for n in 0..36 {
            let [x, y] = [0, 1].map(|axis| radical_inverse(n, nth_prime(axis)));
            seen[(x * 4.0 + 1e-9) as usize * 9 + (y * 9.0 + 1e-9) as usize] = true;
        }
        assert!(seen.iter().all(|s| *s));
        assert_eq!([0, 1, 2, 3, 4].map(nth_prime), [2, 3, 5, 7, 11]);
    }
}
