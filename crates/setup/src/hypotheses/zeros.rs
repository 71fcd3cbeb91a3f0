//! Zeros of joints that were lost, with or without their sign, always or in some recordings.
//!
//! Rarer than a sign or an order, and more of them: tried where none of those explains the errors.

use super::drives::{bounded_amplitude, effect_hypothesis};
use super::joints::{SIGN, ZERO, scale_reading, shift_reading};
use super::model::{widen_bounds, zero_names};
use super::parts::recording_ranges;
use super::{Estimated, Freedom, Hypothesis, Mending};
use armcal_core::{Code, DwellId, Mend, Parameter, Unit};
use armcal_model::{EffectSpec, Override, Since};
use armcal_stages::{Change, Inputs};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

const HOMED: &str =
    "give what differs to a pipeline of its own, or add `[[effects]]` zero_slip with its `since`";

/// How far another zero of some recordings may come out.
const ZERO_BOUND_DEG: f64 = 60.0;
/// Where the search for such a zero starts.
const SLIPS_DEG: [f64; 6] = [-30.0, -12.0, -4.0, 4.0, 12.0, 30.0];
/// Where the search for the zero of the whole session starts.
const ZEROS_DEG: [f64; 8] = [-36.0, -26.0, -17.0, -8.0, 8.0, 17.0, 26.0, 36.0];
/// The same of readings that are shifted, all the way round; the first and the last only as neighbours.
const SHIFTS_DEG: [f64; 15] =
    [-180.0, -150.0, -120.0, -90.0, -60.0, -36.0, -17.0, 0.0, 17.0, 36.0, 60.0, 90.0, 120.0, 150.0, 180.0];
const QUARTERS: [f64; 3] = [-1.0, 1.0, 2.0];
/// No assembly puts a zero this far off [rad].
const FAR_ZERO_RAD: f64 = 0.1;
/// What moved between recordings by less is a slip by a tooth of a belt (2.8 deg of 128), which the diagnosis names [rad].
const SLIPPED_RAD: f64 = 0.055;

pub fn hypotheses(inputs: &Inputs, at_bound: &[Parameter], gross: bool) -> Vec<Hypothesis> {
    let n = inputs.chain.joint_names().len();
    let turning: Vec<usize> = (0..n).filter(|&j| inputs.chain.joint_unit(j) == Unit::Radian).collect();
    let mut all = by_quarters(inputs, &turning);
    all.extend(turning.iter().flat_map(|&j| by_any_angle(inputs, j)));
    all.extend(between_recordings(inputs, &turning));
    all.extend(all_zeros(inputs, at_bound, gross));
    all
}

/// `joint 2 (elbow)`.
fn joint_label(inputs: &Inputs, j: usize) -> String {
    format!("joint {} ({})", j + 1, inputs.chain.joint_names()[j])
}

/// One joint with another sign and a quarter or half turn, two joints with that much of a zero.
fn by_quarters(inputs: &Inputs, turning: &[usize]) -> Vec<Hypothesis> {
    let joint = |j: usize| joint_label(inputs, j);
    let n = inputs.chain.joint_names().len();
    let mut all = Vec::new();
    for &j in turning {
        for (quarters, words) in [(1.0, "+90"), (-1.0, "-90"), (2.0, "180")] {
            let change = format!("the sign of {} reversed and {words} deg added to it", joint(j));
            all.push(reversed_and_moved((joint(j), n), j, change, quarters * FRAC_PI_2));
        }
    }
    for (&j, &k) in turning.iter().flat_map(|j| turning.iter().filter(move |k| *k > j).map(move |k| (j, k))) {
        for (a, b) in QUARTERS.iter().flat_map(|a| QUARTERS.map(move |b| (*a, b))) {
            let (subject, degrees) = (format!("{} and {}", joint(j), joint(k)), (90.0 * a, 90.0 * b));
            let change = format!("the zeros of {subject} moved by {} and {} deg", degrees.0, degrees.1);
            let moved = [(j, a * FRAC_PI_2), (k, b * FRAC_PI_2)];
            let shift = move |i: &mut Inputs| {
                i.each_dwell(|d| moved.iter().for_each(|(j, by)| shift_reading(d, *j, *by)));
            };
            let of = |i: usize| moved.iter().find(|(j, _)| *j == i).map_or(0.0, |(_, by)| *by);
            let mend = Mend::Readings { factors: vec![1.0; n], zeros_rad: (0..n).map(of).collect() };
            let hypothesis = Hypothesis::new(Code::JointZero, subject, change, ZERO, shift);
            all.push(hypothesis.mended_by(mend));
        }
    }
    all
}

/// A joint with another zero, or with another zero and sign.
fn by_any_angle(inputs: &Inputs, j: usize) -> Vec<Hypothesis> {
    let theta = format!("{}.theta", inputs.chain.joint_names()[j]);
    let (subject, n) = (joint_label(inputs, j), inputs.chain.joint_names().len());
    let mending = Mending::zeros(inputs, [j]);
    let mut all = Vec::new();
    match inputs.chain.parameters().iter().find(|p| p.name == theta) {
        Some(p) => all.extend(ZEROS_DEG.iter().map(|start_deg| {
            let change = format!("another zero of {subject} ({theta})");
            let (name, plus) = (theta.clone(), start_deg.to_radians());
            let hypothesis = Hypothesis::new(Code::JointZero, subject.clone(), change, ZERO, move |i| {
                i.changes.push(Change { plus, ..widen_bounds(&name) });
            });
            let hypothesis = Hypothesis { mending: Some(mending.clone()), ..hypothesis };
            hypothesis.estimating(Freedom::Number, vec![Estimated::of(p, FAR_ZERO_RAD)])
        })),
        // Where no parameter is the zero of the joint, its readings are shifted.
        None => {
            let subject = subject.clone();
            all.extend(Hypothesis::of_each(&SHIFTS_DEG, 0.0, FAR_ZERO_RAD.to_degrees(), move |deg| {
                let change = format!("the zero of {subject} moved by {deg:.2} deg");
                let shift = move |i: &mut Inputs| i.each_dwell(|d| shift_reading(d, j, deg.to_radians()));
                let hypothesis = Hypothesis::new(Code::JointZero, subject.clone(), change, ZERO, shift);
                hypothesis.mended_by(Mend::of_reading(j, n, 1.0, deg.to_radians()))
            }));
        }
    }
    // No shift undoes another sign.
    all.extend(Hypothesis::of_each(&SHIFTS_DEG, f64::INFINITY, FAR_ZERO_RAD.to_degrees(), move |deg| {
        let change = format!("the sign of {subject} reversed and {deg:.2} deg added to it");
        reversed_and_moved((subject.clone(), n), j, change, deg.to_radians())
    }));
    all
}

/// The sign of a joint reversed and an angle added to its reading; `of` is its label and the number of joints.
fn reversed_and_moved(of: (String, usize), j: usize, change: String, by_rad: f64) -> Hypothesis {
    let mend = Mend::of_reading(j, of.1, -1.0, by_rad);
    let reverse = move |i: &mut Inputs| {
        i.each_dwell(|d| {
            scale_reading(d, j, -1.0);
            shift_reading(d, j, by_rad);
        });
    };
    Hypothesis::new(Code::JointSign, of.0, change, SIGN, reverse).mended_by(mend)
}

/// A joint that was homed again.
fn between_recordings(inputs: &Inputs, turning: &[usize]) -> Vec<Hypothesis> {
    let joint = |j: usize| joint_label(inputs, j);
    let mut all = Vec::new();
    let moments = homing_times(inputs);
    for (&j, (since, words)) in turning.iter().flat_map(|j| moments.iter().map(move |moment| (j, moment))) {
        for start_deg in SLIPS_DEG {
            let change = format!("another zero of {} {words}", joint(j));
            let spec = EffectSpec::new("zero_slip").at(j).since(*since);
            let unit = Some("deg".to_owned());
            let offset =
                ("offset", Override { unit, start: Some(start_deg), ..bounded_amplitude(ZERO_BOUND_DEG) });
            all.push(effect_hypothesis(Code::JointZero, joint(j), change, HOMED, spec, offset, SLIPPED_RAD));
        }
    }
    all
}

/// When a joint may have been homed again: from each recording on, and for each alone.
fn homing_times(inputs: &Inputs) -> Vec<(Since, String)> {
    let since = |part: Range<usize>| match part.end == inputs.seen.len() {
        true => Since::Dwell(DwellId { recording: part.start, dwell: 0 }),
        false => Since::Recording(part.start),
    };
    recording_ranges(inputs).into_iter().map(|(part, words)| (since(part), words)).collect()
}

/// The zeros of all joints, where one of them is on its bound, or hardly anything fits.
fn all_zeros(inputs: &Inputs, at_bound: &[Parameter], gross: bool) -> Option<Hypothesis> {
    let zeros = zero_names(inputs);
    let is_zero = |p: &&Parameter| zeros.contains(&p.name);
    let mut far: Vec<Estimated> = at_bound.iter().filter(is_zero).map(Estimated::beyond).collect();
    if far.is_empty() && gross {
        let all = inputs.chain.parameters().iter().filter(is_zero);
        far = all.map(|p| Estimated::of(p, FAR_ZERO_RAD)).collect();
    }
    (!far.is_empty()).then(|| {
        let change = "the zeros of all joints free to leave their bounds";
        let mending = Some(Mending::zeros(inputs, 0..inputs.chain.joint_names().len()));
        let widen = move |i: &mut Inputs| i.changes.extend(zeros.iter().map(|name| widen_bounds(name)));
        let hypothesis = Hypothesis::new(Code::JointZero, "all joints", change, ZERO, widen);
        Hypothesis { mending, ..hypothesis }.estimating(Freedom::Number, far)
    })
}
