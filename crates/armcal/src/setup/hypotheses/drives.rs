//! What stands between a joint and its reading: a gear, a pulley, another joint's angle, a zero that was lost.
//!
//! Rarer than a sign or an order, and more of them: tried where none of those explains the errors.

use super::joints::{SIGN, ZERO, scale, shift};
use super::{Estimated, Freedom, Hypothesis};
use crate::setup::trial::{Change, Inputs};
use armcal_core::{Parameter, Unit};
use armcal_model::{EffectTable, Extra, Override, Since, Word};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

const RATIO: &str = "mend `counts_per_turn` in [streams.joints], or divide by the gear's ratio in the driver";
const COUPLED: &str = "convert it in the driver that records it, or read the joint's own angle";
const FREE: &str = "leave out `free = false`, or mend the values that are held fixed";
const FIXED: &str = "free it in the model file, or mend its value there";
const PRIORS: &str = "mend the values in the model file, or widen the deviation that it allows";
const HOMED: &str = "give it to a pipeline of its own, or add `[[effects]]` zero_slip with its recording";

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
    for j in 0..names.len() {
        let spec = EffectTable {
            target: Some(Word::Number(j + 1)),
            ..wide("gear_ratio", "scale", RATIO_BOUND, None)
        };
        let change = format!("the gear ratio of {} estimated", joint(j));
        let estimated =
            Estimated { parameter: format!("gear_ratio:{}.scale", j + 1), nominal: 0.0, far: RATIO_OFF };
        all.push(effect("joint-scale", joint(j), change, RATIO, spec, estimated));
    }
    let later = || inputs.seen.iter().enumerate().skip(1);
    for (&j, (r, seen)) in turning.iter().flat_map(|j| later().map(move |r| (j, r))) {
        for start_deg in SLIPS_DEG {
            let spec = EffectTable {
                target: Some(Word::Number(j + 1)),
                since: Some(Word::Text(Since::Recording(r).to_string())),
                ..wide("zero_slip", "offset", ZERO_BOUND_DEG, Some(("deg", start_deg)))
            };
            let change = format!("another zero of {} from recording `{}` on", joint(j), seen.name);
            let estimated = Estimated {
                parameter: format!("zero_slip:{}@{r}.offset", j + 1),
                nominal: 0.0,
                far: SLIPPED_RAD,
            };
            all.push(effect("joint-zero", joint(j), change, HOMED, spec, estimated));
        }
    }
    for (&j, &start_deg) in turning.iter().flat_map(|j| ZEROS_DEG.iter().map(move |z| (j, z))) {
        let theta = format!("{}.theta", names[j]);
        let Some(p) = inputs.chain.parameters().iter().find(|p| p.name == theta) else { continue };
        let change = format!("another zero of {} ({theta})", joint(j));
        let estimated = vec![Estimated { parameter: theta.clone(), nominal: p.nominal, far: FAR_ZERO_RAD }];
        let hypothesis = Hypothesis::new("joint-zero", joint(j), change, ZERO, move |i| {
            i.changes.push(Change { plus: start_deg.to_radians(), ..super::model::widened(&theta) });
        });
        all.push(Hypothesis { estimated, ..hypothesis }.with(Freedom::Number));
    }
    all.extend(all_zeros(inputs, at_bound));
    all.extend(let_go(inputs));
    all
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
        let own =
            |p: &&Parameter| Estimated { parameter: p.name.clone(), nominal: p.nominal, far: FAR_FREED };
        let estimated = set.iter().map(own).collect();
        let hypothesis = Hypothesis::new("parameter-fixed", subject, change, FIXED, move |i| {
            i.changes.extend(names.iter().map(|name| Change::freed(name, FREED)));
        });
        all.push(Hypothesis { estimated, ..hypothesis }.with(freedom));
    }
    if inputs.pipeline.parameters.iter().any(|p| p.free == Some(false)) {
        let own = |p: &Parameter| Estimated { parameter: p.name.clone(), nominal: p.nominal, far: FAR_FREED };
        let estimated = parameters.iter().map(own).collect();
        let change = "all that is held fixed by the pipeline's [[parameters]] estimated";
        let hypothesis = Hypothesis::new("parameter-fixed", "the model", change, FREE, |i| {
            i.pipeline.parameters.retain(|p| p.free != Some(false));
        });
        all.push(Hypothesis { estimated, ..hypothesis }.with(Freedom::Frame));
    }
    let estimated: Vec<Estimated> = parameters
        .iter()
        .filter_map(|p| {
            let far = FAR_SIGMAS * p.prior_sigma.filter(|_| p.free)?;
            Some(Estimated { parameter: p.name.clone(), nominal: p.nominal, far })
        })
        .collect();
    if !estimated.is_empty() {
        let names: Vec<String> = estimated.iter().map(|own| own.parameter.clone()).collect();
        let change = "the priors and bounds of the model's parameters thirty times as wide";
        let hypothesis = Hypothesis::new("parameter-bound", "the model", change, PRIORS, move |i| {
            i.changes.extend(names.iter().map(|name| super::model::widened(name)));
        });
        all.push(Hypothesis { estimated, ..hypothesis }.with(Freedom::Frame));
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
        Hypothesis { estimated: far, ..Hypothesis::new("joint-zero", "all joints", change, ZERO, widen) }
            .with(Freedom::Number)
    })
}

/// An effect of the catalogue whose one amplitude may be far larger than its physics allows.
fn effect(
    code: &'static str,
    subject: String,
    change: String,
    remedy: &'static str,
    table: EffectTable,
    estimated: Estimated,
) -> Hypothesis {
    let add = move |i: &mut Inputs| i.pipeline.effects.push(table.clone());
    Hypothesis { estimated: vec![estimated], ..Hypothesis::new(code, subject, change, remedy, add) }
        .with(Freedom::Number)
}

/// `from` is the unit and the start.
fn wide(kind: &str, amplitude: &str, bound: f64, from: Option<(&str, f64)>) -> EffectTable {
    let (bound, unit) = (Some(bound), from.map(|from| from.0.to_owned()));
    let change = Override { unit, bound, prior: bound, start: from.map(|from| from.1), free: None };
    EffectTable {
        kind: kind.to_owned(),
        target: None,
        since: None,
        name: None,
        formula: None,
        acts_on: None,
        shape: BTreeMap::<String, Extra>::new(),
        parameters: BTreeMap::from([(amplitude.to_owned(), change)]),
    }
}
