//! Every observation with its positions before and after: what arrows, paths and tables are drawn from.

use crate::{ResultError, Run};
use armcal_calibrate::Residual;
use armcal_core::Observation;
use nalgebra::Vector3;

/// One observation, all positions in the world frame [m].
pub struct Point<'a> {
    /// What was measured.
    pub observation: &'a Observation,
    /// Its residuals.
    pub residual: &'a Residual,
    /// Where the tip was, frames as calibrated.
    pub measured_m: Vector3<f64>,
    /// Where the calibrated model puts it; for a held-out point, the fit that never saw it.
    pub predicted_m: Vector3<f64>,
    /// Where the tip was, estimated frames as fitted with the nominal robot.
    pub nominal_measured_m: Vector3<f64>,
    /// Where the nominal robot puts it.
    pub nominal_predicted_m: Vector3<f64>,
    /// Measured minus predicted after each of the run's steps.
    pub steps_m: Vec<Vector3<f64>>,
    /// What the effects of the last step do to this observation, and what is left: measured minus predicted without them.
    pub effect_m: Option<Vector3<f64>>,
}

/// Lowest and highest corner of the box about places; none where there are none.
pub fn extent(places: impl Iterator<Item = Vector3<f64>>) -> Option<(Vector3<f64>, Vector3<f64>)> {
    places.map(|p| (p, p)).reduce(|(low, high), (p, _)| (low.inf(&p), high.sup(&p)))
}

/// The points of a run, in the order of its observations.
pub fn points(run: &Run) -> Result<Vec<Point<'_>>, ResultError> {
    check_consistency(run)?;
    let fitted = run.calibration.fit.values();
    let nominal = &run.calibration.nominal_values;
    let without = run.steps.last().map(|step| (&step.model, step.values_without_effects(&run.model)));
    let pairs = run.observations.iter().zip(&run.calibration.residuals);
    Ok(pairs
        .enumerate()
        .map(|(i, (observation, residual))| {
            let measured_m = run.model.measured_tip_in_world(&fitted, observation);
            let nominal_measured_m = run.model.measured_tip_in_world(nominal, observation);
            Point {
                observation,
                residual,
                measured_m,
                predicted_m: measured_m - residual.fitted_m,
                nominal_measured_m,
                nominal_predicted_m: nominal_measured_m - residual.nominal_m,
                steps_m: run.steps.iter().map(|step| step.calibration.residuals[i].fitted_m).collect(),
                effect_m: without.as_ref().map(|(model, p)| model.residual(p, observation).position_m),
            }
        })
        .collect())
}

/// Lengths and dwells that belong together do.
fn check_consistency(run: &Run) -> Result<(), ResultError> {
    let observations = &run.observations;
    let inconsistent = |what: String| Err(ResultError::Inconsistent(what));
    for calibration in std::iter::once(&run.calibration).chain(run.steps.iter().map(|step| &step.calibration))
    {
        let residuals = &calibration.residuals;
        if observations.len() != residuals.len() {
            let (o, r) = (observations.len(), residuals.len());
            return inconsistent(format!("{o} observations, {r} residuals"));
        }
        if let Some((o, r)) = observations.iter().zip(residuals).find(|(o, r)| o.dwell != r.dwell) {
            return inconsistent(format!(
                "the residual of {} stands where that of {} belongs",
                r.dwell, o.dwell
            ));
        }
    }
    if let Some(o) = observations.iter().find(|o| o.dwell.recording >= run.recordings.len()) {
        return inconsistent(format!("{} is of no recording", o.dwell));
    }
    let parameters = run.model.parameters().len();
    for (what, values) in
        [("fitted", run.calibration.fit.estimates.len()), ("nominal", run.calibration.nominal_values.len())]
    {
        if values != parameters {
            return inconsistent(format!("{values} {what} values for {parameters} parameters"));
        }
    }
    for step in &run.steps {
        let (values, parameters) = (step.calibration.fit.estimates.len(), step.model.parameters().len());
        if values != parameters {
            let name = step.effects.join(", ");
            return inconsistent(format!("{values} fitted values for {parameters} parameters with {name}"));
        }
    }
    run.model.check(observations)?;
    Ok(())
}
