//! A load at the tip that is not the declared one, in one recording, or from a dwell on where the spec says so.
//!
//! # What moves
//! Every joint that gravity loads yields under a weight that the pipeline does not know of, or does not yield under one
//! that it wrongly declares.
//!
//! # Equation
//! `dq_j = y_j tau_j / (g L_j)`, tau_j the torque of a kilogram at the tip on joint j, L_j the length of the arm from
//! joint j on; in the recording, or from the dwell on, that the spec names. `y_j = m g L_j / K_j` for a mass m too many.
//!
//! # Parameters and units
//! `yield1`, `yield2`, ... y_j [rad] of the joints that gravity loads: how far each gives way with the arm stretched out
//! level. Mass and stiffness are not told apart: a known load in another recording gives `K_j` (`compliance`).
//!
//! # Signature in the data
//! From then on the tip hangs lower (or higher), the more the further the arm reaches out.
//!
//! # Not to be confused with
//! `zero_slip` and `frame_shift` at the same moment, where the reach hardly varies; `tool_shift`, which turns with the
//! last link. Weighing the tool separates them.
//!
//! # Source
//! Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, ch. 9.7 (payload), sec. 11.5 (flexible joints).

use super::prelude::*;
use crate::segment::Motion;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["wrong payload"],
    summary: "the load at the tip is not the declared one in a recording, and the joints yield to it",
    family: Family::Elasticity,
    toggle: Toggle::Recording,
    target: Target::Whole,
    offered: Offered::Recordings,
    shapes: &[ARM],
    confused_with: &["zero_slip", "frame_shift", "tool_shift"],
    place: effect_placement,
    look_at: "Weigh what the tool carried then, and declare it as `load_kg`.",
    told_by: "weigh what the tool carries, and declare it as `load_kg`",
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct UndeclaredLoad {
    /// The joints, each with the torque of a kilogram with the arm stretched out [N m].
    joints: Vec<(usize, f64)>,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    context.event()?;
    let loaded = |joint: &usize| context.motion(*joint) == Motion::Revolute && context.loaded(*joint).is_ok();
    let stretched = |joint| (joint, (context.gravity_mps2() * context.reach_m(joint)).max(1e-3));
    let joints: Vec<(usize, f64)> =
        context.zero.joints_of(context.arm()?).filter(loaded).map(stretched).collect();
    if joints.is_empty() {
        return Err("gravity loads none of the joints that turn".to_owned());
    }
    let deg = 1f64.to_radians();
    let of_joint = |(joint, _): &(usize, f64)| {
        let meaning = format!("angle by which joint {} gives way with the arm stretched out", joint + 1);
        of_event(amplitude(&format!("yield{}", joint + 1), Unit::Radian, 0.1 * deg, 10.0 * deg, meaning))
    };
    Ok(Placement::new(joints.iter().map(of_joint).collect(), UndeclaredLoad { joints }))
}

impl Physics for UndeclaredLoad {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        for (angle, (joint, stretched_nm)) in theta.iter().zip(&self.joints) {
            change.joint(*joint, *angle * (x.kilogram_nm(*joint) / stretched_nm));
        }
    }
}
