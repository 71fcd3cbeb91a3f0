//! Every joint yields to gravity.
//!
//! # What moves
//! Each link turns against its motor by the gravity torque it carries: gears and shafts of one make yield alike, so
//! no joint of an elastic arm is stiff alone.
//!
//! # Equation
//! `dq_j = c_j tau_j` for every turning joint j, `tau_j` the gravity torque of the links and of the load.
//!
//! # Parameters and units
//! `compliance<j>` c_j [rad/(N m)], one a turning joint, of the links with the masses of their URDF or 2.5 kg a
//! metre (each absorbs the true scale at its joint). Prior: 0.1 deg with the nominal arm stretched out, the size of an industrial
//! gear.
//! Shape `seated` [1], 1 unless said: the share that acts while a cavity holds the tip; 0 where the hand carries the
//! arm there.
//!
//! # Signature in the data
//! The tip sags with the lever of gravity by a little of every joint. One joint's share alone may be too small to be
//! named where all together are plain.
//!
//! # Not to be confused with
//! `compliance` of one joint, when one gear is much softer than the others; `base_compliance`.
//!
//! # Source
//! Tenhumberg and Baeuml, arXiv 2311.08333; Klimchik et al., arXiv 1211.5739.

use super::prelude::*;
use crate::segment::Motion;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "every joint yields to gravity like a spring",
    family: Family::Elasticity,
    toggle: Toggle::Load,
    target: Target::Whole,
    shapes: &[SEATED, ARM],
    never_negative: &["compliance"],
    confused_with: &[
        "compliance",
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

/// Typical deflection of one joint [deg].
const TYPICAL_DEG: f64 = 0.1;

#[derive(Debug)]
struct ArmCompliance {
    joints: Vec<usize>,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let turning = |joint: &usize| context.motion(*joint) == Motion::Revolute;
    let joints: Vec<usize> = context.zero.joints_of(context.arm()?).filter(turning).collect();
    if joints.len() < 2 {
        return Err("fewer than two joints turn; use compliance".to_owned());
    }
    let of_joint = |joint: &usize| {
        let per_deg = 1f64.to_radians() / context.reference_torque_nm(*joint);
        let meaning = format!("angle of joint {} per gravity torque", joint + 1);
        let (name, unit) = (format!("compliance{}", joint + 1), Unit::RadianPerNewtonMetre);
        amplitude(&name, unit, TYPICAL_DEG * per_deg, 20.0 * TYPICAL_DEG * per_deg, meaning)
    };
    let amplitudes = joints.iter().map(of_joint).collect();
    Ok(Placement::new(amplitudes, ArmCompliance { joints }))
}

impl Physics for ArmCompliance {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        for (c, &joint) in theta.iter().zip(&self.joints) {
            let torque = &x.torque()[joint];
            change.joint(joint, *c * (torque.links_nm + torque.load_nm));
        }
    }
}
