//! The falling error: nominal, calibrated, and with each effect that the diagnosis found.

use crate::channels::count;
use crate::proto::{Step, Steps};
use crate::run::Run;
use armcal_calibrate::SideErrors;
use armcal_core::ErrorStats;

pub(super) fn steps(run: &Run) -> Steps {
    let calibration = &run.calibration;
    let held_out = calibration.held_out();
    let side =
        |c: &armcal_calibrate::Calibration| -> SideErrors { if held_out { c.holdout } else { c.train } };
    let mut rows = vec![
        ("nominal".to_owned(), side(calibration).nominal),
        ("calibration".to_owned(), side(calibration).fitted),
    ];
    let names = run.recording_names();
    for (step, name) in run.steps.iter().zip(run.step_names()) {
        rows.push((names.label(&name), side(&step.calibration).fitted));
    }
    let before = std::iter::once(None).chain(rows.iter().map(|(_, errors)| Some(errors.mean_m)));
    let steps = rows
        .iter()
        .zip(before)
        .enumerate()
        .map(|(n, ((adds, e), before))| step(n, adds, e, before))
        .collect();
    Steps {
        timestamp: None,
        steps,
        noise_floor_mm: super::short(super::or_zero(calibration.noise_floor_m * 1e3)),
        held_out,
    }
}

fn step(number: usize, adds: &str, e: &ErrorStats, before_m: Option<f64>) -> Step {
    let falls = before_m.filter(|b| *b > 0.0).map_or(0.0, |b| 100.0 * (b - e.mean_m) / b);
    let mm = |m: f64| super::short(super::or_zero(m * 1e3));
    Step {
        number: count(number),
        adds: adds.to_owned(),
        mean_mm: mm(e.mean_m),
        rms_mm: mm(e.rms_m),
        p95_mm: mm(e.p95_m),
        max_mm: mm(e.max_m),
        falls_by_percent: super::short(super::or_zero(falls)),
    }
}
