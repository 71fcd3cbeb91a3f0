//! Free parameters in units of their prior: `x_k = (p_k - c_k) / s_k`.
//!
//! With a prior, `c` is the nominal value and `s` the prior's standard deviation. A frame that nobody knew, or a parameter without
//! prior or bounds, has its start for `c` and a reference size for `s` (20 mm, 4 deg: notes/diagnosis.md 4.1), so that directions
//! through it compare like with like; the prior on it is its own (or a ridge of 1 m, 1 rad), wide enough not to be felt by
//! anything the data see at all, and keeps directions that nothing determines where they started.

use crate::objective::problem::Problem;
use crate::objective::rows::Rows;
use crate::{CalibrateError, FitConfig};
use armcal_core::{Parameter, Role, Unit};
use nalgebra::DVector;

/// Standard deviation [m, rad, ...] of the ridge on a free parameter about which nothing is known: it moves a length
/// that the data know to 1 mm by one part in a million of what it was off.
const RIDGE_SIGMA_SI: f64 = 1.0;

/// Half the width of the bounds times this is the standard deviation of the prior they stand for.
const BOUNDS_TO_SIGMA: f64 = 0.8;

/// One free parameter in solver units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axis {
    /// Index in the full parameter vector.
    pub index: usize,
    /// Value at x = 0.
    pub centre: f64,
    /// SI per unit of x.
    pub scale: f64,
    /// Prior precision in units of x: 1 with a prior, less for the ridge.
    pub precision: f64,
    /// Bounds in units of x.
    pub lower: f64,
    /// Bounds in units of x.
    pub upper: f64,
}

impl Axis {
    /// A value, or the bound that it is beyond.
    pub fn bounded(&self, value: f64) -> f64 {
        let x = (value - self.centre) / self.scale;
        if x < self.lower || x > self.upper { self.centre + self.scale * self.at(value) } else { value }
    }

    /// A value in its units, within the bounds.
    pub fn at(&self, value: f64) -> f64 {
        ((value - self.centre) / self.scale).max(self.lower).min(self.upper)
    }
}

/// The whitened problem linearised at x.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    pub x: DVector<f64>,
    /// Norm of the whitened residual of each block.
    pub norms: Vec<f64>,
    /// Whitened residuals of all blocks, stacked.
    pub residual: DVector<f64>,
    /// Rows and derivative of each group, over its columns.
    pub groups: Vec<Rows>,
}

/// The free axes of a problem, and all its parameters at the start, those within their bounds.
pub(crate) fn axes_and_start(
    problem: &dyn Problem,
    start: &[f64],
    free: &dyn Fn(&Parameter) -> bool,
    config: &FitConfig,
) -> Result<(Vec<Axis>, Vec<f64>), CalibrateError> {
    if problem.blocks() == 0 {
        return Err(CalibrateError::NoObservations { context: String::new() });
    }
    let mut axes = Vec::new();
    for (index, parameter) in problem.parameters().iter().enumerate().filter(|(_, p)| free(p)) {
        axes.push(solver_axis(index, parameter, start[index], config)?);
    }
    if axes.is_empty() {
        return Err(CalibrateError::NothingFree);
    }
    let mut start = start.to_vec();
    for a in &axes {
        // Unless it is beyond a bound, exactly as it is.
        let x = a.at(start[a.index]);
        if x <= a.lower || x >= a.upper {
            start[a.index] = a.centre + a.scale * x;
        }
    }
    Ok((axes, start))
}

/// The prior standard deviation the fit uses, if anything is known about the parameter.
pub(crate) fn prior_sigma(parameter: &Parameter, config: &FitConfig) -> Option<f64> {
    let half = 0.5 * (parameter.upper - parameter.lower);
    let from_bounds =
        (config.bounds_as_prior && half.is_finite() && half > 0.0).then_some(BOUNDS_TO_SIGMA * half);
    parameter.prior_sigma.or(from_bounds)
}

/// Size of a parameter about which nothing is known, when directions are compared (notes/diagnosis.md 4.1).
fn reference_size(unit: Unit) -> f64 {
    match unit {
        Unit::Metre => 0.020,
        Unit::Radian => 4.0_f64.to_radians(),
        Unit::Second => 0.01,
        Unit::One => 0.01,
        Unit::RadianPerNewtonMetre => 1e-3,
        Unit::PerKelvin => 1e-5,
        Unit::Kilogram | Unit::Kelvin | Unit::NewtonMetre => 1.0,
        Unit::MetrePerNewtonMetre | Unit::MetrePerKelvin | Unit::MetrePerKilogram => 1e-3,
        Unit::RadianPerKelvin | Unit::RadianPerKilogram => 1e-3,
        Unit::RadianPerSecond | Unit::MetrePerSecond => 1e-5,
    }
}

fn solver_axis(
    index: usize,
    parameter: &Parameter,
    start: f64,
    config: &FitConfig,
) -> Result<Axis, CalibrateError> {
    let bad = |why: String| CalibrateError::BadParameter { name: parameter.name.clone(), why };
    let Parameter { nominal, lower, upper, .. } = *parameter;
    if !nominal.is_finite() || !start.is_finite() {
        return Err(bad(format!("its value before the fit ({nominal}, start {start}) is not finite")));
    }
    if lower.is_nan() || upper.is_nan() || lower >= upper {
        return Err(bad(format!(
            "its bounds [{lower}, {upper}] leave no room; fix it instead (free = false)"
        )));
    }
    let sigma = prior_sigma(parameter, config);
    if let Some(sigma) = sigma.filter(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(bad(format!(
            "prior_sigma = {sigma}: give a number above zero, or fix it (free = false)"
        )));
    }
    let (centre, scale, precision) = match sigma {
        Some(sigma) if parameter.role != Role::EstimatedFrame => {
            let size = parameter.usual.map_or(sigma, |usual| usual.min(sigma));
            (nominal, size, (size / sigma).powi(2))
        }
        _ => {
            let sigma = sigma.unwrap_or(RIDGE_SIGMA_SI);
            let size = reference_size(parameter.unit).min(sigma);
            (start, size, (size / sigma).powi(2))
        }
    };
    let to_x = |value: f64| (value - centre) / scale;
    Ok(Axis { index, centre, scale, precision, lower: to_x(lower), upper: to_x(upper) })
}
