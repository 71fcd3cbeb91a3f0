//! Where a fit ends, for whoever asks for its parameters alone: also with some of them held.

use crate::fit::fit_problem::{enough_equations, with_its_noise};
use crate::fit::minimise::minimise_objective;
use crate::objective::axes::Axis;
use crate::objective::problem::Problem;
use crate::objective::solver::Curvature;
use crate::objective::whitened::Whitened;
use crate::{CalibrateError, FitConfig};
use armcal_core::Parameter;
use nalgebra::DVector;

/// More axes than this have a curvature as large as the rows of their recordings: it is not kept.
const MOST_AXES: usize = 300;

/// All parameters where a fit ended, and the scale of its residuals in units of the declared noise.
#[derive(Debug, Clone)]
pub struct Ended {
    /// The parameters.
    pub values: Vec<f64>,
    /// The scale.
    pub sigma_scale: f64,
    axes: Vec<Axis>,
    /// Curvature of what was minimised, where it is known.
    curvature: Option<Curvature>,
}

/// Where a fit from these parameters ends: what is asked of [`crate::fit::fit_problem`] where nobody asks how sure they are. Priors are
/// those of the problem. Near the end of another fit the scale is known roughly, and the way is short.
pub fn fitted_values(
    problem: &dyn Problem,
    start: &[f64],
    sigma_scale: Option<f64>,
    config: &FitConfig,
) -> Result<Ended, CalibrateError> {
    config.check()?;
    let free = &|p: &Parameter| p.free;
    let white = Whitened::new(Box::new(problem), start, free, config)?;
    enough_equations(&white)?;
    let solved = minimise_objective(&white, sigma_scale, config)?;
    let (white, solved) = with_its_noise(problem, (white, solved), free, config)?;
    let values = white.parameters_at(&solved.at.x);
    let curvature = solved.curvature.filter(|_| white.axes.len() <= MOST_AXES);
    Ok(Ended { values, sigma_scale: solved.sigma_scale, axes: white.axes, curvature })
}

impl Ended {
    /// Where the same fit ends with some parameters held at other values, each by its index, as the curvature at the minimum has
    /// it: `H_ff d_f = -H_fh d_h`, h what is held and f the others. To second order in what the held ones do; none where the
    /// curvature is not known or does not determine the others.
    pub fn with_held(&self, held: &[(usize, f64)]) -> Option<Vec<f64>> {
        let to = |axis: &Axis| held.iter().find(|(index, _)| *index == axis.index).map(|(_, value)| *value);
        let step = |axis: &Axis| to(axis).map_or(0.0, |value| (value - self.values[axis.index]) / axis.scale);
        let step = DVector::from_iterator(self.axes.len(), self.axes.iter().map(step));
        let is_held: Vec<bool> = self.axes.iter().map(|axis| to(axis).is_some()).collect();
        let curvature = self.curvature.as_ref()?;
        let others = curvature.solve_free(&-curvature.times(&step), &is_held)?;
        let mut values = self.values.clone();
        for (axis, d) in self.axes.iter().zip(others.iter()) {
            values[axis.index] = axis.bounded(values[axis.index] + axis.scale * d);
        }
        held.iter().for_each(|(index, value)| values[*index] = *value);
        Some(values)
    }
}

#[cfg(test)]
#[path = "../tests/ended.rs"]
mod tests;
