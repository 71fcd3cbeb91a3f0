//! What the user says about a parameter of an effect, in units of the user's.

use armcal_core::{Parameter, Unit};
use serde::{Deserialize, Serialize};

/// What the user says about a parameter of an effect.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Override {
    /// Unit of the numbers here: an SI symbol or a display symbol. Default: the display unit (mm, deg, ppm/K).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Value before the fit, and centre of the prior.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<f64>,
    /// Largest deviation from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
    /// Standard deviation of the prior.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<f64>,
    /// Whether the fit may change it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free: Option<bool>,
}

impl Override {
    /// Changes a parameter; what is wrong otherwise.
    pub(crate) fn apply(&self, p: &mut Parameter) -> Result<(), String> {
        let per_unit = match &self.unit {
            None => p.unit.from_display(1.0),
            Some(text) => match unit_of(text) {
                Some((unit, si_per_unit)) if unit == p.unit => si_per_unit,
                _ => return Err(format!("{} is in {}, not in \"{text}\"", p.name, p.unit)),
            },
        };
        if let Some(start) = self.start {
            let shift = start * per_unit - p.nominal;
            (p.nominal, p.lower, p.upper) = (p.nominal + shift, p.lower + shift, p.upper + shift);
        }
        if let Some(bound) = self.bound {
            (p.lower, p.upper) = (p.nominal - bound * per_unit, p.nominal + bound * per_unit);
        }
        p.prior_sigma = self.prior.map(|prior| prior * per_unit).or(p.prior_sigma);
        p.free = self.free.unwrap_or(p.free);
        Ok(())
    }
}

/// A unit by its SI or display symbol, and how much SI one of it is.
pub(crate) fn unit_of(text: &str) -> Option<(Unit, f64)> {
    Unit::ALL.into_iter().find_map(|unit| {
        let si = (text == unit.symbol()).then_some(1.0);
        let display = (text == unit.display_symbol()).then(|| unit.from_display(1.0));
        si.or(display).map(|scale| (unit, scale))
    })
}
