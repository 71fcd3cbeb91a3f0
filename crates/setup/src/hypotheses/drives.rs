//! What stands between a joint and its reading: a gear, a pulley, another joint's angle; and what the model holds fixed.
//!
//! Rarer than a sign or an order: tried where none of those explains the errors.

use super::joints::{scale_reading, scaled_readings, shift_reading};
use super::model::{WIDER, widen_bounds, zero_names};
use super::{Estimated, Freedom, Hypothesis, Mending};
use armcal_core::units::DEGREES;
use armcal_core::{Code, Parameter, Unit};
use armcal_model::{EffectSpec, EffectTable, Override};
use armcal_stages::{Change, Inputs};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

const RATIO: &str = "mend `counts_per_turn` in [streams.joints], or divide by the gear's ratio in the driver";
const COUPLED: &str = "convert it in the driver that records it, or read the joint's own angle";
const FREE: &str = "leave out `free = false`, or mend the values that are held fixed";
const FIXED: &str = "free it in the model file, or mend its value there";
const PRIORS: &str = "mend the values in the model file, or widen the deviation that it allows";

const UNIT: &str = "publish radians, or give the factor of the unit";
const RANGE: &str = "publish angles, or give the factor of the unit";

/// Scales that all joints may have in common, the first and the last only as neighbours, and what no gear is off by.
const COMMON_SCALES: [f64; 11] = [0.2, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.45, 2.0, 3.0, 5.0];
const FAR_COMMON_SCALE: f64 = 0.03;
/// Ratios of gears and units that are mistaken for none; those near 1 are in `joints`.
const RATIOS: [f64; 6] = [3.0, 5.0, 10.0, 50.0, 100.0, 1000.0];
/// A ratio further from 1 than this is no tolerance of a gear or pulley.
const RATIO_OFF: f64 = 0.03;
/// How far a ratio may come out.
const RATIO_BOUND: f64 = 0.5;
/// Fixed parameters are let go this far, and are wrong if they come out this far off [m], [rad].
const FREED: f64 = 0.05;
const FAR_FREED: f64 = 2e-3;
/// Priors that are this many standard deviations off are too tight.
const FAR_SIGMAS: f64 = 4.0;

pub fn hypotheses(inputs: &Inputs) -> Vec<Hypothesis> {
    let names = inputs.chain.joint_names();
    let turning: Vec<usize> =
        (0..names.len()).filter(|&j| inputs.chain.joint_unit(j) == Unit::Radian).collect();
    let joint = |j: usize| format!("joint {} ({})", j + 1, names[j]);
    let mut all = Vec::new();
    let each = (0..names.len()).map(|j| (vec![j], joint(j)));
    for (set, subject) in each.chain([((0..names.len()).collect(), "all joints".to_owned())]) {
        for ratio in RATIOS {
            let change = format!("the reading of {subject} divided by {ratio}");
            let (subject, set) = (subject.clone(), set.clone());
            all.push(scaled_readings(subject, change, RATIO, names.len(), set, 1.0 / ratio));
        }
    }
    for &j in turning.iter().skip(1) {
        for (sign, words) in [(-1.0, "minus"), (1.0, "plus")] {
            let change = format!(
                "{} read as its reading {words} that of joint {j} (its reading is coupled)",
                joint(j)
            );
            all.push(Hypothesis::new(Code::JointCoupling, joint(j), change, COUPLED, move |i| {
                i.each_dwell(|d| {
                    let before_rad = sign * d.joint_rad[j - 1];
                    shift_reading(d, j, before_rad);
                });
            }));
        }
    }
    for j in 0..names.len() {
        let change = format!("the gear ratio of {} estimated", joint(j));
        let spec = EffectSpec::new("gear_ratio").at(j);
        let scale = ("scale", bounded_amplitude(RATIO_BOUND));
        all.push(effect_hypothesis(Code::JointScale, joint(j), change, RATIO, spec, scale, RATIO_OFF));
    }
    all
}

/// Units that all joints have in common: shares of their ranges, and any scale.
pub fn common_units(inputs: &Inputs) -> Vec<Hypothesis> {
    let n = inputs.chain.joint_names().len();
    let mut all = shares_of_ranges(inputs);
    let everyone = || (0..n).collect();
    for (unit, factor) in
        [("turns", TAU), ("gon, read as radians", PI / 200.0), ("gon, read as degrees", 0.9)]
    {
        let change = format!("the readings of all joints taken for {unit}");
        all.push(scaled_readings("all joints".to_owned(), change, UNIT, n, everyone(), factor));
    }
    all.extend(Hypothesis::of_each(&COMMON_SCALES, 1.0, FAR_COMMON_SCALE, move |scale| {
        let change = format!("{scale:.4} times the readings of all joints (a unit that they have in common)");
        scaled_readings("all joints".to_owned(), change, RANGE, n, (0..n).collect(), scale)
    }));
    all
}

/// Readings that are shares of the range between each joint's limits, as low-cost arms publish them.
fn shares_of_ranges(inputs: &Inputs) -> Vec<Hypothesis> {
    let n = inputs.chain.joint_names().len();
    let own = |j: usize| inputs.chain.joint_limits(j, [f64::INFINITY, f64::NEG_INFINITY]);
    let ranges: Vec<[f64; 2]> = (0..n).map(own).collect();
    if n < 2 || ranges.iter().flatten().any(|end| !end.is_finite()) {
        return Vec::new();
    }
    // What the whole range reads, from its middle, and where the middle reads.
    let scales = [
        ("per cent of their range, from -100 to 100", 100.0 / DEGREES, 0.0),
        ("per cent of their range, from 0 to 100", 50.0 / DEGREES, 50.0 / DEGREES),
        ("shares of their range, from -1 to 1", 1.0, 0.0),
        ("shares of their range, from 0 to 1", 0.5, 0.5),
    ];
    let hypothesis = |(words, half, middle): (&str, f64, f64)| {
        let factor = |[low, high]: &[f64; 2]| 0.5 * (high - low) / half;
        let zero = |range: &[f64; 2]| 0.5 * (range[0] + range[1]) - factor(range) * middle;
        let factors: Vec<f64> = ranges.iter().map(factor).collect();
        let zeros_rad: Vec<f64> = ranges.iter().map(zero).collect();
        let known = (factors.clone(), zeros_rad.clone());
        let mending = match Mending::zeros(inputs, 0..n) {
            Mending::Zeros { of, .. } => Some(Mending::Zeros { of, known }),
            other => Some(other),
        };
        let change = format!("the readings of all joints taken for {words}");
        // The middle of the range that such an arm was shown is not that of its drawing.
        let zeros = zero_names(inputs);
        let take = move |i: &mut Inputs| {
            i.changes.extend(zeros.iter().map(|name| widen_bounds(name)));
            i.each_dwell(|d| {
                for (j, (factor, zero)) in factors.iter().zip(&zeros_rad).enumerate() {
                    scale_reading(d, j, *factor);
                    shift_reading(d, j, *zero);
                }
            });
        };
        Hypothesis { mending, ..Hypothesis::new(Code::JointUnit, "all joints", change, RANGE, take) }
    };
    scales.into_iter().map(hypothesis).collect()
}

/// Parameters that the model file holds fixed, each and together, and priors that are too tight.
pub fn let_go(inputs: &Inputs) -> Vec<Hypothesis> {
    let parameters = inputs.chain.parameters();
    let fixed: Vec<&Parameter> = parameters.iter().filter(|p| !p.free).collect();
    let mut all = Vec::new();
    let each =
        fixed.iter().map(|p| (vec![*p], format!("{}, which the model file holds fixed, estimated", p.name)));
    let together = (fixed.len() > 1)
        .then(|| (fixed.clone(), "all that the model file holds fixed estimated".to_owned()));
    for (set, change) in each.chain(together) {
        let names: Vec<String> = set.iter().map(|p| p.name.clone()).collect();
        let subject = armcal_core::list_names(&names);
        let freedom = if set.len() == 1 { Freedom::Number } else { Freedom::Frame };
        let estimated = set.iter().map(|p| Estimated::of(p, FAR_FREED)).collect();
        let hypothesis = Hypothesis::new(Code::ParameterFixed, subject, change, FIXED, move |i| {
            i.changes.extend(names.iter().map(|name| Change::freed(name, FREED)));
        });
        all.push(hypothesis.estimating(freedom, estimated));
    }
    if inputs.pipeline.parameters.iter().any(|p| p.free == Some(false)) {
        let estimated = parameters.iter().map(|p| Estimated::of(p, FAR_FREED)).collect();
        let change = "all that is held fixed by the pipeline's [[parameters]] estimated";
        let hypothesis = Hypothesis::new(Code::ParameterFixed, "the model", change, FREE, |i| {
            i.pipeline.parameters.retain(|p| p.free != Some(false));
        });
        all.push(hypothesis.estimating(Freedom::Frame, estimated));
    }
    let estimated: Vec<Estimated> = parameters
        .iter()
        .filter_map(|p| Some(Estimated::of(p, FAR_SIGMAS * p.prior_sigma.filter(|_| p.free)?)))
        .collect();
    if !estimated.is_empty() {
        let names: Vec<String> = estimated.iter().map(|own| own.parameter.clone()).collect();
        let change = format!("the priors and bounds of the model's parameters {WIDER} times as wide");
        let hypothesis = Hypothesis::new(Code::ParameterBound, "the model", change, PRIORS, move |i| {
            i.changes.extend(names.iter().map(|name| widen_bounds(name)));
        });
        all.push(hypothesis.estimating(Freedom::Frame, estimated));
    }
    all
}

/// An amplitude as far as this either way.
pub fn bounded_amplitude(bound: f64) -> Override {
    Override { bound: Some(bound), prior: Some(bound), ..Override::default() }
}

/// An effect of the catalogue whose one amplitude may be far larger than its physics allows.
pub fn effect_hypothesis(
    code: Code,
    subject: String,
    change: String,
    remedy: &'static str,
    spec: EffectSpec,
    (amplitude, said): (&str, Override),
    far: f64,
) -> Hypothesis {
    let estimated = Estimated { parameter: format!("{spec}.{amplitude}"), nominal: 0.0, far };
    let overrides = BTreeMap::from([(amplitude.to_owned(), said)]);
    let table = EffectTable::from(&EffectSpec { overrides, ..spec });
    let add = move |i: &mut Inputs| i.pipeline.effects.push(table.clone());
    Hypothesis::new(code, subject, change, remedy, add).estimating(Freedom::Number, vec![estimated])
}
