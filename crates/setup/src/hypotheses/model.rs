//! The nominal arm: rows with another sign, lengths and angles in other units, a parameter far beyond its bounds.

use super::joints::ZERO;
use super::{Estimated, Freedom, Hypothesis, Mending};
use armcal_config::Measure;
use armcal_core::units::DEGREES;
use armcal_core::{Against, Code, Parameter, Unit};
use armcal_model::Arm;
use armcal_recording::Streams;
use armcal_stages::{Change, Inputs};
use nalgebra::Vector3;

const FILE: &str = "mend the model file, or widen the deviation that it allows";
/// A parameter on its bound is let go this many times as far: from one arm of a make to the next larger one.
pub const WIDER: f64 = 60.0;
/// Sizes of the model that are tried, the first and the last only as neighbours, and what no tolerance reaches.
const SIZES: [f64; 11] = [0.4, 0.55, 0.65, 0.75, 0.87, 1.0, 1.15, 1.3, 1.45, 1.6, 2.0];
const FAR_SIZE: f64 = 0.05;
/// The same of what is added to the last length.
const LONGER_MM: [f64; 15] = [
    -400.0, -300.0, -240.0, -180.0, -120.0, -70.0, -30.0, 0.0, 30.0, 70.0, 120.0, 180.0, 240.0, 300.0, 400.0,
];
const FAR_LONGER_MM: f64 = 15.0;
const AXIS: &str = "mend its <axis> in the URDF, or its <origin>";
/// Axes with a smaller product stand across each other.
const ACROSS: f64 = 0.1;
/// Parameters smaller than these are zero: their sign says nothing [m], [rad].
const SMALLEST: f64 = 1e-3;

pub fn hypotheses(inputs: &Inputs, at_bound: &[Parameter]) -> Vec<Hypothesis> {
    let mut all = Vec::new();
    for p in inputs.chain.parameters() {
        let name = p.name.clone();
        if p.nominal.abs() > SMALLEST {
            let change = format!("the sign of {name} reversed");
            all.push(nominal_change(Code::ModelSign, &name, change, -1.0, 0.0));
        }
        if p.unit == Unit::Radian && (name.ends_with(".theta") || name.ends_with(".alpha")) {
            for quarters in [-1.0, 1.0, 2.0] {
                let change = format!("{} deg added to {name}", 90.0 * quarters);
                all.push(nominal_change(
                    Code::ModelAngle,
                    &name,
                    change,
                    1.0,
                    quarters * std::f64::consts::FRAC_PI_2,
                ));
            }
        }
    }
    let files = model_files(inputs);
    for (unit, factor, what, words) in [
        (Unit::Metre, 1e-3, "lengths", "a thousandth (micrometres given as millimetres)"),
        (Unit::Metre, 1e3, "lengths", "a thousand times as long (metres given as millimetres)"),
        (Unit::Metre, 0.1, "lengths", "a tenth"),
        (Unit::Metre, 10.0, "lengths", "ten times as long (centimetres given as millimetres)"),
        (Unit::Metre, 25.4, "lengths", "25.4 times as long (inches given as millimetres)"),
        (Unit::Metre, 1.0 / 25.4, "lengths", "divided by 25.4 (millimetres given as inches)"),
        (Unit::Radian, DEGREES, "angles", "read as radians, not degrees"),
        (Unit::Radian, 1.0 / DEGREES, "angles", "read as degrees, not radians"),
    ] {
        for (model, parameters) in &files {
            let own = parameters.iter().filter(|p| p.unit == unit);
            let names: Vec<String> = own.map(|p| p.name.clone()).collect();
            if !names.is_empty() {
                let change = format!("all {what} of {model} {words}");
                all.push(Hypothesis::new(Code::ModelUnit, model.clone(), change, FILE, move |i| {
                    i.changes.extend(names.iter().map(|name| Change::nominal(name, factor, 0.0)));
                }));
            }
        }
    }
    for (model, parameters) in &files {
        let own = parameters.iter().filter(|p| [".d", ".alpha"].iter().any(|field| p.name.ends_with(field)));
        let mirrored: Vec<String> = own.map(|p| p.name.clone()).collect();
        if !mirrored.is_empty() {
            let of = if files.len() > 1 { format!(" of {model}") } else { String::new() };
            let change = format!(
                "the signs of every d and alpha of the DH table{of} reversed (the arm mirrored: of the other hand)"
            );
            all.push(Hypothesis::new(Code::ModelMirrored, model.clone(), change, FILE, move |i| {
                i.changes.extend(mirrored.iter().map(|name| Change::nominal(name, -1.0, 0.0)));
            }));
        }
    }
    let exchanged = columns_exchanged(inputs.chain.parameters());
    if !exchanged.is_empty() {
        let change = "the columns a and d of the DH table exchanged";
        all.push(Hypothesis::new(Code::DhColumns, "the model", change, FILE, move |i| {
            i.changes.extend(exchanged.clone())
        }));
    }
    if let Some(chain) = inputs.chain.in_other_convention() {
        let change = "the DH table read by the other convention (standard and modified exchanged)";
        all.push(Hypothesis::new(Code::DhConvention, "the model", change, FILE, move |i| {
            i.chain = chain.clone()
        }));
    }
    for row in 0.. {
        let Some(chain) = inputs.chain.with_rows_exchanged(row) else { break };
        let change = format!("rows {} and {} of the DH table exchanged", row + 1, row + 2);
        all.push(Hypothesis::new(Code::DhRows, "the model", change, FILE, move |i| i.chain = chain.clone()));
    }
    for p in at_bound {
        let own = p.name.clone();
        let names = inputs.chain.joint_names();
        let is_zero = |j: &usize| inputs.chain.joint_zero(*j).is_some_and(|(zero, _)| zero.name == p.name);
        let joint = (0..names.len()).find(is_zero);
        let (code, subject, remedy) = match joint {
            Some(j) => (Code::JointZero, format!("the zero of {} ({})", names[j], p.name), ZERO),
            None => (Code::ParameterBound, p.name.clone(), FILE),
        };
        let mending = joint.map(|j| Mending::zeros(inputs, [j]));
        let change = format!("{subject} free to leave its bounds");
        let hypothesis =
            Hypothesis::new(code, subject, change, remedy, move |i| i.changes.push(widen_bounds(&own)));
        let hypothesis = Hypothesis { mending, ..hypothesis };
        all.push(hypothesis.estimating(Freedom::Number, vec![Estimated::beyond(p)]));
    }
    if at_bound.len() > 1 {
        let own: Vec<String> = at_bound.iter().map(|p| p.name.clone()).collect();
        let change = format!("{} free to leave their bounds", armcal_core::list_names(&own));
        let hypothesis = Hypothesis::new(Code::ParameterBound, "the model", change, FILE, move |i| {
            i.changes.extend(own.iter().map(|name| widen_bounds(name)));
        });
        let estimated = at_bound.iter().map(Estimated::beyond).collect();
        all.push(hypothesis.estimating(Freedom::Frame, estimated));
    }
    all
}

/// The parameters of each model file. Of tips joined to each other, or brought into points, and seen by no sensor no change of all
/// lengths at once is tried: a robot that is smaller, or seen in a mirror, closes just as well.
fn model_files(inputs: &Inputs) -> Vec<(String, &[Parameter])> {
    let Inputs { pipeline, chain, .. } = inputs;
    let Streams { tip, bodies, .. } = &pipeline.streams;
    let measured = pipeline.measures();
    let known = |m: &Measure| m.length.is_some() && matches!(m.against, Against::Fixed(_));
    let is_unseen = !measured.is_empty()
        && !measured.iter().any(known)
        && tip.is_none()
        && bodies.is_empty()
        && pipeline.table.is_none();
    let of_arm =
        |arm: &Arm| (format!("the model of {}", arm.name), &chain.parameters()[arm.parameters.clone()]);
    match chain.arms() {
        [] if is_unseen => Vec::new(),
        [] => vec![("the model".to_owned(), chain.parameters())],
        arms => arms.iter().map(of_arm).collect(),
    }
}

/// A model of another size, or of an arm with another tool. Rarer.
pub fn of_another_size(inputs: &Inputs) -> Vec<Hypothesis> {
    let mut all = Vec::new();
    for (model, parameters) in model_files(inputs) {
        let lengths: Vec<String> =
            parameters.iter().filter(|p| p.unit == Unit::Metre).map(|p| p.name.clone()).collect();
        if lengths.is_empty() {
            continue;
        }
        all.extend(Hypothesis::of_each(&SIZES, 1.0, FAR_SIZE, move |times| {
            let lengths = lengths.clone();
            let change =
                format!("all lengths of {model} {times:.3} times as long (the model file of another arm)");
            Hypothesis::new(Code::LinkLength, model.clone(), change, FILE, move |i| {
                i.changes.extend(lengths.iter().map(|name| Change::nominal(name, times, 0.0)));
            })
        }));
        for column in [".a", ".d"] {
            let Some(last) = parameters.iter().rev().find(|p| p.name.ends_with(column)) else { continue };
            let name = last.name.clone();
            all.extend(Hypothesis::of_each(&LONGER_MM, 0.0, FAR_LONGER_MM, move |mm| {
                let change = format!("{mm:+.1} mm added to {name} (a tool that is longer, or was left out)");
                nominal_change(Code::ToolLength, &name, change, 1.0, mm * 1e-3)
            }));
        }
    }
    all
}

/// A joint whose axis is drawn along another one of its frame. Rarer.
pub fn of_another_axis(inputs: &Inputs) -> Vec<Hypothesis> {
    let words = [("x", Vector3::x()), ("y", Vector3::y()), ("z", Vector3::z())];
    let mut all = Vec::new();
    for (j, name) in inputs.chain.joint_names().iter().enumerate() {
        let Some(now) = inputs.chain.joint_axis(j) else { continue };
        // The other sign is that of its reading.
        for (word, axis) in words.into_iter().filter(|(_, axis)| axis.dot(&now).abs() < ACROSS) {
            for (sign, minus) in [(1.0, ""), (-1.0, "-")] {
                let subject = format!("joint {} ({name})", j + 1);
                let change = format!("the axis of {subject} along {minus}{word} of its frame");
                all.push(Hypothesis::new(Code::ModelAxis, subject, change, AXIS, move |i| {
                    i.chain = i.chain.clone().with_joint_axis(j, sign * axis);
                }));
            }
        }
    }
    all
}

/// The changes that give every a its row's d, and the reverse.
fn columns_exchanged(parameters: &[Parameter]) -> Vec<Change> {
    let other = |p: &Parameter| {
        let row = p.name.strip_suffix(".a").map(|row| format!("{row}.d"));
        let name = row.or_else(|| p.name.strip_suffix(".d").map(|row| format!("{row}.a")))?;
        let other = parameters.iter().find(|q| q.name == name)?;
        Some(Change::nominal(&p.name, 0.0, other.nominal))
    };
    parameters.iter().filter_map(other).collect()
}

/// The parameters that are the zeros of joints.
pub fn zero_names(inputs: &Inputs) -> Vec<String> {
    let joints = 0..inputs.chain.joint_names().len();
    joints.filter_map(|j| inputs.chain.joint_zero(j)).map(|(p, _)| p.name.clone()).collect()
}

/// A parameter let go far beyond its bounds.
pub fn widen_bounds(name: &str) -> Change {
    Change::widened(name, WIDER)
}

fn nominal_change(code: Code, name: &str, change: String, times: f64, plus: f64) -> Hypothesis {
    let own = name.to_owned();
    Hypothesis::new(code, name, change, FILE, move |i| i.changes.push(Change::nominal(&own, times, plus)))
}
