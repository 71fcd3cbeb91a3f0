//! How far a robot parameter may be from its nominal value, and how far it probably is.

use crate::ModelError;
use armcal_core::{Parameter, Role, Unit};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Default bounds and prior of every robot parameter, as deviations from nominal.
///
/// The defaults are the paper's constraint of eq. 4 (5 mm, 2 deg) with a prior a little narrower
/// (4 mm, 1.6 deg), which keeps what the data do not determine near nominal. `inf` removes one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Deviation {
    /// Largest deviation of a length [mm]. Default 5.
    pub bound_mm: f64,
    /// Largest deviation of an angle [deg]. Default 2.
    pub bound_deg: f64,
    /// Standard deviation of a length before the data [mm]. Default 4.
    pub prior_sigma_mm: f64,
    /// Standard deviation of an angle before the data [deg]. Default 1.6.
    pub prior_sigma_deg: f64,
}

impl Default for Deviation {
    fn default() -> Deviation {
        Deviation { bound_mm: 5.0, bound_deg: 2.0, prior_sigma_mm: 4.0, prior_sigma_deg: 1.6 }
    }
}

impl Deviation {
    /// Checks that every entry is a positive number or `inf`; names the file and the key otherwise.
    pub(crate) fn check(&self, path: &Path) -> Result<(), ModelError> {
        for (key, value) in [
            ("deviation.bound_mm", self.bound_mm),
            ("deviation.bound_deg", self.bound_deg),
            ("deviation.prior_sigma_mm", self.prior_sigma_mm),
            ("deviation.prior_sigma_deg", self.prior_sigma_deg),
        ] {
            check_positive(path, key, value)?;
        }
        Ok(())
    }

    /// Bound on the deviation, SI.
    pub(crate) fn bound(&self, unit: Unit) -> f64 {
        from_display(unit, if unit == Unit::Metre { self.bound_mm } else { self.bound_deg })
    }

    /// Prior standard deviation, SI.
    pub(crate) fn prior_sigma(&self, unit: Unit) -> f64 {
        from_display(unit, if unit == Unit::Metre { self.prior_sigma_mm } else { self.prior_sigma_deg })
    }

    /// A free robot parameter around its nominal value (SI).
    pub(crate) fn parameter(&self, name: String, unit: Unit, nominal: f64, meaning: String) -> Parameter {
        robot_parameter(name, unit, nominal, self.bound(unit), self.prior_sigma(unit), meaning)
    }
}

/// A free robot parameter with a bound and a prior on its deviation, all SI.
pub(crate) fn robot_parameter(
    name: String,
    unit: Unit,
    nominal: f64,
    bound: f64,
    prior_sigma: f64,
    meaning: String,
) -> Parameter {
    Parameter {
        lower: nominal - bound,
        upper: nominal + bound,
        prior_sigma: prior_sigma.is_finite().then_some(prior_sigma),
        free: true,
        ..Parameter::fixed(name, unit, nominal, Role::Robot, meaning)
    }
}

/// Millimetres or degrees of a file to SI.
pub(crate) fn from_display(unit: Unit, value: f64) -> f64 {
    if unit == Unit::Metre { value / 1e3 } else { value.to_radians() }
}

/// A bound or prior width: positive, possibly infinite.
pub(crate) fn check_positive(path: &Path, key: &str, value: f64) -> Result<(), ModelError> {
    if value > 0.0 {
        return Ok(());
    }
    Err(ModelError::BadValue {
        path: path.to_owned(),
        key: key.to_owned(),
        value,
        expected: "a positive number, or inf for none",
    })
}
