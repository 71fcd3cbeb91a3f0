//! The visiting order as evidence: a hidden Markov chain over the dwells of a recording (Rabiner 1989,
//! forward-backward with scaling). The next dwell is likely in the same cavity or in a neighbouring one;
//! any other is possible.

use super::emission::{Emission, State};
use super::field::Field;
use super::layout::Layout;
use super::problem::Problem;

/// Share of moves to another cavity that go to a neighbour.
const TO_NEIGHBOUR: f64 = 0.6;
/// Largest weight of the configured order, as a logarithm of odds each way.
const ORDER_LN: f64 = 4.0;
/// Weight of starting at the first cavity of the configured order.
const START_LN: f64 = 2.0;

/// What every dwell may be, with probabilities that sum to one, and how well all of it is explained.
pub(super) struct Sequence {
    pub states: Vec<Vec<(State, f64)>>,
    /// Logarithm of the likelihood, repeats of one place counted as [`Problem::weight`] says.
    pub ln_likelihood: f64,
}

impl Sequence {
    /// `stay` is the probability that a dwell is in the cavity of the one before it.
    pub fn of(problem: &Problem, field: &Field, emission: &Emission, stay: f64) -> Sequence {
        let chain = Chain { layout: &problem.layout, stay };
        let mut states: Vec<Vec<(State, f64)>> = Vec::with_capacity(problem.tips_m.len());
        let mut ln_likelihood = 0.0;
        let mut buffer = Vec::new();
        for (i, tip) in problem.tips_m.iter().enumerate() {
            emission.at(i, &field.aligned_m(tip), &mut buffer);
            let top = buffer.iter().map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
            let mut now: Vec<(State, f64)> = buffer.iter().map(|&(s, ln)| (s, (ln - top).exp())).collect();
            for (state, p) in &mut now {
                *p *= match i.checked_sub(1).map(|before| &states[before]) {
                    None => chain.first(*state),
                    Some(before) => before.iter().map(|&(from, p)| p * chain.step(from, *state)).sum(),
                };
            }
            let total = normalise(&mut now);
            ln_likelihood += problem.weight[i] * (total.ln() + top);
            states.push(now);
        }
        smooth(&chain, &mut states);
        Sequence { states, ln_likelihood }
    }

    /// How often a dwell is in the cavity of the one before it, with a little prior.
    pub fn stay(&self) -> f64 {
        let best = self.best();
        let stays = best.windows(2).filter(|w| w[0].cavity().is_some() && w[0].cavity() == w[1].cavity());
        let moves = best.len().saturating_sub(1) as f64;
        ((stays.count() as f64 + 1.0) / (moves + 3.0)).clamp(0.05, 0.97)
    }

    /// The most probable state of each dwell.
    pub fn best(&self) -> Vec<State> {
        let most = |states: &Vec<(State, f64)>| {
            let best = states.iter().fold((State::Out, -1.0), |a, &b| if b.1 > a.1 { b } else { a });
            best.0
        };
        self.states.iter().map(most).collect()
    }
}

/// How well a sequence agrees with the configured order: at most `ORDER_LN` for moves that all go forward,
/// as much against moves that all go back, and something for starting where the order starts.
pub(super) fn ln_order(problem: &Problem, states: &[State]) -> f64 {
    let Some(order) = &problem.order else { return 0.0 };
    let visits: Vec<usize> = states
        .iter()
        .filter_map(|s| match s {
            State::Seat(k) => Some(*k),
            _ => None,
        })
        .collect();
    let rank = |k: usize| order.iter().position(|&o| o == k);
    let (mut forward, mut back) = (0.0, 0.0);
    for pair in visits.windows(2) {
        match (rank(pair[0]), rank(pair[1])) {
            (Some(a), Some(b)) if a < b => forward += 1.0,
            (Some(a), Some(b)) if a > b => back += 1.0,
            _ => {}
        }
    }
    let direction = if forward + back > 0.0 { ORDER_LN * (forward - back) / (forward + back) } else { 0.0 };
    let starts = !visits.is_empty() && visits.first() == order.first();
    direction + if starts { START_LN } else { 0.0 }
}

/// Backward pass: turns filtered probabilities into smoothed ones (Rauch-Tung-Striebel form of the chain).
fn smooth(chain: &Chain, states: &mut [Vec<(State, f64)>]) {
    for i in (0..states.len().saturating_sub(1)).rev() {
        let (head, tail) = states.split_at_mut(i + 1);
        let (now, next) = (&mut head[i], &tail[0]);
        let share: Vec<f64> = next
            .iter()
            .map(|&(to, p)| {
                let arriving: f64 = now.iter().map(|&(from, q)| q * chain.step(from, to)).sum();
                if arriving > 0.0 { p / arriving } else { 0.0 }
            })
            .collect();
        for (from, p) in now.iter_mut() {
            *p *= next.iter().zip(&share).map(|(&(to, _), s)| chain.step(*from, to) * s).sum::<f64>();
        }
        normalise(now);
    }
}

fn normalise(states: &mut [(State, f64)]) -> f64 {
    let total: f64 = states.iter().map(|s| s.1).sum();
    if total > 0.0 {
        states.iter_mut().for_each(|s| s.1 /= total);
    }
    total.max(f64::MIN_POSITIVE)
}

/// Probabilities of the chain.
struct Chain<'a> {
    layout: &'a Layout,
    stay: f64,
}

impl Chain<'_> {
    fn first(&self, state: State) -> f64 {
        state.cavity().map_or(1.0, |_| 1.0 / self.layout.len() as f64)
    }

    fn step(&self, from: State, to: State) -> f64 {
        match (from.cavity(), to.cavity()) {
            (_, None) => 1.0,
            (None, Some(_)) => 1.0 / self.layout.len() as f64,
            (Some(a), Some(b)) if a == b => self.stay,
            (Some(a), Some(b)) => {
                let any = (1.0 - TO_NEIGHBOUR) / self.layout.len() as f64;
                let near = if self.layout.are_neighbours(a, b) {
                    TO_NEIGHBOUR / self.layout.neighbour_count(a) as f64
                } else {
                    0.0
                };
                (1.0 - self.stay) * (any + near)
            }
        }
    }
}
