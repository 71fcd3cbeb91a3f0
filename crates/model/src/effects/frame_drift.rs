//! The camera frame, or the base, creeps.
//!
//! # What moves
//! A tripod settles, a camera mount gives way, a table warms up: everything moves slowly in the sensor's frame.
//!
//! # Equation
//! `dp = v t/T`, t the time since the first observation, T the length of the session.
//!
//! # Parameters and units
//! `x`, `y`, `z` v [m] over the whole session, in the world.
//!
//! # Signature in the data
//! An error that grows steadily with time and is the same for every pose.
//!
//! # Not to be confused with
//! `zero_drift`, `thermal_growth`: nearly the same in a narrow range of poses; `frame_shift`, which is a step.
//!
//! # Source
//! Vicon Tracker help, "Prepare the capture environment"; notes of the project.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["camera creep"],
    summary: "camera frame or base creeps over the session",
    family: Family::Drift,
    toggle: Toggle::Time,
    target: Target::Whole,
    confused_with: &["zero_drift", "thermal_growth", "warm_up", "frame_shift"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Slow],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct FrameDrift;

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    context.lasting()?;
    let amplitudes = amplitudes_xyz("", Unit::Metre, 0.8e-3, 0.03, "drift over the whole session along");
    Ok(Placement::twisting(Slot::WORLD, amplitudes, FrameDrift))
}

impl Physics for FrameDrift {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let moved = [0, 1, 2].map(|axis| theta[axis] * x.session_fraction);
        change.twist(Slot::WORLD, moved, [D::from(0.0); 3]);
    }
}
