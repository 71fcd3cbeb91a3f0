//! What is said of sensor and single parameters, by the pipeline or by a hypothesis about it.

use crate::RunError;
use armcal_config::{ParameterOverride, Pipeline};
use armcal_model::{Model, Override, is_of_effect};

/// The scale of a sensor is within so many of its standard errors.
const SURELY: f64 = 5.0;

/// What the pipeline says of sensor and parameters.
pub fn declare_parameters(model: &mut Model, pipeline: &Pipeline) -> Result<(), RunError> {
    if let Some(sigma_ppm) = pipeline.sensor.scale_sigma_ppm {
        let sigma = sigma_ppm * 1e-6;
        let known = match sigma > 0.0 {
            true => Override { prior: Some(sigma), bound: Some(SURELY * sigma), ..Override::default() },
            false => Override { free: Some(false), ..Override::default() },
        };
        model.declare("sensor_scale.*", known)?;
    }
    override_parameters(model, &pipeline.parameters)
}

/// Applies the changes to single parameters, in their order; those of effects wait for the effects.
pub fn override_parameters(model: &mut Model, changes: &[ParameterOverride]) -> Result<(), RunError> {
    for change in changes {
        if is_of_effect(&change.name) {
            let ParameterOverride { free, bound, prior, .. } = *change;
            model.declare(&change.name, Override { free, bound, prior, ..Override::default() })?;
            continue;
        }
        model.set_parameter(&change.name, |p| {
            let si = |display: f64| p.unit.from_display(display);
            p.free = change.free.unwrap_or(p.free);
            if let Some(bound) = change.bound {
                (p.lower, p.upper) = (p.nominal - si(bound), p.nominal + si(bound));
            }
            p.prior_sigma = change.prior.map(si).or(p.prior_sigma);
            p.assumed = p.assumed.filter(|_| change.prior.is_none() && change.bound.is_none());
        })?;
    }
    Ok(())
}

/// Applies changes to nominal values and bounds, in their order.
pub fn change_nominals(model: &mut Model, changes: &[Change]) -> Result<(), RunError> {
    for change in changes {
        model.set_parameter(&change.name, |p| {
            let nominal = p.nominal * change.times + change.plus;
            let widths = [p.lower, p.upper].map(|bound| (bound - p.nominal) * change.widened);
            (p.lower, p.upper) = (nominal + widths[0], nominal + widths[1]);
            p.nominal = nominal;
            p.prior_sigma = p.prior_sigma.map(|sigma| sigma * change.widened);
            if let Some(bound) = change.freed.filter(|_| !p.free) {
                (p.lower, p.upper) = (p.lower.min(nominal - bound), p.upper.max(nominal + bound));
                (p.free, p.prior_sigma) = (true, Some(bound));
            }
        })?;
    }
    Ok(())
}

/// A change to the nominal values of the parameters that match a pattern.
#[derive(Debug, Clone)]
pub struct Change {
    /// Name or glob.
    pub name: String,
    /// Factor on the nominal value.
    pub times: f64,
    /// Added to it, SI.
    pub plus: f64,
    /// Factor on the width of the bounds and of the prior.
    pub widened: f64,
    /// Whether it is freed where it was fixed, to at least this far either side [m], [rad].
    pub freed: Option<f64>,
}

impl Change {
    /// Another nominal value.
    pub fn nominal(name: &str, times: f64, plus: f64) -> Change {
        Change { name: name.to_owned(), times, plus, widened: 1.0, freed: None }
    }

    /// Free, whatever the model file says.
    pub fn freed(name: &str, bound: f64) -> Change {
        Change { name: name.to_owned(), times: 1.0, plus: 0.0, widened: 1.0, freed: Some(bound) }
    }

    /// Wider bounds.
    pub fn widened(name: &str, widened: f64) -> Change {
        Change { name: name.to_owned(), times: 1.0, plus: 0.0, widened, freed: None }
    }
}
