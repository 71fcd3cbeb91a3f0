//! Joint readings at which a residual vanishes: damped Newton steps within limits.
//!
//! `dq = J' (J J' + l I)^-1 r`, Levenberg's damping in the form for arms (Wampler 1986; Nakamura and Hanafusa 1986):
//! the least step that does it, also where the arm is redundant, and a bounded one near a singularity. `l` falls with
//! every step that helps and rises with every one that does not. A joint at its limit that would go further takes no
//! part in a step.

use armcal_model::ModelResidual;
use nalgebra::{DMatrix, DVector};

/// A residual of position below this is none [m].
const DONE_M: f64 = 1e-9;
/// The same of rotation [rad].
const DONE_RAD: f64 = 1e-9;
/// Rotation counts as if it moved a point this far from the axis [m].
const LEVER_M: f64 = 0.3;
/// Most steps; Newton's need about five, a long way with limits some tens.
const MOST_STEPS: usize = 300;
/// Longest step of a joint [rad] (sliding: [m]).
const LONGEST_STEP_RAD: f64 = 0.3;
/// How far a stretched arm is bent to leave a pose in which no joint moves the tip towards the target [rad].
const KICK_RAD: f64 = 0.05;
/// How often.
const MOST_KICKS: usize = 2;

/// Smallest and largest reading of each joint [rad] (sliding: [m]); infinite where there is none.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits(pub Vec<[f64; 2]>);

impl Limits {
    /// No limits.
    pub fn none(joints: usize) -> Limits {
        Limits(vec![[f64::NEG_INFINITY, f64::INFINITY]; joints])
    }

    fn clamp(&self, q: &mut DVector<f64>) {
        q.iter_mut().zip(&self.0).for_each(|(q, [low, high])| *q = q.clamp(*low, *high));
    }

    /// Joints that stand at a limit.
    fn reached(&self, q: &[f64]) -> Vec<usize> {
        let at = |(q, [low, high]): (&f64, &[f64; 2])| q <= low || q >= high;
        q.iter().zip(&self.0).map(at).enumerate().filter(|(_, at)| *at).map(|(j, _)| j).collect()
    }
}

/// Where the iteration came closest, when it did not arrive.
#[derive(Debug, Clone, PartialEq)]
pub struct Miss {
    /// The readings there [rad].
    pub joint_rad: Vec<f64>,
    /// Distance left [m].
    pub left_m: f64,
    /// Rotation left [rad]; zero where no orientation was asked for.
    pub left_rad: f64,
    /// Joints at a limit there.
    pub at_limit: Vec<usize>,
}

/// Joint readings near `start_rad`, within `limits`, at which the residual vanishes (1 nm, 1 nrad).
///
/// `linearised` gives the residual `target - predicted` at readings, and its Jacobian (rows of the residual, one column
/// a joint). It may be approximate: only the residual decides which steps are taken.
pub fn solve(
    mut linearised: impl FnMut(&[f64]) -> (ModelResidual, DMatrix<f64>),
    start_rad: &[f64],
    limits: &Limits,
) -> Result<Vec<f64>, Miss> {
    let mut q = DVector::from_column_slice(start_rad);
    limits.clamp(&mut q);
    let mut at = Point::of(linearised(q.as_slice()));
    let (mut damping, mut kicks) = (1e-4, 0);
    for _ in 0..MOST_STEPS {
        if at.done() {
            return Ok(q.as_slice().to_vec());
        }
        let step = at.step(&q, limits, damping);
        let mut next = &q + step;
        limits.clamp(&mut next);
        if (&next - &q).amax() < 1e-13 {
            if kicks == MOST_KICKS {
                break;
            }
            kicks += 1;
            next = perturb_posture(&q, kicks);
            limits.clamp(&mut next);
            (q, at) = (next.clone(), Point::of(linearised(next.as_slice())));
            continue;
        }
        let there = Point::of(linearised(next.as_slice()));
        if there.cost() < at.cost() {
            (q, at, damping) = (next, there, (damping * 0.1).max(1e-14));
        } else if damping < 1e3 {
            damping *= 10.0;
        } else {
            break;
        }
    }
    let (left_m, left_rad) = at.left;
    let joint_rad = q.as_slice().to_vec();
    Err(Miss { at_limit: limits.reached(&joint_rad), joint_rad, left_m, left_rad })
}

/// The posture, every joint bent a little, neighbours to opposite sides.
fn perturb_posture(q: &DVector<f64>, kick: usize) -> DVector<f64> {
    let bend =
        |j: usize, q: f64| q + KICK_RAD * kick as f64 * if (j + kick).is_multiple_of(2) { 1.0 } else { -1.0 };
    DVector::from_iterator(q.len(), q.iter().enumerate().map(|(j, q)| bend(j, *q)))
}

/// Residual and slope at one posture, rotation scaled to metres.
struct Point {
    residual: DVector<f64>,
    /// d predicted / d q.
    slope: DMatrix<f64>,
    left: (f64, f64),
}

impl Point {
    fn of((residual, jacobian): (ModelResidual, DMatrix<f64>)) -> Point {
        let left = (residual.position_m.norm(), residual.rotation_rad.map_or(0.0, |r| r.norm()));
        let mut rows = DVector::from_iterator(residual.len(), residual.rows());
        let mut slope = -jacobian;
        if residual.rotation_rad.is_some() {
            rows.rows_mut(3, 3).scale_mut(LEVER_M);
            slope.rows_mut(3, 3).scale_mut(LEVER_M);
        }
        Point { residual: rows, slope, left }
    }

    fn done(&self) -> bool {
        self.left.0 < DONE_M && self.left.1 < DONE_RAD
    }

    /// Not a number where a posture is outside what the model can do.
    fn cost(&self) -> f64 {
        self.residual.norm_squared()
    }

    /// The damped step, joints that would leave their limits held.
    fn step(&self, q: &DVector<f64>, limits: &Limits, damping: f64) -> DVector<f64> {
        let mut slope = self.slope.clone();
        loop {
            let step = least_step(&slope, &self.residual, damping);
            let leaves = |j: &usize| {
                let [low, high] = limits.0[*j];
                (q[*j] <= low && step[*j] < 0.0) || (q[*j] >= high && step[*j] > 0.0)
            };
            let held: Vec<usize> = (0..q.len()).filter(leaves).collect();
            if held.is_empty() {
                let longest = step.amax();
                return if longest > LONGEST_STEP_RAD { step * (LONGEST_STEP_RAD / longest) } else { step };
            }
            held.iter().for_each(|j| slope.column_mut(*j).fill(0.0));
        }
    }
}

fn least_step(slope: &DMatrix<f64>, residual: &DVector<f64>, damping: f64) -> DVector<f64> {
    let rows = slope.nrows();
    let mut normal = slope * slope.transpose();
    (0..rows).for_each(|k| normal[(k, k)] += damping + 1e-15);
    match normal.cholesky() {
        Some(factor) => slope.transpose() * factor.solve(residual),
        None => DVector::zeros(slope.ncols()),
    }
}
