//! What the user should know about a fit.

use crate::objective::whitened::Whitened;
use crate::outcome::{Calibration, Fit, Status};
use armcal_core::{Code, Severity, Stage, Warning, list_names};

/// Weight below which an observation is named as an outlier.
const OUTLIER_WEIGHT: f64 = 0.25;
/// Residual scale from which on the declared noise is questioned.
const LARGE_SCALE: f64 = 1.5;
/// Times the floor, or the declared scatter, above which the model that was fitted cannot be called adequate, whatever is
/// known about the cause.
pub const INADEQUATE: f64 = 2.0;
/// Share of outliers from which on they are no exceptions.
const INADEQUATE_OUTLIERS: f64 = 0.25;

pub(crate) fn of_fit(fit: &Fit, white: &Whitened<'_>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut add = |severity, code, subject: &str, message: String| {
        warnings.push(Warning::new(severity, Stage::Calibrate, code, subject, message));
    };
    if white.rows() < white.axes.len() {
        let message = format!(
            "{} equations from {} dwells for {} free parameters: the priors decide the rest; record more dwells or fix \
             parameters",
            white.rows(),
            white.blocks(),
            white.axes.len()
        );
        add(Severity::Inadequate, Code::TooFewDwells, "fit", message);
    }
    if fit.status == Status::IterationLimit {
        let message = format!(
            "not converged after {} iterations: the best point is given; raise fit.max_iterations or check units and \
             start values",
            fit.iterations
        );
        add(Severity::Inadequate, Code::NotConverged, "fit", message);
    }
    if let Some(paper) = fit.paper.filter(|paper| !paper.feasible) {
        let k = white.blocks() as f64;
        let message = format!(
            "eq. 4 is infeasible: the smallest E within the bounds is {:.3} mm (mean {:.3} mm), above k a = {:.3} mm \
             (k = {k}, a = {:.3} mm); raise average_accuracy_mm or widen the bounds",
            paper.sum_of_distances_m * 1e3,
            paper.sum_of_distances_m * 1e3 / k,
            paper.limit_m * 1e3,
            paper.limit_m * 1e3 / k,
        );
        add(Severity::Inadequate, Code::PaperInfeasible, "fit", message);
    }
    let at_bound: Vec<String> =
        fit.estimates.iter().filter(|e| e.at_bound).map(|e| e.parameter.name.clone()).collect();
    if !at_bound.is_empty() {
        let message =
            "on the bound: the true value may lie outside, or a missing effect pulls there".to_string();
        add(Severity::Notice, Code::AtBound, &list_names(&at_bound), message);
    }
    if fit.sigma_scale > LARGE_SCALE {
        let message = format!(
            "residuals are {:.2} times the declared noise: an effect is missing from the model, the setup is not as declared, \
             or the noise is declared too small; intervals are widened accordingly",
            fit.sigma_scale
        );
        let inadequate = fit.sigma_scale > INADEQUATE;
        let severity = if inadequate { Severity::Inadequate } else { Severity::Notice };
        add(severity, Code::ResidualsAboveNoise, "fit", message);
    }
    let blocks = white.problem.block_of_each();
    let outliers = blocks.into_iter().zip(&fit.weights).filter(|(_, weight)| **weight < OUTLIER_WEIGHT);
    let mut outliers: Vec<String> = outliers.map(|(block, _)| white.problem.name(block)).collect();
    if !outliers.is_empty() {
        let of_all = format!("{} of {} observations", outliers.len(), fit.weights.len());
        let mut message = format!("{of_all} weigh less than {OUTLIER_WEIGHT} in the fit");
        let many = outliers.len() as f64 > INADEQUATE_OUTLIERS * fit.weights.len() as f64;
        if many {
            message += ": so many are no exceptions; check the order, sign and unit of the joints, the board, and \
                        whether something moved during a recording";
        }
        let severity = if many { Severity::Inadequate } else { Severity::Notice };
        // Several observations of one dwell have one name.
        outliers.dedup();
        add(severity, Code::Outliers, &list_names(&outliers), message);
    }
    warnings
}

/// That the mean error is above the floor by so much that the model is inadequate; none where the scatter has said it.
pub(crate) fn above_floor(calibration: &Calibration) -> Option<Warning> {
    let times = calibration.left_over();
    let said = |w: &Warning| w.code == Code::ResidualsAboveNoise && w.severity == Severity::Inadequate;
    if !times.is_finite() || times <= INADEQUATE || calibration.warnings.iter().any(said) {
        return None;
    }
    let message = format!(
        "the mean error of {:.3} mm is {:.1} times what the declared noise gives ({:.3} mm): an effect is missing from the model, the \
         setup is not as declared, or the noise is declared too small",
        calibration.judged().fitted.mean_m * 1e3,
        calibration.times_floor(),
        calibration.noise_floor_m * 1e3
    );
    Some(Warning::new(Severity::Inadequate, Stage::Calibrate, Code::ErrorsAboveFloor, "fit", message))
}
