//! Which cavity was the tip in, dwell by dwell.
//!
//! The nominal model may be further off (30 mm) than cavities are apart (25 mm), so no dwell can be judged
//! alone. All dwells of a recording are explained together:
//!
//! 1. [`search`]: rough alignments of tips and cavities, within what is known of the board's pose;
//! 2. [`heights`]: the plane of the seated ones among hovering ones;
//! 3. [`refine`]: for each alignment the best smooth [`field`] of model errors, the scatter of tips, and the
//!    probability of every state of every dwell, the [`sequence`] of visits taken into account;
//! 4. the same alignments shifted by one cavity, because those are the dangerous alternatives;
//! 5. [`verdict`]: explanations are weighed by their posterior probability; a dwell that they do not agree
//!    on is ambiguous, and a board that no explanation fits is an error.

mod at_least;
mod emission;
mod field;
mod heights;
mod layout;
mod problem;
mod refine;
mod rigid;
mod search;
mod sequence;
mod verdict;

#[cfg(test)]
mod tests;

use crate::{Association, AssociationConfig, Board, TableError};
use armcal_core::{DwellId, Pose};
use nalgebra::Vector3;
use problem::Problem;
use refine::{Converged, Explanation, refine_field, refine_with_order};

/// Explanations whose shifts by one cavity are looked at, at most.
const SHIFTED: usize = 4;
/// Explanations less likely than the best by more than this (as a logarithm) do not matter.
const NEGLIGIBLE_LN: f64 = 25.0;
/// What the order of visits can be worth a dwell (as a logarithm), at most, for an alignment to catch up.
const ORDER_WORTH_LN: f64 = 0.5;

/// The tip during one dwell, as far as it is known before calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct DwellTip {
    /// The dwell.
    pub dwell: DwellId,
    /// Start of the dwell on the robot's clock [ns].
    pub start_ns: i64,
    /// End of the dwell on the robot's clock [ns].
    pub end_ns: i64,
    /// Where the nominal model puts the tip, world frame [m].
    pub predicted_m: Vector3<f64>,
    /// Where the sensor saw the tip, or a marker at a constant offset from it, world frame [m].
    pub measured_m: Option<Vector3<f64>>,
}

/// What is known of the board's pose before association.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant)]
pub enum BoardStart {
    /// `world_from_board` of the board as it was tilted: from a tracker, or given.
    Known(Pose),
    /// Nothing (camera-free), but for the rough direction of its normal.
    Unknown,
}

/// Finds the place of every dwell of one recording. Assignments come in the order of `tips`; the order of
/// the cavities in the board's file does not matter. `tips` are taken in the order of time (by `start_ns`).
///
/// # Errors
/// Settings out of range, or a board that does not fit the dwells in any way.
pub fn associate(
    board: &Board,
    tips: &[DwellTip],
    start: &BoardStart,
    config: &AssociationConfig,
) -> Result<Association, TableError> {
    config.check(board)?;
    let mut in_time: Vec<usize> = (0..tips.len()).collect();
    in_time.sort_by_key(|&i| (tips[i].start_ns, i));
    let ordered: Vec<DwellTip> = in_time.iter().map(|&i| tips[i].clone()).collect();
    let problem = Problem::new(board, &ordered, start, config);
    let explanations = explain(&problem, start);
    let association = verdict::judge(board, &ordered, start, &problem, &explanations)?;
    Ok(verdict::in_input_order(association, &in_time))
}

/// All explanations worth weighing, best first, each with its own assignment.
fn explain(problem: &Problem, start: &BoardStart) -> Vec<Explanation> {
    if problem.tips_m.is_empty() {
        return Vec::new();
    }
    let rough = match start {
        BoardStart::Known(world_from_board) => search::around_pose(problem, world_from_board),
        BoardStart::Unknown => search::without_pose(problem),
    };
    let mut settled = Vec::new();
    for field in rough {
        for plane in heights::planes(problem, &field) {
            let mut lifted = field.clone();
            lifted.lift(plane);
            settled.push(refine_field(problem, lifted, problem.sigma_cap_m()));
        }
    }
    let mut explanations = Vec::new();
    weigh(problem, settled, &mut explanations);
    for rank in 0..SHIFTED {
        let Some(base) = explanations.get(rank).map(|e| e.field.clone()) else { break };
        let fewest = search::count_supporters(problem, &base) * 2 / 3;
        let shifted = problem.layout.steps_m().into_iter().filter_map(|step_m| {
            let mut shifted = base.clone();
            shifted.shift(step_m);
            let worth = search::count_supporters(problem, &shifted) >= fewest;
            worth.then(|| refine_field(problem, shifted, 0.5 * problem.sigma_cap_m()))
        });
        weigh(problem, shifted.collect(), &mut explanations);
    }
    explanations
}

/// Finishes the alignments that the order of visits could still make the best.
fn weigh(problem: &Problem, settled: Vec<Converged>, explanations: &mut Vec<Explanation>) {
    let top = settled.iter().map(|s| s.ln_posterior).fold(f64::NEG_INFINITY, f64::max);
    let by_order = NEGLIGIBLE_LN + ORDER_WORTH_LN * problem.weight.iter().sum::<f64>();
    for candidate in settled {
        if candidate.ln_posterior >= top - by_order {
            keep(problem, explanations, refine_with_order(problem, candidate));
        }
    }
}

/// Adds an explanation in its place, unless it is impossible, negligible, or assigns as a better one does.
fn keep(problem: &Problem, explanations: &mut Vec<Explanation>, new: Explanation) {
    if !new.ln_posterior.is_finite() || !verdict::normal_is_possible(problem, &new) {
        return;
    }
    if let Some(same) = explanations.iter().position(|e| e.best == new.best) {
        if explanations[same].ln_posterior >= new.ln_posterior {
            return;
        }
        explanations.remove(same);
    }
    let rank = explanations.partition_point(|e| e.ln_posterior >= new.ln_posterior);
    explanations.insert(rank, new);
    let least = explanations[0].ln_posterior - NEGLIGIBLE_LN;
    explanations.retain(|e| e.ln_posterior >= least);
}
