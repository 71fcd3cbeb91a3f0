//! Clause 10: static compliance, the displacement of the tip per unit of load.

use crate::IsoError;
use crate::error::at_least;
use crate::stats::{largest, mean};
use nalgebra::Vector3;
use serde::Serialize;

/// One static load at the tip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LoadStep {
    /// Force on the tip [N].
    pub force_n: Vector3<f64>,
    /// Displacement from the unloaded position [m].
    pub displacement_m: Vector3<f64>,
}

/// Static compliance [m/N]: the displacement per unit of load, the mean over repetitions of one load, the largest
/// over the loads (ISO 9283:1998, 10; it asks for forces along and against each axis of the base, in steps of a
/// tenth of the rated load).
///
/// Fails without a load, where a number is not finite, or where a force is zero.
pub fn static_compliance_m_n(steps: &[LoadStep]) -> Result<f64, IsoError> {
    at_least(1, "loads", steps.len(), "static compliance")?;
    let finite = |step: &LoadStep| step.force_n.iter().chain(&step.displacement_m).all(|v| v.is_finite());
    if let Some(index) = steps.iter().position(|step| !finite(step)) {
        return Err(IsoError::NotFinite { what: "loads of static compliance".into(), index });
    }
    if let Some(index) = steps.iter().position(|step| step.force_n.norm() == 0.0) {
        return Err(IsoError::NotPositive { what: format!("the force of load {index} [N]"), value: 0.0 });
    }
    let repetitions = |load: &LoadStep| {
        let same = steps.iter().filter(|other| other.force_n == load.force_n);
        mean(&same.map(|step| step.displacement_m.norm() / step.force_n.norm()).collect::<Vec<_>>())
    };
    Ok(largest(steps.iter().map(repetitions)))
}
