//! A position sensor whose scale is off.
//!
//! # What moves
//! The camera's calibration wand was too long or too short, or its axes differ: distances come out too large or too
//! small.
//!
//! # Equation
//! `dp = diag(x, y, z) (p - c)`, c the middle of the working volume, of everything the sensor measured: tip, board and
//! base. So the tip is off by `dp(tip) - dp(base)` where it was tracked, by `dp(board) - dp(base)` where it was seated.
//!
//! # Parameters and units
//! `x`, `y`, `z` [1] along the axes of the world.
//!
//! # Signature in the data
//! An error that grows from the middle of the volume outwards.
//!
//! # Not to be confused with
//! All lengths of the arm scaled alike: the same, for the part that x, y and z have in common; a bar of known
//! length separates them. `volume_distortion` grows with the cube.
//!
//! # Source
//! Merriaux et al., Sensors 2017, 17, 1591 (static error of Vicon).

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["all lengths scaled (its isotropic part)"],
    summary: "the scale of the position sensor is off, for each axis",
    family: Family::Sensor,
    target: Target::Whole,
    confused_with: &["volume_distortion"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Lengths],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct SensorScale {
    centre_m: Vector3<f64>,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let centre_m = context.session.volume_centre_m.ok_or("no observation comes from a position sensor")?;
    let amplitudes = amplitudes_xyz("", Unit::One, 0.004, 0.05, "relative error of scale along");
    Ok(Placement::distorting(amplitudes, SensorScale { centre_m }))
}

impl Physics for SensorScale {
    fn deform<D: Scalar>(&self, _theta: &[D], _x: &Drivers<'_>, _change: &mut Deformation<D>) {}

    fn seen<D: Scalar>(&self, theta: &[D], point_m: &Vector3<D>) -> Vector3<D> {
        Vector3::from_fn(|axis, _| theta[axis] * (point_m[axis] - self.centre_m[axis]))
    }
}
