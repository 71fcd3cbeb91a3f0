//! What a change would do, in words.

use super::beyond;
use super::hypotheses::{Estimated, Hypothesis};
use super::trial::{Inputs, Misfit};
use crate::story::Fitted;
use armcal_calibrate::Calibration;
use armcal_core::{Certainty, SetupFinding};
use armcal_report::millimetres;

/// Parameters of a change that are told, at most.
const TOLD: usize = 3;

/// A change that explains the errors, as it is reported: `before` and `after` the calibrations, `begun` and `ended` the
/// trials, all with everything that was found undone `together`.
pub fn finding(
    h: &Hypothesis,
    together: &str,
    alternatives: &[String],
    moved: Option<String>,
    (before, begun): (Option<&Calibration>, Misfit),
    (after, ended): (Option<&Calibration>, Misfit),
) -> SetupFinding {
    let judged_m = |c: &Calibration| c.judged().fitted.mean_m;
    let before_m = before.map(judged_m);
    let after_m = after.map_or(ended.mean_m, judged_m);
    let held_out = match before {
        Some(c) if c.held_out() => "held-out ",
        _ => "",
    };
    let falls = match before_m {
        Some(before_m) if before_m <= after_m && ended.seated == begun.seated => format!(
            "a quick fit leaves {} instead of {} mm (the calibration {} either way)",
            millimetres(ended.mean_m),
            millimetres(begun.mean_m),
            millimetres(after_m)
        ),
        Some(before_m) if before_m <= after_m => format!(
            "{} instead of {} dwells sit in a cavity, and their mean {held_out}error is {} mm",
            ended.seated,
            begun.seated,
            millimetres(after_m)
        ),
        Some(before_m) => {
            let (before, after) = (millimetres(before_m), millimetres(after_m));
            format!("the mean {held_out}error falls from {before} to {after} mm")
        }
        None if begun.used == 0 => {
            let mean = millimetres(after_m);
            format!("{} dwells find their place, with a mean error of {mean} mm", ended.used)
        }
        None => format!("the mean error is {} mm", millimetres(after_m)),
    };
    let or = match alternatives.is_empty() {
        true => String::new(),
        false => format!(" (these data cannot tell it from: {})", armcal_core::listed(alternatives)),
    };
    let ends = moved.unwrap_or_else(|| after.map_or(String::new(), |c| estimated(h, c)));
    SetupFinding {
        code: h.code,
        subject: h.subject.clone(),
        message: format!("with {together}{or} {falls}{ends}; {}", h.remedy),
        certainty: Certainty::Mistake,
        before_mm: before_m.map(|m| m * 1e3),
        after_mm: Some(after_m * 1e3),
        alternatives: alternatives.to_vec(),
    }
}

/// Where the parameters of a change come out, the furthest first.
fn estimated(h: &Hypothesis, c: &Calibration) -> String {
    let of = |own: &Estimated| {
        let e = c.fit.estimates.iter().find(|e| e.parameter.name == own.parameter)?;
        let (unit, off) = (e.parameter.unit, e.value - own.nominal);
        let symbol = unit.display_symbol();
        let gap = if symbol.is_empty() { "" } else { " " };
        let words = format!("{} is off by {:+.3}{gap}{symbol}", own.parameter, unit.to_display(off));
        (off.abs() > own.far).then_some((off.abs() / own.far, words))
    };
    let mut words: Vec<(f64, String)> = h.estimated.iter().filter_map(of).collect();
    words.sort_by(|a, b| b.0.total_cmp(&a.0));
    let words: Vec<String> = words.into_iter().take(TOLD).map(|w| w.1).collect();
    if words.is_empty() { String::new() } else { format!(" ({})", words.join(", ")) }
}

/// How far the frame that a change estimates moves, in words.
pub fn moved_frame(now: &Inputs, h: &Hypothesis, from: &Fitted, to: &Fitted) -> Option<String> {
    let (m, rad) = beyond::moved(now, h.code, from, to)?;
    Some(format!(
        " ({} moved by {} mm and turned by {:.2} deg from where it was taken to be)",
        h.subject,
        millimetres(m),
        rad.to_degrees()
    ))
}
