//! A joint that moves along with the one before it.
//!
//! # What moves
//! A belt over the axis of the joint before it, or a coupled wrist, passes part of that joint's turn on; a layout
//! modelled the wrong way round passes all of it on.
//!
//! # Equation
//! `dq_j = k q_{j-1}`.
//!
//! # Parameters and units
//! `coupling` k [1]: the mismatch of two pulleys, or +-1 for a wrong layout. The spec names j.
//!
//! # Signature in the data
//! An error of one joint in proportion to the angle of the one before it.
//!
//! # Not to be confused with
//! `gear_ratio` of the joint before it, whose axis is another; `crossed_backlash`, which follows its direction
//! only.
//!
//! # Source
//! Notes of the project; Kilic, Dolen, Koku, Turk. J. Elec. Eng. 2010 (timing belts).

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["coupled wrist"],
    summary: "a joint moves along with the one before it",
    family: Family::Transmission,
    confused_with: &["gear_ratio", "compliance", "eccentricity", "second_harmonic"],
    place: effect_placement,
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct BeltCoupling {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    let previous = joint.checked_sub(1).filter(|_| !context.zero.is_first(joint));
    let previous = previous.ok_or("there is no joint before the first")?;
    if context.joint_unit(previous) != Unit::Radian {
        return Err(format!("joint {} before it slides, and this effect is about turns", previous + 1));
    }
    let coupling =
        amplitude("coupling", Unit::One, 0.01, 1.5, "share of the previous joint's turn passed on");
    Ok(Placement::new(vec![coupling], BeltCoupling { joint }))
}

impl Physics for BeltCoupling {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, theta[0] * x.joint_rad(self.joint - 1));
    }
}
