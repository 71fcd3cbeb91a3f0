//! Links that grow with temperature.
//!
//! # What moves
//! Every length of the arm grows with its temperature; without a thermometer, steadily over the session.
//!
//! # Equation
//! `dP = P a (T - T_mean)` for every nominal length P of the chain and the tip; without temperature `dP = P g t/T`.
//!
//! # Parameters and units
//! `expansion` a [1/K] where the observations have a temperature (aluminium 23e-6, PLA 70e-6); otherwise `growth` g
//! [1] over the whole session.
//!
//! # Signature in the data
//! An error along the stretched arm that follows the temperature, or time.
//!
//! # Not to be confused with
//! `zero_drift`, `frame_drift`: nearly the same in a narrow range of poses; `warm_up`, which levels off.
//!
//! # Source
//! Yin et al., IJAMT 2014 (thermal drift of links).

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the links grow with temperature, or steadily with time",
    family: Family::Drift,
    toggle: Toggle::Temperature,
    target: Target::Whole,
    confused_with: &["zero_drift", "frame_drift", "warm_up"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Lengths, Lookalikes::Slow],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct ThermalGrowth {
    lengths: Vec<(usize, f64)>,
    thermometer: bool,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let thermometer = context.session.temperature;
    let growth = if thermometer {
        amplitude("expansion", Unit::PerKelvin, 3e-5, 1e-3, "relative growth of every length per kelvin")
    } else {
        context.lasting()?;
        amplitude("growth", Unit::One, 7e-4, 0.02, "relative growth of every length over the whole session")
    };
    let lengths = context.nominal.lengths_m();
    Ok(Placement::new(vec![growth], ThermalGrowth { lengths, thermometer }))
}

impl Physics for ThermalGrowth {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let driver = if self.thermometer { x.warming_k } else { x.session_fraction };
        for (index, length_m) in &self.lengths {
            change.parameter(*index, theta[0] * (driver * length_m));
        }
    }
}
