//! A joint that yields to the effort its motor measures.
//!
//! # What moves
//! The drive turns against the effort it exerts, whatever causes that: weight, friction, contact.
//!
//! # Equation
//! `dq = c e`, e the measured effort.
//!
//! # Parameters and units
//! `compliance` c [rad/(N m)], signed as the effort of the recording is: negative where effort holds the arm up.
//! Prior: 0.4 deg under the torque of the nominal arm stretched out, as of `compliance`: what a joint yields is not a
//! matter of what it was asked to bear here.
//!
//! # Signature in the data
//! The residual follows the measured effort, including its part that flips with the direction.
//!
//! # Not to be confused with
//! `compliance`, which knows only the nominal weights; `friction_windup`.
//!
//! # Source
//! Spong 1987; notes of the project.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "a joint yields to the effort its motor measures",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    confused_with: &["compliance", "hardening_compliance"],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::Springs],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct EffortCompliance {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    if context.largest_effort_nm(joint)? <= 0.0 {
        return Err(format!("the measured effort of `{}` is zero throughout", context.joint_name(joint)));
    }
    let per_deg = 1f64.to_radians() / context.reference_torque_nm(joint);
    let unit = Unit::RadianPerNewtonMetre;
    let compliance = amplitude("compliance", unit, 0.4 * per_deg, 8.0 * per_deg, "angle per measured effort");
    Ok(Placement::new(vec![compliance], EffortCompliance { joint }))
}

impl Physics for EffortCompliance {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, theta[0] * x.observation.effort_of(self.joint).unwrap_or(0.0));
    }
}
