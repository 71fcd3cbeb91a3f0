//! A joint that turns a little more or less than its encoder says.
//!
//! # What moves
//! The gear ratio, the pulley diameter or the counts a turn are not what the file says.
//!
//! # Equation
//! `dq = k q`.
//!
//! # Parameters and units
//! `scale` k [1].
//!
//! # Signature in the data
//! An error that grows in proportion to the joint angle, from its zero on both sides.
//!
//! # Not to be confused with
//! `eccentricity` and `second_harmonic`, which look the same in a narrow range; an elastic shoulder or base, whose sag
//! also grows with the angle. A load separates these.
//!
//! # Source
//! Whitney, Lozinski, Rourke 1986; notes of the project.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["counts per turn", "pulley diameter"],
    summary: "the gear ratio differs from what is declared",
    family: Family::Transmission,
    confused_with: &[
        "eccentricity",
        "second_harmonic",
        "compliance",
        "belt_coupling",
        "hardening_compliance",
        "link_bending",
        "base_compliance",
    ],
    place: effect_placement,
    of_a_make: true,
    lookalikes: &[Lookalikes::Turns],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct GearRatio {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.joint()?;
    let scale = amplitude("scale", Unit::One, 0.008, 0.3, "relative error of the joint angle");
    Ok(Placement::new(vec![scale], GearRatio { joint }))
}

impl Physics for GearRatio {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, theta[0] * x.joint_rad(self.joint));
    }
}
