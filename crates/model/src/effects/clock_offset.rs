//! Clocks of robot and sensor that differ.
//!
//! # What moves
//! The reading of the joints and the position of the tip belong to different moments.
//!
//! # Equation
//! `dq = t0 dq/dt` of every joint.
//!
//! # Parameters and units
//! `offset` t0 [s]: by how much the tip is later than the joints.
//!
//! # Signature in the data
//! An error along the path in proportion to speed; nothing in dwells.
//!
//! # Not to be confused with
//! `backlash`, where slow motion in both directions is all there is.
//!
//! # Source
//! Notes of the project.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "clocks of robot and sensor differ: an error in proportion to speed",
    family: Family::Timing,
    target: Target::Whole,
    place: effect_placement,
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct ClockOffset;

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    if !context.session.moving {
        return Err("clocks do not matter in dwells; it needs observations of the moving arm".to_owned());
    }
    let offset = amplitude("offset", Unit::Second, 0.01, 0.3, "by how much the tip is later than the joints");
    Ok(Placement::new(vec![offset], ClockOffset))
}

impl Physics for ClockOffset {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        for (joint, velocity) in x.observation.joint_velocity_radps.iter().flatten().enumerate() {
            change.joint(joint, theta[0] * *velocity);
        }
    }
}
