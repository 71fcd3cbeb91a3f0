//! Checks of the robot's parameters against an accepted result.

use super::limits::Limits;
use super::measured::Check;
use super::reasons;
use super::reference::{Calibrated, FittedParameter};
use super::told::listed_up;
use armcal_core::printable_name;
use armcal_result::Run;

/// A parameter in both results.
#[derive(Debug, Clone, PartialEq)]
pub struct Shift<'a> {
    parameter: &'a FittedParameter,
    /// Now minus then, SI.
    by: f64,
    /// Joint standard deviation of the two values, SI.
    sigma: f64,
}

impl Shift<'_> {
    /// How many joint standard deviations; infinite where both values are exact.
    fn sigmas(&self) -> f64 {
        if self.by == 0.0 { 0.0 } else { self.by.abs() / self.sigma }
    }
}

/// Lengths and angles of the arm and of its effects. A change counts only beyond what the uncertainties explain.
pub fn check_parameter_shifts(run: &Run, now: &Calibrated, limits: &Limits) -> Vec<Check> {
    let Some(reference) = &limits.reference else { return Vec::new() };
    let section = &limits.section;
    let rows = [
        ("max_shift_mm", "length", "m", 1e3, "mm", section.max_shift_mm),
        ("max_shift_deg", "angle", "rad", 1f64.to_degrees(), "deg", section.max_shift_deg),
    ];
    rows.into_iter()
        .filter_map(|(name, what, unit, to_display, shown, limit)| {
            let limit = limit?;
            let all = shifts_of(reference, now, unit);
            let mut real: Vec<&Shift<'_>> = all.iter().filter(|s| s.sigmas() > limits.shift_sigmas).collect();
            real.sort_by(|a, b| b.by.abs().total_cmp(&a.by.abs()));
            let largest = real.first().map_or(0.0, |s| s.by.abs() * to_display);
            let measured = (!all.is_empty()).then_some(largest);
            let check = Check::at_most(name, measured, limit, shown);
            let said = shift_summary(what, &all, &real, reference);
            Some(check.saying(said, || {
                real.retain(|s| s.by.abs() * to_display > limit);
                // With tens of parameters the one that jumped stands out by its significance, not always by its size.
                real.sort_by(|a, b| b.sigmas().total_cmp(&a.sigmas()));
                let moved = real.iter().map(|s| shift_sentence(s, to_display, shown, limits)).collect();
                let mut why = listed_up(moved, "parameters");
                why.extend(model_differences(reference, now));
                if !reasons::is_model_adequate(run) {
                    why.extend(reasons::of_run(run, limits));
                }
                why
            }))
        })
        .collect()
}

fn shifts_of<'a>(reference: &'a Calibrated, now: &'a Calibrated, unit: &str) -> Vec<Shift<'a>> {
    now.of_arm()
        .filter(|p| p.unit == unit)
        .filter_map(|p| {
            let then = reference.of_arm().find(|r| r.name == p.name && r.unit == p.unit)?;
            Some(Shift { parameter: p, by: p.value - then.value, sigma: p.sigma.hypot(then.sigma) })
        })
        .collect()
}

fn shift_summary(what: &str, all: &[Shift<'_>], real: &[&Shift<'_>], reference: &Calibrated) -> String {
    let than = printable_name(&reference.pipeline);
    match (all.len(), real.first()) {
        (0, _) => {
            format!("no {what} is in both this result and the reference (`{than}`), so nothing was compared")
        }
        (n, None) => format!("none of the {n} {what}s differs from the reference by more than chance"),
        (n, Some(largest)) => format!(
            "{} of {n} {what}s differ from the reference by more than chance, most of all `{}`",
            real.len(),
            printable_name(&largest.parameter.name)
        ),
    }
}

fn shift_sentence(shift: &Shift<'_>, to_display: f64, unit: &str, limits: &Limits) -> String {
    let p = shift.parameter;
    let zero = reasons::zero_of(&p.name);
    let teeth = zero.map_or(String::new(), |joint| limits.in_teeth(joint, shift.by));
    let sigmas = match shift.sigmas() {
        s if s.is_finite() => format!("{s:.0} standard deviations"),
        _ => "fixed in both fits".to_owned(),
    };
    let cause = match (zero, p.role.as_str()) {
        (_, "effect") => "This effect grew or shrank: look for wear, another temperature, load or lubricant.".to_owned(),
        (Some(joint), _) => format!(
            "The zero of {joint} shifted: an encoder or a belt slipped, or it was homed elsewhere; look at its coupling, \
             set-screws and belt teeth."
        ),
        (None, _) => {
            "The arm itself differs, or another parameter of the fit drags this one along: look for a bent, exchanged \
             or remounted part."
                .to_owned()
        }
    };
    let bound = if p.at_bound { " It is on its bound: the true change may be larger." } else { "" };
    let by = shift.by * to_display;
    printable_name(&format!("`{}` moved by {by:+.3} {unit} ({sigmas}{teeth}). {cause}{bound}", p.name))
}

/// What only one of the two models has: the others may differ because of it.
fn model_differences(reference: &Calibrated, now: &Calibrated) -> Option<String> {
    let only_in = |a: &Calibrated, b: &Calibrated| -> Vec<String> {
        let missing = |p: &&FittedParameter| b.of_arm().all(|q| q.name != p.name);
        a.of_arm().filter(missing).map(|p| printable_name(&p.name)).collect()
    };
    let (gone, new) = (only_in(reference, now), only_in(now, reference));
    let part = |names: &[String], whose: &str| match names {
        [] => None,
        [one] => Some(format!("`{one}` is only in {whose}")),
        [first, rest @ ..] => Some(format!("`{first}` and {} more are only in {whose}", rest.len())),
    };
    let parts: Vec<String> =
        [part(&gone, "the reference"), part(&new, "this result")].into_iter().flatten().collect();
    (!parts.is_empty()).then(|| {
        format!("The two models differ: {}. The others may have moved because of it.", parts.join("; "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn calibrated(parameters: &[Value]) -> Calibrated {
        let summary = json!({ "schema": armcal_result::summary::SCHEMA, "pipeline": "rig",
                              "fit": { "parameters": parameters }, "frames": [] });
        serde_json::from_value(summary).expect("a summary")
    }

    fn parameter(name: &str, unit: &str, role: &str, value: f64, sigma: f64) -> Value {
        json!({ "name": name, "unit": unit, "value": value, "sigma": sigma, "at_bound": false, "role": role })
    }

    #[test]
    fn a_change_is_measured_in_the_uncertainty_of_both_values() {
        let then = calibrated(&[parameter("joint1.a", "m", "robot", 0.1, 0.003)]);
        let now = calibrated(&[parameter("joint1.a", "m", "robot", 0.12, 0.004)]);
        let shifts = shifts_of(&then, &now, "m");
        // 20 mm over sqrt(3^2 + 4^2) mm.
        assert!((shifts[0].by - 0.02).abs() < 1e-15 && (shifts[0].sigmas() - 4.0).abs() < 1e-9);
    }

    #[test]
    fn parameters_that_are_exact_in_both_differ_or_do_not() {
        let fixed = |value| calibrated(&[parameter("joint1.a", "m", "robot", value, 0.0)]);
        assert_eq!(shifts_of(&fixed(0.1), &fixed(0.1), "m")[0].sigmas(), 0.0);
        assert_eq!(shifts_of(&fixed(0.1), &fixed(0.2), "m")[0].sigmas(), f64::INFINITY);
    }

    #[test]
    fn only_what_both_arms_have_in_one_unit_is_compared() {
        let then = calibrated(&[
            parameter("joint1.theta", "rad", "robot", 0.0, 0.1),
            parameter("joint2.zero", "m", "robot", 0.0, 0.1),
            parameter("base.x", "m", "known_frame", 0.0, 0.1),
        ]);
        let now = calibrated(&[
            parameter("joint1.theta", "rad", "robot", 0.5, 0.1),
            parameter("joint2.zero", "rad", "robot", 0.5, 0.1),
            parameter("base.x", "m", "known_frame", 0.5, 0.1),
            parameter("backlash:1.width", "rad", "effect", 0.5, 0.1),
        ]);
        let shifts = shifts_of(&then, &now, "rad");
        let names: Vec<&str> = shifts.iter().map(|s| s.parameter.name.as_str()).collect();
        assert_eq!(names, ["joint1.theta"]);
        assert!(shifts_of(&then, &now, "m").is_empty());
        let said = model_differences(&then, &now).expect("another model");
        assert!(said.contains("`backlash:1.width` is only in this result"), "{said}");
    }
}
