//! Links that grow while the arm warms up.
//!
//! # What moves
//! Motors heat the links, quickly at first; then they level off.
//!
//! # Equation
//! `dP = P g (1 - exp(-t/c))` for every nominal length P of the chain and the tip, t the time since the first
//! observation.
//!
//! # Parameters and units
//! `growth` g [1] once warm; shape `time_constant` c [s], scanned by the diagnosis.
//!
//! # Signature in the data
//! An error along the stretched arm that rises and levels off (industrial arms: 20 to 60 min).
//!
//! # Not to be confused with
//! `thermal_growth`, `zero_drift`, `frame_drift`, which go on steadily.
//!
//! # Source
//! Yin et al., IJAMT 2014; ISO 9283 (warm-up).

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the links grow while the arm warms up, then level off",
    family: Family::Drift,
    toggle: Toggle::Time,
    target: Target::Whole,
    offered: Offered::Scanned,
    shapes: &[Shape {
        name: "time_constant",
        unit: Unit::Second,
        default: None,
        lower: 1.0,
        upper: 1e7,
        meaning: "time after which 63 % of the growth has happened",
        parameter: true,
        values: Some(time_constants),
    }],
    confused_with: &["thermal_growth", "zero_drift", "frame_drift"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Lengths, Lookalikes::Slow],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct WarmUp {
    lengths: Vec<(usize, f64)>,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    context.lasting()?;
    let growth = amplitude("growth", Unit::One, 7e-4, 0.02, "relative growth of every length once warm");
    Ok(Placement::new(vec![growth], WarmUp { lengths: context.nominal.lengths_m() }))
}

fn time_constants(context: &EffectContext<'_>, _observations: &[Observation]) -> Vec<f64> {
    let duration_s = context.session.duration_s();
    [0.05, 0.1, 0.2, 0.35, 0.6, 1.0].iter().map(|part| part * duration_s).collect()
}

impl Physics for WarmUp {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let [growth, time_constant] = [theta[0], theta[1]];
        let warmth = -(-time_constant.recip() * x.time_s).exp_m1();
        for (index, length_m) in &self.lengths {
            change.parameter(*index, growth * warmth * *length_m);
        }
    }
}
