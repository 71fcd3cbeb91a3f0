//! Compliance of a joint when the motor of the next one sits on the base.
//!
//! # What moves
//! A belt (or a parallelogram) from the base drives the next joint, so that link keeps its direction in space while
//! the joint before it gives way; and that joint carries only the force of the outer links, not their torque.
//!
//! # Equation
//! Joint j driven from the base, j-1 before it: `dq_{j-1} = c (tau_{j-1} - tau_j)`, `dq_j = -dq_{j-1}` (for axes
//! that point against each other: signs turned).
//!
//! # Parameters and units
//! `compliance` c [rad/(N m)] of the links with their default masses, `compliance_load` under the load. The spec
//! names j. Prior: 0.4 deg with the nominal arm stretched out.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where the hand carries the
//! arm there.
//!
//! # Signature in the data
//! The tip sags with the lever of the inner link alone, and the outer link does not tilt.
//!
//! # Not to be confused with
//! `compliance` of joint j-1, where the outer link tilts along.
//!
//! # Source
//! Layout of palletisers and of the paper's arm (Li, Yang, Chan, Lin 2016); notes of the project.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "compliance of a joint when the next one is driven by a belt from the base",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    shapes: &[SEATED],
    never_negative: &["compliance", "compliance_load"],
    confused_with: &["compliance", "link_bending", "base_compliance", "hardening_compliance"],
    place: effect_placement,
    lookalikes: &[Lookalikes::Springs],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct BeltCompliance {
    /// The joint driven from the base.
    joint: usize,
    /// +1 where its axis points as the one before it, -1 against.
    sense: f64,
    load: bool,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.turning_joint()?;
    let sense = context
        .parallel_to_previous(joint)
        .ok_or("a belt from the base needs an axis parallel to the one before it")?;
    let load = context.session.load;
    let per_deg = 1f64.to_radians() / context.reference_torque_nm(joint - 1);
    let compliance = |quantity: &str, meaning: &str| {
        amplitude(quantity, Unit::RadianPerNewtonMetre, 0.4 * per_deg, 8.0 * per_deg, meaning)
    };
    let mut amplitudes = vec![compliance("compliance", "angle per gravity torque")];
    if load {
        amplitudes.push(compliance("compliance_load", "angle per gravity torque: under the load at the tip"));
    }
    Ok(Placement::new(amplitudes, BeltCompliance { joint, sense, load }))
}

impl Physics for BeltCompliance {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let (inner, own) = (&x.torque()[self.joint - 1], &x.torque()[self.joint]);
        let mut angle = theta[0] * (inner.links_nm - self.sense * own.links_nm);
        if self.load {
            angle += theta[1] * (inner.load_nm - self.sense * own.load_nm);
        }
        change.joint(self.joint - 1, angle);
        change.joint(self.joint, angle * -self.sense);
    }
}
