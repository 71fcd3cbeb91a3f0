//! Joint readings: sign, order, unit, counts a turn, zero.

use super::Hypothesis;
use armcal_core::units::DEGREES;
use armcal_core::{Arrival, Code, Dwell, Mend, Unit};
use armcal_stages::Inputs;
use std::f64::consts::FRAC_PI_2;

pub const SIGN: &str = "mend the direction of its encoder in [streams.joints] or in the driver that records it, or its axis in the model file";
const ORDER: &str = "mend `names` in [streams.joints], or the driver that records them";
const UNIT: &str = "mend `unit` in [streams.joints], or the driver that records it";
const COUNTS: &str = "mend `counts_per_turn` in [streams.joints], or the driver that records it";
pub const ZERO: &str = "mend `zero_counts` in [streams.joints], or theta of the model";

/// Joints beyond which only neighbours and ends are exchanged, not every two.
const FEW: usize = 3;

pub fn hypotheses(inputs: &Inputs) -> Vec<Hypothesis> {
    let names = inputs.chain.joint_names();
    let n = names.len();
    let turning: Vec<usize> = (0..n).filter(|&j| inputs.chain.joint_unit(j) == Unit::Radian).collect();
    let joint = |j: usize| format!("joint {} ({})", j + 1, names[j]);
    let mut all = Vec::new();
    all.extend(sign_sets(n).into_iter().map(|set| sign_reversal(names, set)));
    all.extend(joint_orders(n).into_iter().map(|order| in_order(names, order)));
    for (factor, words) in [
        (1.0 / DEGREES, "read as degrees instead of radians"),
        (DEGREES, "read as radians instead of degrees"),
    ] {
        let each = turning.iter().map(|&j| (vec![j], joint(j)));
        for (set, subject) in each.chain([(turning.clone(), "all joints".to_owned())]) {
            let change = format!("{subject} {words}");
            all.push(Hypothesis::new(Code::JointUnit, subject, change, UNIT, move |i| {
                i.each_dwell(|d| set.iter().for_each(|&j| scale_reading(d, j, factor)));
            }));
        }
    }
    for factor in [0.25, 0.5, 2.0, 4.0] {
        let each = (0..n).map(|j| (vec![j], joint(j)));
        for (set, subject) in each.chain([((0..n).collect(), "all joints".to_owned())]) {
            let change = format!("{factor} times the reading of {subject}");
            all.push(scaled_readings(subject, change, COUNTS, n, set, factor));
        }
    }
    for &j in &turning {
        for quarters in [1.0, 2.0, 3.0] {
            let by_deg = if quarters == 3.0 { -90.0 } else { 90.0 * quarters };
            let change = format!("the zero of {} moved by {by_deg} deg", joint(j));
            let shift = move |i: &mut Inputs| i.each_dwell(|d| shift_reading(d, j, quarters * FRAC_PI_2));
            let hypothesis = Hypothesis::new(Code::JointZero, joint(j), change, ZERO, shift);
            all.push(hypothesis.mended_by(Mend::of_reading(j, n, 1.0, quarters * FRAC_PI_2)));
        }
    }
    all
}

fn in_order(names: &[String], order: Vec<usize>) -> Hypothesis {
    let words: Vec<&str> = order.iter().map(|j| names[*j].as_str()).collect();
    let change = format!("the joints read in the order {}", words.join(", "));
    let mend = Mend::Order(order.clone());
    let reorder_all = move |i: &mut Inputs| i.each_dwell(|d| reorder(d, &order));
    Hypothesis::new(Code::JointOrder, "order of the joints", change, ORDER, reorder_all).mended_by(mend)
}

/// Three joints read in turn for each other, and all of them slipped by more than one place. Rarer.
pub fn cycles(inputs: &Inputs) -> Vec<Hypothesis> {
    let names = inputs.chain.joint_names();
    cyclic_orders(names.len()).into_iter().map(|order| in_order(names, order)).collect()
}

/// The readings of some of `n` joints times a factor.
pub fn scaled_readings(
    subject: String,
    change: String,
    remedy: &'static str,
    n: usize,
    set: Vec<usize>,
    factor: f64,
) -> Hypothesis {
    let factors = (0..n).map(|j| if set.contains(&j) { factor } else { 1.0 }).collect();
    let mend = Mend::Readings { factors, zeros_rad: vec![0.0; n] };
    let scale = move |i: &mut Inputs| i.each_dwell(|d| set.iter().for_each(|&j| scale_reading(d, j, factor)));
    Hypothesis::new(Code::JointScale, subject, change, remedy, scale).mended_by(mend)
}

/// The signs of these joints reversed.
pub fn sign_reversal(names: &[String], set: Vec<usize>) -> Hypothesis {
    let joint = |j: &usize| format!("joint {} ({})", j + 1, names[*j]);
    let subject = set.iter().map(joint).collect::<Vec<_>>().join(", ");
    let change = format!("the sign of {subject} reversed");
    let factors = (0..names.len()).map(|j| if set.contains(&j) { -1.0 } else { 1.0 }).collect();
    let mend = Mend::Readings { factors, zeros_rad: vec![0.0; names.len()] };
    let reverse = move |i: &mut Inputs| i.each_dwell(|d| set.iter().for_each(|&j| scale_reading(d, j, -1.0)));
    Hypothesis::new(Code::JointSign, subject, change, SIGN, reverse).mended_by(mend)
}

/// Each joint, every two of them, all.
fn sign_sets(n: usize) -> Vec<Vec<usize>> {
    let mut sets: Vec<Vec<usize>> = (0..n).map(|j| vec![j]).collect();
    sets.extend((0..n).flat_map(|j| (j + 1..n).map(move |k| vec![j, k])));
    if n > 2 {
        sets.push((0..n).collect());
    }
    sets
}

/// Orders other than the given one: all of few joints; of many the exchanges of two, the reverse, and the alphabetical
/// slip by one place either way.
fn joint_orders(n: usize) -> Vec<Vec<usize>> {
    let same: Vec<usize> = (0..n).collect();
    let rotated = |by: usize| -> Vec<usize> { (0..n).map(|j| (j + by) % n).collect() };
    let mut all: Vec<Vec<usize>> = Vec::new();
    for j in 0..n {
        for k in j + 1..n {
            let mut order = same.clone();
            order.swap(j, k);
            all.push(order);
        }
    }
    if n >= FEW {
        all.push(rotated(1));
        all.push(rotated(n - 1));
        all.push(same.iter().rev().copied().collect());
    }
    let mut once: Vec<Vec<usize>> = Vec::new();
    for order in all {
        if order != same && !once.contains(&order) {
            once.push(order);
        }
    }
    once
}

/// Orders of many joints that are none of [`joint_orders`]: three of them in turn, all by some places.
fn cyclic_orders(n: usize) -> Vec<Vec<usize>> {
    let known = joint_orders(n);
    let mut all: Vec<Vec<usize>> = Vec::new();
    for (a, b, c) in (0..n).flat_map(|a| (a + 1..n).flat_map(move |b| (b + 1..n).map(move |c| (a, b, c)))) {
        for turn in [[b, c, a], [c, a, b]] {
            let mut order: Vec<usize> = (0..n).collect();
            [a, b, c].iter().zip(turn).for_each(|(to, from)| order[*to] = from);
            all.push(order);
        }
    }
    all.extend((2..n.saturating_sub(1)).map(|by| (0..n).map(|j| (j + by) % n).collect()));
    all.retain(|order| !known.contains(order));
    all
}

pub fn scale_reading(d: &mut Dwell, j: usize, factor: f64) {
    d.joint_rad[j] *= factor;
    d.joint_sigma_rad[j] *= factor.abs();
    d.joint_spread_rad[j] *= factor.abs();
    d.path_memory_rad[j].iter_mut().for_each(|q| *q *= factor);
    d.moved_rad.iter_mut().for_each(|moved| moved[j] *= factor);
    if factor < 0.0 {
        d.arrival[j] = match d.arrival[j] {
            Arrival::Positive => Arrival::Negative,
            Arrival::Negative => Arrival::Positive,
            Arrival::Unknown => Arrival::Unknown,
        };
    }
}

pub fn shift_reading(d: &mut Dwell, j: usize, by_rad: f64) {
    d.joint_rad[j] += by_rad;
    d.path_memory_rad[j].iter_mut().for_each(|q| *q += by_rad);
}

/// Reads joint `j` where `order[j]` was read.
fn reorder(d: &mut Dwell, order: &[usize]) {
    fn by<T: Clone>(values: &mut Vec<T>, order: &[usize]) {
        *values = order.iter().map(|&from| values[from].clone()).collect();
    }
    by(&mut d.joint_rad, order);
    by(&mut d.joint_sigma_rad, order);
    by(&mut d.joint_spread_rad, order);
    by(&mut d.path_memory_rad, order);
    d.moved_rad.iter_mut().for_each(|moved| by(moved, order));
    by(&mut d.arrival, order);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_three_joints_every_order_is_tried_and_every_set_of_signs() {
        assert_eq!(joint_orders(3).len(), 5);
        assert_eq!(sign_sets(3).len(), 7);
        assert_eq!(joint_orders(6).len(), 15 + 3);
        assert!(joint_orders(1).is_empty() && cyclic_orders(3).is_empty());
        // Two turns of each of the twenty threes, and slips by two, three and four places.
        assert_eq!(cyclic_orders(6).len(), 2 * 20 + 3);
        assert!(cyclic_orders(6).contains(&vec![1, 2, 0, 3, 4, 5]));
    }
}
