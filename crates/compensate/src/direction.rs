//! The inverse of a model whose tip depends on the direction of arrival.
//!
//! A gap makes the tip a path-dependent function of the readings, flat where the gap is being crossed: Newton steps on
//! it stall. So a direction is assumed for every joint (and every sum and difference of neighbours, for belts), the
//! smooth problem solved in which all gaps are closed on that side, and the answer put to the model with the path that
//! really leads there. If a joint would travel the other way than assumed, its direction is turned and the problem
//! solved again. Only the last step decides: what is returned is what the model predicts for the commanded path.

use crate::arm::Arm;
use crate::inverse::{Limits, Miss, solve};
use crate::stored::Past;
use armcal_core::Observation;
use std::collections::VecDeque;

/// A prediction this close to the target is at it [m].
pub(crate) const ACCEPTED_M: f64 = 1e-6;
/// The same of its orientation [rad].
const ACCEPTED_RAD: f64 = 1e-6;

/// Combinations of directions that are tried, at most: all of eight joints.
const MOST_TRIES: usize = 256;
/// A direction that moves the tip by less does not count [m].
const TELLING_M: f64 = 1e-8;

/// A set-point and what the model predicts for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The readings [rad].
    pub joint_rad: Vec<f64>,
    /// The commanded path up to and including them.
    pub past: Past,
    /// Distance from the target to the prediction [m].
    pub left_m: f64,
    /// Rotation between them [rad]; zero where no orientation was asked for.
    pub left_rad: f64,
}

impl Found {
    /// Whether the prediction is at the target. If not, no direction of travel agrees with itself: the arm must come
    /// from further away.
    pub fn settled(&self) -> bool {
        self.left_m <= ACCEPTED_M && self.left_rad <= ACCEPTED_RAD
    }

    fn better_than(&self, other: &Option<Found>) -> bool {
        other.as_ref().is_none_or(|other| self.left_m + self.left_rad < other.left_m + other.left_rad)
    }
}

/// How the arm goes from the last set-point to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Way<'a> {
    /// Straight.
    Direct,
    /// By a point this far before the target, joint by joint [rad].
    By(&'a [f64]),
}

impl Way<'_> {
    pub fn past(&self, before: &Past, joint_rad: &[f64]) -> Past {
        match self {
            Way::Direct => before.then(joint_rad),
            Way::By(_) => before.then(&self.via(joint_rad)).then(joint_rad),
        }
    }

    /// The point on the way; the target itself where there is none.
    pub fn via(&self, joint_rad: &[f64]) -> Vec<f64> {
        match self {
            Way::Direct => joint_rad.to_vec(),
            Way::By(off_rad) => joint_rad.iter().zip(*off_rad).map(|(q, off)| q - off).collect(),
        }
    }
}

/// The set-point that brings the tip to `target`, after the path `before`, near `start_rad`, which also says in which
/// direction each joint is likely to travel.
pub(crate) fn invert_model(
    arm: &Arm<'_>,
    target: &Observation,
    before: &Past,
    way: Way<'_>,
    start_rad: &[f64],
    limits: &Limits,
) -> Result<Found, Miss> {
    let found = |joint_rad: Vec<f64>| {
        let past = way.past(before, &joint_rad);
        let (left_m, left_rad) = arm.left(target, &past, &joint_rad);
        Found { joint_rad, past, left_m, left_rad }
    };
    let travelled =
        |start: &[f64]| solve(|q| arm.linearised(target, &way.past(before, q), q), start, limits).map(found);
    if let (Way::Direct, Some(stood)) = (way, before.joint_rad()) {
        let there = found(stood);
        if there.settled() {
            return Ok(there);
        }
    }
    let turned = |q: &[f64]| before.then(&way.via(q)).signs(q);
    let (mut best, mut missed): (Option<Found>, Option<Miss>) = (None, None);
    let mut tried: Vec<Vec<f64>> = Vec::new();
    let mut telling: Option<Vec<usize>> = None;
    let mut open = VecDeque::from([turned(start_rad)]);
    while let Some(signs) = open.pop_front() {
        if tried.contains(&signs) || tried.len() == MOST_TRIES {
            continue;
        }
        let assumed = |q: &[f64]| arm.linearised(target, &before.arriving(q, &signs), q);
        match solve(assumed, start_rad, limits) {
            Err(miss) => missed = missed.or(Some(miss)),
            Ok(joint_rad) => {
                let there = found(joint_rad);
                if there.settled() {
                    return Ok(there);
                }
                open.push_back(turned(&there.joint_rad));
                if there.better_than(&best) {
                    best = Some(there);
                }
            }
        }
        // Few flips first; what nothing depends on is not flipped.
        let telling = telling.get_or_insert_with(|| telling_lanes(arm, target, before, start_rad, &signs));
        open.extend(telling.iter().map(|lane| flip_sign(&signs, *lane)));
        tried.push(signs);
    }
    let Some(best) = best else {
        return missed.map_or_else(|| travelled(start_rad), Err);
    };
    // A move shorter than a gap, with an effect that resolves it only in part, is smooth again.
    Ok(travelled(&best.joint_rad).ok().filter(Found::settled).unwrap_or(best))
}

/// Joints, sums and differences whose direction moves the tip.
fn telling_lanes(arm: &Arm<'_>, target: &Observation, before: &Past, q: &[f64], signs: &[f64]) -> Vec<usize> {
    let residual = |signs: &[f64]| arm.linearised(target, &before.arriving(q, signs), q).0;
    let here = residual(signs);
    let moves = |lane: &usize| {
        let there = residual(&flip_sign(signs, *lane));
        let turned_rad = match (there.rotation_rad, here.rotation_rad) {
            (Some(a), Some(b)) => (a - b).norm(),
            _ => 0.0,
        };
        (there.position_m - here.position_m).norm() + turned_rad > TELLING_M
    };
    (0..signs.len()).filter(moves).collect()
}

fn flip_sign(signs: &[f64], lane: usize) -> Vec<f64> {
    let mut other = signs.to_vec();
    other[lane] = -other[lane];
    other
}
