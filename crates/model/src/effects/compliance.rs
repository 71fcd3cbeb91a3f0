//! A joint that yields to gravity.
//!
//! # What moves
//! The link turns against its motor by the gravity torque it carries, as a spring does (Hooke): shaft, gear, belt.
//!
//! # Equation
//! `dq = c tau`, `tau` the gravity torque of the outer links and of the load, positive towards +q.
//!
//! # Parameters and units
//! `compliance` c [rad/(N m)] of the links with the masses of their URDF or 2.5 kg a metre (it absorbs the true
//! scale), `compliance_outer` the correction for the share of the outer links, `compliance_load` the true c, seen
//! under a known load, where the session has one. Prior: 0.4 deg with the nominal arm stretched out.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where the hand carries the
//! arm there.
//!
//! # Signature in the data
//! The tip sags with the lever of gravity; a load at the tip adds to it. In a narrow range of poses nearly all of
//! it hides in joint zeros and lengths.
//!
//! # Not to be confused with
//! `belt_compliance`, where the next motor sits on the base; `link_bending`; `base_compliance`, which has the pivot
//! in the foot. Of the last joint: stretch of its belt and bending of the last link are the same to tip positions;
//! a marker on the link near the joint, or locking the belt, separates them.
//!
//! # Source
//! Spong 1987; Tenhumberg and Baeuml, arXiv 2311.08333; Klimchik et al., arXiv 1211.5739.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["belt stretch", "bending of the last link (last joint)"],
    summary: "a joint yields to gravity like a spring",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    shapes: &[SEATED],
    never_negative: &["compliance", "compliance_load"],
    confused_with: &[
        "belt_compliance",
        "hardening_compliance",
        "effort_compliance",
        "link_bending",
        "base_compliance",
        "eccentricity",
        "second_harmonic",
        "gear_ratio",
        "belt_coupling",
    ],
    place: effect_placement,
    lookalikes: &[Lookalikes::Springs],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct Compliance {
    joint: usize,
    shares: TorqueTerms,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    context.loaded(joint)?;
    let shares = TorqueTerms::of(context, joint);
    let per_deg = 1f64.to_radians() / context.reference_torque_nm(joint);
    let unit = Unit::RadianPerNewtonMetre;
    let amplitudes =
        shares.amplitudes("compliance", unit, 0.4 * per_deg, 8.0 * per_deg, "angle per gravity torque");
    Ok(Placement::new(amplitudes, Compliance { joint, shares }))
}

impl Physics for Compliance {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, self.shares.torque(theta, &x.torque()[self.joint]));
    }
}
