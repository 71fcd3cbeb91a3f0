//! The nominal arm: rows with another sign, lengths and angles in other units, a parameter far beyond its bounds.

use super::{Freedom, Hypothesis};
use crate::setup::trial::{Change, Inputs};
use armcal_core::Unit;

const FILE: &str = "mend the model file, or widen the deviation that it allows";
/// A parameter on its bound is let go this many times as far.
const WIDER: f64 = 30.0;
/// Parameters smaller than these are zero: their sign says nothing [m], [rad].
const SMALLEST: f64 = 1e-3;

pub fn hypotheses(inputs: &Inputs, at_bound: &[String]) -> Vec<Hypothesis> {
    let mut all = Vec::new();
    for p in inputs.chain.parameters() {
        let name = p.name.clone();
        if p.nominal.abs() > SMALLEST {
            let change = format!("the sign of {name} reversed");
            all.push(nominal("model-sign", &name, change, -1.0, 0.0));
        }
        if p.unit == Unit::Radian && (name.ends_with(".theta") || name.ends_with(".alpha")) {
            for quarters in [-1.0, 1.0, 2.0] {
                let change = format!("{} deg added to {name}", 90.0 * quarters);
                all.push(nominal("model-angle", &name, change, 1.0, quarters * std::f64::consts::FRAC_PI_2));
            }
        }
    }
    let of_unit = |unit: Unit| -> Vec<String> {
        inputs.chain.parameters().iter().filter(|p| p.unit == unit).map(|p| p.name.clone()).collect()
    };
    for (unit, factors, words) in [
        (Unit::Metre, [1e-3, 1e3, 0.1, 10.0, 25.4, 1.0 / 25.4].as_slice(), "lengths"),
        (Unit::Radian, [180.0 / std::f64::consts::PI, std::f64::consts::PI / 180.0].as_slice(), "angles"),
    ] {
        let names = of_unit(unit);
        for &factor in factors.iter().filter(|_| !names.is_empty()) {
            let names = names.clone();
            let change = format!("all {words} of the model times {factor:.4}");
            all.push(Hypothesis::new("model-unit", "the model", change, FILE, move |i| {
                i.changes.extend(names.iter().map(|name| Change::nominal(name, factor, 0.0)));
            }));
        }
    }
    if let Some(chain) = inputs.chain.in_other_convention() {
        let change = "the DH table read by the other convention (standard and modified exchanged)";
        all.push(Hypothesis::new("dh-convention", "the model", change, FILE, move |i| {
            i.chain = chain.clone()
        }));
    }
    for row in 0.. {
        let Some(chain) = inputs.chain.with_rows_exchanged(row) else { break };
        let change = format!("rows {} and {} of the DH table exchanged", row + 1, row + 2);
        all.push(Hypothesis::new("dh-rows", "the model", change, FILE, move |i| i.chain = chain.clone()));
    }
    for name in at_bound {
        let own = name.clone();
        let change = format!("{name} free to leave its bounds");
        let hypothesis = Hypothesis::new("parameter-bound", name.as_str(), change, FILE, move |i| {
            i.changes.push(Change::widened(&own, WIDER));
        });
        all.push(hypothesis.with(Freedom::Number));
    }
    if at_bound.len() > 1 {
        let own = at_bound.to_vec();
        let change = format!("{} free to leave their bounds", armcal_core::listed(at_bound));
        let hypothesis = Hypothesis::new("parameter-bound", "the model", change, FILE, move |i| {
            i.changes.extend(own.iter().map(|name| Change::widened(name, WIDER)));
        });
        all.push(hypothesis.with(Freedom::Frame));
    }
    all
}

fn nominal(code: &'static str, name: &str, change: String, times: f64, plus: f64) -> Hypothesis {
    let own = name.to_owned();
    Hypothesis::new(code, name, change, FILE, move |i| i.changes.push(Change::nominal(&own, times, plus)))
}
