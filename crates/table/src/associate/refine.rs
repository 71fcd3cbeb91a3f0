//! From a rough alignment to the best one near it: expectation maximisation with falling scatter, over the
//! board's pose (where free), the field, and the scatter of tips about cavities.

use super::emission::{Emission, Scatter, State};
use super::field::{Field, Pull};
use super::problem::Problem;
use super::rigid::{Match, fit_rigid, on_a_line};
use super::sequence::{Sequence, ln_order};
use nalgebra::Vector3;

/// Steps with falling scatter.
const FALLING: usize = 10;
/// Steps at the estimated scatter, the visiting order included.
const FINAL: usize = 3;
/// Every so many steps a free pose takes over what the field has found.
const POSE_EVERY: usize = 3;
/// Places' worth of belief in the configured scatter.
const SIGMA_BELIEF: f64 = 2.0;
/// No tip is aligned better than this [m].
const SIGMA_FLOOR_M: f64 = 3e-4;

/// One explanation of all dwells.
pub(super) struct Explanation {
    pub field: Field,
    /// Scatter of seated tips about their cavities, per axis [m].
    pub sigma_m: f64,
    pub sequence: Sequence,
    pub best: Vec<State>,
    /// Whether hovering could be told: the board's normal is given or determined.
    pub normal_known: bool,
    /// Logarithm of its posterior probability, up to a constant.
    pub ln_posterior: f64,
}

/// An alignment refined dwell by dwell, before the order of visits is asked.
pub(super) struct Converged {
    pub field: Field,
    pub sigma_m: f64,
    pub normal_known: bool,
    /// Logarithm of its posterior probability without the order of visits, up to a constant.
    pub ln_posterior: f64,
}

/// Refines `field`, starting with a scatter of `sigma_m`.
pub(super) fn refine_field(problem: &Problem, mut field: Field, sigma_m: f64) -> Converged {
    let mut sigma_m = sigma_m;
    let mut normal_known = !problem.free_pose || problem.layout.len() > 2;
    let fall = (tip_sigma_m(problem) / sigma_m).min(1.0).powf(1.0 / FALLING as f64);
    let mut least_m = sigma_m;
    let mut soft = vec![Vec::new(); problem.tips_m.len()];
    for step in 0..FALLING {
        expectation_step(problem, &field, sigma_m, normal_known, &mut soft);
        if problem.free_pose {
            normal_known = !on_a_line(seat_matches(problem, &field, &soft).into_iter().map(|m| (m.0, m.2)));
            if step % POSE_EVERY == POSE_EVERY - 1 {
                take_over_pose(problem, &mut field, &soft);
            }
        }
        maximisation_step(problem, &mut field, &soft, sigma_m);
        least_m *= fall;
        sigma_m = seat_scatter_m(problem, &field, &soft).max(least_m).min(problem.sigma_cap_m());
    }
    let ln_likelihood = expectation_step(problem, &field, sigma_m, normal_known, &mut soft);
    let ln_posterior = ln_likelihood + ln_prior(problem, &field, sigma_m);
    Converged { field, sigma_m, normal_known, ln_posterior }
}

/// Takes the order of visits into account.
pub(super) fn refine_with_order(problem: &Problem, settled: Converged) -> Explanation {
    let Converged { mut field, mut sigma_m, normal_known, .. } = settled;
    let mut stay = problem.stay;
    for _ in 0..FINAL {
        let sequence = Sequence::of(problem, &field, &Emission::new(problem, sigma_m, normal_known), stay);
        stay = sequence.stay();
        if problem.free_pose {
            take_over_pose(problem, &mut field, &sequence.states);
        }
        maximisation_step(problem, &mut field, &sequence.states, sigma_m);
        sigma_m = seat_scatter_m(problem, &field, &sequence.states).min(problem.sigma_cap_m());
    }
    let sequence = Sequence::of(problem, &field, &Emission::new(problem, sigma_m, normal_known), stay);
    let best = sequence.best();
    let ln_posterior = sequence.ln_likelihood + ln_prior(problem, &field, sigma_m) + ln_order(problem, &best);
    Explanation { field, sigma_m, sequence, best, normal_known, ln_posterior }
}

fn tip_sigma_m(problem: &Problem) -> f64 {
    problem.config.tip_sigma_mm * 1e-3
}

/// Prior of the field, and of the scatter (inverse gamma).
fn ln_prior(problem: &Problem, field: &Field, sigma_m: f64) -> f64 {
    let excess = 0.5 * (tip_sigma_m(problem) / sigma_m).powi(2);
    field.ln_prior(&problem.prior) - 3.0 * SIGMA_BELIEF * (sigma_m.ln() + excess)
}

/// Cavities and the tips seated in them, as far as they are.
pub(super) fn seat_matches(problem: &Problem, field: &Field, states: &[Vec<(State, f64)>]) -> Vec<Match> {
    let mut matches = Vec::new();
    for (i, tip) in problem.tips_m.iter().enumerate() {
        for &(state, p) in &states[i] {
            if let State::Seat(k) = state
                && p > 1e-3
            {
                matches.push((problem.layout.points_m[k], field.supposed_m(tip), p * problem.weight[i]));
            }
        }
    }
    matches
}

/// Fills `soft` with what each dwell may be, one by one; the logarithm of the likelihood of all.
fn expectation_step(
    problem: &Problem,
    field: &Field,
    sigma_m: f64,
    normal_known: bool,
    soft: &mut [Vec<(State, f64)>],
) -> f64 {
    let mut ln_likelihood = 0.0;
    let emission = Emission::new(problem, sigma_m, normal_known);
    let ln_choice = (problem.layout.len() as f64).ln();
    for ((i, tip), states) in problem.tips_m.iter().enumerate().zip(soft) {
        emission.at(i, &field.aligned_m(tip), states);
        for (state, ln) in &mut *states {
            *ln -= state.cavity().map_or(0.0, |_| ln_choice);
        }
        let top = states.iter().map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
        states.iter_mut().for_each(|s| s.1 = (s.1 - top).exp());
        let total: f64 = states.iter().map(|s| s.1).sum();
        states.iter_mut().for_each(|s| s.1 /= total);
        ln_likelihood += problem.weight[i] * (total.ln() + top);
    }
    ln_likelihood
}

fn maximisation_step(problem: &Problem, field: &mut Field, states: &[Vec<(State, f64)>], sigma_m: f64) {
    let emission = Emission::new(problem, sigma_m, true);
    let mut pulls = Vec::with_capacity(problem.tips_m.len());
    for (i, tip) in problem.tips_m.iter().enumerate() {
        let Scatter { seat_m: seat_sigma_m, hover_m: hover_sigma_m, .. } = emission.scatter(i);
        let (mut lateral, mut normal) = (0.0, 0.0);
        let (mut to_lateral_m, mut to_normal_m) = (Vector3::zeros(), 0.0);
        for &(state, p) in states[i].iter().filter(|s| s.1 > 1e-3) {
            let p = p * problem.weight[i];
            match state {
                State::Seat(k) => {
                    let weight = p / seat_sigma_m.powi(2);
                    lateral += weight;
                    normal += weight;
                    to_lateral_m += problem.layout.points_m[k] * weight;
                    to_normal_m += problem.layout.points_m[k].z * weight;
                }
                State::Hover(k) => {
                    let weight = p / hover_sigma_m.powi(2);
                    lateral += weight;
                    to_lateral_m += problem.layout.points_m[k] * weight;
                }
                State::Out => {}
            }
        }
        if lateral > 0.0 {
            let to = to_lateral_m / lateral;
            let height_m = if normal > 0.0 { to_normal_m / normal } else { 0.0 };
            let to_m = Vector3::new(to.x, to.y, height_m);
            pulls.push(Pull { from_m: field.supposed_m(tip), to_m, lateral, normal });
        }
    }
    field.fit(&pulls, &problem.prior);
}

/// Moves the supposed board onto the seated tips; the field starts again from nothing.
fn take_over_pose(problem: &Problem, field: &mut Field, states: &[Vec<(State, f64)>]) {
    let board_from_board = fit_rigid(&seat_matches(problem, field, states), &armcal_core::Pose::identity());
    let centre_m = field.centre_m;
    *field = Field::none(board_from_board.inverse() * field.board_from_world, centre_m);
}

/// Scatter of seated tips about their cavities per axis, with the configured one as a few places' worth
/// of prior (the mode of an inverse-gamma posterior).
fn seat_scatter_m(problem: &Problem, field: &Field, states: &[Vec<(State, f64)>]) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for (i, tip) in problem.tips_m.iter().enumerate().filter(|(i, _)| problem.extra_sigma_m[*i] == 0.0) {
        let aligned_m = field.aligned_m(tip);
        for &(state, p) in &states[i] {
            if let State::Seat(k) = state {
                squares += p * problem.weight[i] * (aligned_m - problem.layout.points_m[k]).norm_squared();
                count += p * problem.weight[i];
            }
        }
    }
    let believed = tip_sigma_m(problem).powi(2);
    let variance = (squares + 3.0 * SIGMA_BELIEF * believed) / (3.0 * (count + SIGMA_BELIEF));
    variance.sqrt().max(SIGMA_FLOOR_M)
}
