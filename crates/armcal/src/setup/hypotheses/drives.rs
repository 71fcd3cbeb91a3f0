//! What stands between a joint and its reading: a gear, a pulley, another joint's angle, a zero that was lost.
//!
//! Rarer than a sign or an order, and more of them: tried where none of those explains the errors.

use super::joints::{SIGN, ZERO, scale, shift};
use super::parts::parts;
use super::{Estimated, Freedom, Hypothesis};
use crate::setup::trial::{Change, Inputs};
use armcal_core::{DwellId, Parameter, Unit};
use armcal_model::{EffectSpec, EffectTable, Override, Since};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

const RATIO: &str = "mend `counts_per_turn` in [streams.joints], or divide by the gear's ratio in the driver";
const COUPLED: &str = "convert it in the driver that records it, or read the joint's own angle";
const FREE: &str = "leave out `free = false`, or mend the values that are held fixed";
const FIXED: &str = "free it in the model file, or mend its value there";
const PRIORS: &str = "mend the values in the model file, or widen the deviation that it allows";
const HOMED: &str =
    "give what differs to a pipeline of its own, or add `[[effects]]` zero_slip with its `since`";

/// Ratios of gears and units that are mistaken for none; those near 1 are in `joints`.
const RATIOS: [f64; 6] = [3.0, 5.0, 10.0, 50.0, 100.0, 1000.0];
/// A ratio further from 1 than this is no tolerance of a gear or pulley.
const RATIO_OFF: f64 = 0.03;
/// How far a ratio and a zero may come out.
const RATIO_BOUND: f64 = 0.5;
const ZERO_BOUND_DEG: f64 = 60.0;
/// Where the search for such a zero starts.
const SLIPS_DEG: [f64; 6] = [-30.0, -12.0, -4.0, 4.0, 12.0, 30.0];
/// Where the search for the zero of the whole session starts.
const ZEROS_DEG: [f64; 8] = [-36.0, -26.0, -17.0, -8.0, 8.0, 17.0, 26.0, 36.0];
/// No assembly puts a zero this far off [rad].
const FAR_ZERO_RAD: f64 = 0.1;
/// What moved between recordings by less is a slip by a tooth of a belt (2.8 deg of 128), which the diagnosis names [rad].
const SLIPPED_RAD: f64 = 0.055;
/// Fixed parameters are let go this far, and are wrong if they come out this far off [m], [rad].
const FREED: f64 = 0.05;
const FAR_FREED: f64 = 2e-3;
/// Priors that are this many standard deviations off are too tight.
const FAR_SIGMAS: f64 = 4.0;

pub fn hypotheses(inputs: &Inputs, at_bound: &[Parameter]) -> Vec<Hypothesis> {
    let names = inputs.chain.joint_names();
    let turning: Vec<usize> =
        (0..names.len()).filter(|&j| inputs.chain.joint_unit(j) == Unit::Radian).collect();
    let joint = |j: usize| format!("joint {} ({})", j + 1, names[j]);
    let mut all = Vec::new();
    for &j in &turning {
        for (quarters, words) in [(1.0, "+90"), (-1.0, "-90"), (2.0, "180")] {
            let change = format!("the sign of {} reversed and {words} deg added to it", joint(j));
            all.push(Hypothesis::new("joint-sign", joint(j), change, SIGN, move |i| {
                i.each_dwell(|d| {
                    scale(d, j, -1.0);
                    shift(d, j, quarters * FRAC_PI_2);
                });
            }));
        }
    }
    let each = (0..names.len()).map(|j| (vec![j], joint(j)));
    for (set, subject) in each.chain([((0..names.len()).collect(), "all joints".to_owned())]) {
        for ratio in RATIOS {
            let (set, subject) = (set.clone(), subject.clone());
            let change = format!("the reading of {subject} divided by {ratio}");
            all.push(Hypothesis::new("joint-scale", subject, change, RATIO, move |i| {
                i.each_dwell(|d| set.iter().for_each(|&j| scale(d, j, 1.0 / ratio)));
            }));
        }
    }
    for &j in turning.iter().skip(1) {
        for (sign, words) in [(-1.0, "minus"), (1.0, "plus")] {
            let change = format!(
                "{} read as its reading {words} that of joint {j} (its reading is coupled)",
                joint(j)
            );
            all.push(Hypothesis::new("joint-coupling", joint(j), change, COUPLED, move |i| {
                i.each_dwell(|d| {
                    let before_rad = sign * d.joint_rad[j - 1];
                    shift(d, j, before_rad);
                });
            }));
        }
    }
    let within = |bound: f64| Override { bound: Some(bound), prior: Some(bound), ..Override::default() };
    for j in 0..names.len() {
        let change = format!("the gear ratio of {} estimated", joint(j));
        let spec = EffectSpec::new("gear_ratio").at(j);
        let scale = ("scale", within(RATIO_BOUND));
        all.push(effect("joint-scale", joint(j), change, RATIO, spec, scale, RATIO_OFF));
    }
    let moments = moments(inputs);
    for (&j, (since, words)) in turning.iter().flat_map(|j| moments.iter().map(move |moment| (j, moment))) {
        for start_deg in SLIPS_DEG {
            let change = format!("another zero of {} {words}", joint(j));
            let spec = EffectSpec::new("zero_slip").at(j).since(*since);
            let unit = Some("deg".to_owned());
            let offset = ("offset", Override { unit, start: Some(start_deg), ..within(ZERO_BOUND_DEG) });
            all.push(effect("joint-zero", joint(j), change, HOMED, spec, offset, SLIPPED_RAD));
        }
    }
    for (&j, &start_deg) in turning.iter().flat_map(|j| ZEROS_DEG.iter().map(move |z| (j, z))) {
        let theta = format!("{}.theta", names[j]);
        let Some(p) = inputs.chain.parameters().iter().find(|p| p.name == theta) else { continue };
        let change = format!("another zero of {} ({theta})", joint(j));
        let estimated = vec![Estimated::of(p, FAR_ZERO_RAD)];
        let hypothesis = Hypothesis::new("joint-zero", joint(j), change, ZERO, move |i| {
            i.changes.push(Change { plus: start_deg.to_radians(), ..super::model::widened(&theta) });
        });
        all.push(hypothesis.estimating(Freedom::Number, estimated));
    }
    all.extend(all_zeros(inputs, at_bound));
    all.extend(let_go(inputs));
    all
}

/// When a joint may have been homed again: from each recording on, and for each alone.
fn moments(inputs: &Inputs) -> Vec<(Since, String)> {
    let since = |part: Range<usize>| match part.end == inputs.seen.len() {
        true => Since::Dwell(DwellId { recording: part.start, dwell: 0 }),
        false => Since::Recording(part.start),
    };
    parts(inputs).into_iter().map(|(part, words)| (since(part), words)).collect()
}

/// Parameters that the model file holds fixed, each and together, and priors that are too tight.
fn let_go(inputs: &Inputs) -> Vec<Hypothesis> {
    let parameters = inputs.chain.parameters();
    let fixed: Vec<&Parameter> = parameters.iter().filter(|p| !p.free).collect();
    let mut all = Vec::new();
    let each =
        fixed.iter().map(|p| (vec![*p], format!("{}, which the model file holds fixed, estimated", p.name)));
    let together = (fixed.len() > 1)
        .then(|| (fixed.clone(), "all that the model file holds fixed estimated".to_owned()));
    for (set, change) in each.chain(together) {
        let names: Vec<String> = set.iter().map(|p| p.name.clone()).collect();
        let subject = armcal_core::listed(&names);
        let freedom = if set.len() == 1 { Freedom::Number } else { Freedom::Frame };
        let estimated = set.iter().map(|p| Estimated::of(p, FAR_FREED)).collect();
        let hypothesis = Hypothesis::new("parameter-fixed", subject, change, FIXED, move |i| {
            i.changes.extend(names.iter().map(|name| Change::freed(name, FREED)));
        });
        all.push(hypothesis.estimating(freedom, estimated));
    }
    if inputs.pipeline.parameters.iter().any(|p| p.free == Some(false)) {
        let estimated = parameters.iter().map(|p| Estimated::of(p, FAR_FREED)).collect();
        let change = "all that is held fixed by the pipeline's [[parameters]] estimated";
        let hypothesis = Hypothesis::new("parameter-fixed", "the model", change, FREE, |i| {
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
        let change = "the priors and bounds of the model's parameters thirty times as wide";
        let hypothesis = Hypothesis::new("parameter-bound", "the model", change, PRIORS, move |i| {
            i.changes.extend(names.iter().map(|name| super::model::widened(name)));
        });
        all.push(hypothesis.estimating(Freedom::Frame, estimated));
    }
    all
}

/// The zeros of all joints, where more than one of them is on its bound.
fn all_zeros(inputs: &Inputs, at_bound: &[Parameter]) -> Option<Hypothesis> {
    let is_zero = |p: &Parameter| p.name.ends_with(".theta");
    let zeros: Vec<Parameter> = inputs.chain.parameters().iter().filter(|p| is_zero(p)).cloned().collect();
    let far = at_bound.iter().filter(|p| is_zero(p)).map(Estimated::beyond).collect::<Vec<_>>();
    (far.len() > 1).then(|| {
        let change = "the zeros of all joints free to leave their bounds";
        let widen =
            move |i: &mut Inputs| i.changes.extend(zeros.iter().map(|p| super::model::widened(&p.name)));
        Hypothesis::new("joint-zero", "all joints", change, ZERO, widen).estimating(Freedom::Number, far)
    })
}

/// An effect of the catalogue whose one amplitude may be far larger than its physics allows.
fn effect(
    code: &'static str,
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
