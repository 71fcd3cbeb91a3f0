//! A position sensor that distorts its volume.
//!
//! # What moves
//! Lens distortion or a poor calibration pushes points outwards or inwards, more towards the edge.
//!
//! # Equation
//! `dp = a |d|^2 d - |d|^2 m - 2 (d . m) d`, `d = (p - c)/R`, c the middle of the working volume, R its half extent: to
//! first order in m a cube law about a middle that lies `R m / a` aside. Of everything the sensor measured: tip, board
//! and base, as in `sensor_scale`.
//!
//! # Parameters and units
//! `edge` a [m]: the error at the edge; `aside_x`, `aside_y`, `aside_z` m [m]: where the middle of the lenses is not the
//! middle of the volume.
//!
//! # Signature in the data
//! A radial error that grows with the cube of the distance from the middle, and faster on one side.
//!
//! # Not to be confused with
//! `sensor_scale`, which grows in proportion.
//!
//! # Source
//! Brown, Photogrammetric Engineering 37 (1971): radial and decentring distortion; Merriaux et al., Sensors 2017, 17, 1591: 0.15 mm in a good volume, more at the edge.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["lens distortion"],
    summary: "the position sensor distorts its volume, most at the edge",
    family: Family::Sensor,
    target: Target::Whole,
    confused_with: &["sensor_scale"],
    place: effect_placement,
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct VolumeDistortion {
    centre_m: Vector3<f64>,
    per_extent: f64,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let centre_m = context.session.volume_centre_m.ok_or("no observation comes from a position sensor")?;
    let edge = amplitude("edge", Unit::Metre, 0.5e-3, 0.02, "outward error at the edge of the volume");
    let mut amplitudes = vec![edge];
    amplitudes.extend(amplitudes_xyz(
        "aside_",
        Unit::Metre,
        0.25e-3,
        0.02,
        "distortion from a middle aside along",
    ));
    let per_extent = 1.0 / context.session.volume_half_extent_m;
    Ok(Placement::distorting(amplitudes, VolumeDistortion { centre_m, per_extent }))
}

impl Physics for VolumeDistortion {
    fn deform<D: Scalar>(&self, _theta: &[D], _x: &Drivers<'_>, _change: &mut Deformation<D>) {}

    fn seen<D: Scalar>(&self, theta: &[D], point_m: &Vector3<D>) -> Vector3<D> {
        let away = Vector3::from_fn(|axis, _| (point_m[axis] - self.centre_m[axis]) * self.per_extent);
        let aside = Vector3::new(theta[1], theta[2], theta[3]);
        let (squared, along) = (away.dot(&away), away.dot(&aside));
        let [radial, across] = [squared * theta[0] - along * 2.0, squared];
        Vector3::from_fn(|axis, _| away[axis] * radial - aside[axis] * across)
    }
}
