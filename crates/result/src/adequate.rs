//! Whether the errors of a run are what its user asked for.
//!
//! A tracker that scatters by 0.02 mm sees every arm err by more: whether a result is good enough is a question of what is wanted
//! (`[accuracy] wanted_mm`), and where nothing is, of whether what lies beyond the noise is understood.

use crate::run::Run;
use armcal_core::{Code, Severity, Stage, Warning};

/// Codes of the warnings about the size of errors.
const OF_SIZE: [Code; 4] =
    [Code::ErrorsAboveFloor, Code::ResidualsAboveNoise, Code::Outliers, Code::Unexplained];

/// The warnings of a run, those about the size of its errors as grave as its user has it.
pub fn as_wanted(run: &Run, mut warnings: Vec<Warning>) -> Vec<Warning> {
    // How far above the floor, the diagnosis tells with the places.
    let diagnosed = run.diagnosis.is_some();
    warnings.retain(|w| w.code != Code::ErrorsAboveFloor || !diagnosed);
    let decides = |code: Code| run.wanted_mm.is_none() && (!diagnosed || code == Code::Unexplained);
    for warning in warnings.iter_mut().filter(|w| OF_SIZE.contains(&w.code) && !decides(w.code)) {
        warning.severity = Severity::Notice;
    }
    warnings.extend(above_wanted(run));
    warnings
}

fn above_wanted(run: &Run) -> Option<Warning> {
    let (wanted_mm, error_mm) = (run.wanted_mm?, run.calibration.judged().fitted.mean_m * 1e3);
    let of = if run.calibration.held_out() { "held-out" } else { "fitted" };
    let message =
        format!("the mean {of} error of {error_mm:.3} mm is above the {wanted_mm} mm that are wanted");
    (error_mm > wanted_mm).then(|| {
        Warning::new(
            Severity::Inadequate,
            Stage::Calibrate,
            Code::ErrorsAboveWanted,
            "[accuracy] wanted_mm",
            message,
        )
    })
}
