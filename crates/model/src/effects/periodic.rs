//! A periodic error of some frequency.
//!
//! # What moves
//! A pinion, a pulley, the motor's encoder or the wave generator of a harmonic drive runs out of true, many times a
//! turn of the joint; or the teeth mesh unevenly.
//!
//! # Equation
//! `dq = A sin(n q) + B cos(n q)`, n times a turn of the joint.
//!
//! # Parameters and units
//! `sin` A, `cos` B [rad]; shape `frequency` n [1/turn], scanned by the diagnosis.
//!
//! # Signature in the data
//! A fine wave over the joint angle. n is a gear ratio or a number of teeth.
//!
//! # Not to be confused with
//! Noise, until the frequency is found: the neighbours of the right one explain part of it.
//!
//! # Source
//! Tuttle, MIT TR 1992; Jia et al., MMT 155 (2021) 104122.

use super::prelude::*;
use std::f64::consts::TAU;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["pinion or pulley run-out", "tooth mesh", "motor encoder error"],
    summary: "a periodic error many times a turn",
    family: Family::Transmission,
    offered: Offered::Scanned,
    shapes: &[Shape {
        name: "frequency",
        unit: Unit::One,
        default: None,
        lower: 0.1,
        upper: 1e4,
        meaning: "periods a turn of the joint",
        parameter: true,
        values: Some(frequencies),
    }],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::Turns],
    ..EffectKind::PLAIN
};

/// Lowest frequency that is not one of the two lower harmonics.
const LOWEST: f64 = 3.0;
/// Highest frequency worth trying.
const HIGHEST: f64 = 120.0;
/// Finest step.
const STEP: f64 = 0.5;
/// Steps within the width of a spectral line.
const STEPS_A_LINE: f64 = 8.0;

#[derive(Debug)]
struct Periodic {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    Ok(Placement::new(amplitudes_wave(0.15, 3.0, "(n q)"), Periodic { joint }))
}

/// From the third harmonic to what the readings of the joint can resolve (half a period between neighbours on
/// average), finely enough that no line is missed: a line is one period over the range wide.
fn frequencies(context: &EffectContext<'_>, observations: &[Observation]) -> Vec<f64> {
    let joint = context.spec.target.unwrap_or_default();
    let mut readings: Vec<f64> = observations
        .iter()
        .filter_map(|o| o.joint_rad.get(joint).copied())
        .filter(|q| q.is_finite())
        .collect();
    readings.sort_by(f64::total_cmp);
    readings.dedup_by(|a, b| (*a - *b).abs() < 1e-4);
    let (Some(first), Some(last)) = (readings.first(), readings.last()) else { return Vec::new() };
    let range = last - first;
    if range <= 0.0 {
        return Vec::new();
    }
    let highest = (0.5 * TAU * (readings.len() - 1) as f64 / range).min(HIGHEST);
    let step = (TAU / range / STEPS_A_LINE).max(STEP);
    let count = ((highest - LOWEST) / step).floor();
    if count < 0.0 { Vec::new() } else { (0..=count as usize).map(|k| LOWEST + step * k as f64).collect() }
}

impl Physics for Periodic {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let (sine, cosine) = (theta[2] * x.joint_rad(self.joint)).sin_cos();
        change.joint(self.joint, theta[0] * sine + theta[1] * cosine);
    }
}
