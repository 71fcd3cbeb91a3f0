//! The zero of an encoder creeps.
//!
//! # What moves
//! A potentiometer or analog encoder drifts, a belt creeps over its pulley.
//!
//! # Equation
//! `dq = r t/T`, t the time since the first observation, T the length of the session.
//!
//! # Parameters and units
//! `drift` r [rad] over the whole session (sliding joint: [m]).
//!
//! # Signature in the data
//! An error that grows steadily with time and enters like a rotation of one joint.
//!
//! # Not to be confused with
//! `thermal_growth`, `frame_drift`: nearly the same in a narrow range of poses; `zero_slip`, which is a step.
//!
//! # Source
//! Notes of the project.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the zero of an encoder creeps over the session",
    family: Family::Drift,
    toggle: Toggle::Time,
    confused_with: &["frame_drift", "thermal_growth", "warm_up", "zero_slip"],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::Slow],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct ZeroDrift {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.joint()?;
    context.lasting()?;
    let (typical, bound) = (context.joint_size(joint, 0.3), context.joint_size(joint, 8.0));
    let drift = amplitude("drift", context.joint_unit(joint), typical, bound, "drift over the whole session");
    Ok(Placement::new(vec![drift], ZeroDrift { joint }))
}

impl Physics for ZeroDrift {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, theta[0] * x.session_fraction);
    }
}
