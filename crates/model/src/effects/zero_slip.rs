//! The zero of an encoder slipped.
//!
//! # What moves
//! From one moment on (or in one recording) a joint reads a constant more or less: a pulley jumped a tooth, a
//! set-screw turned, the homing found another edge.
//!
//! # Equation
//! `dq = o` in the recording, or from the dwell on, that the spec names.
//!
//! # Parameters and units
//! `offset` o [rad] (sliding joint: [m]).
//!
//! # Signature in the data
//! A step between recordings or at a dwell that enters like a rotation of that joint.
//!
//! # Not to be confused with
//! `frame_shift`: a turn about a vertical first axis is the same; `tool_shift`: so is a slip of the last joint to a
//! tip that stays in one plane. A fixed reference marker, a second tool marker, or moving the joint over a wide
//! range in each recording separates them.
//!
//! # Source
//! notes of the project; a belt tooth of a pulley with z teeth is 360/z deg.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the zero of an encoder slipped, between recordings or at a dwell",
    family: Family::Event,
    toggle: Toggle::Recording,
    offered: Offered::Events,
    confused_with: &["frame_shift", "tool_shift", "zero_drift"],
    place: effect_placement,
    look_at: "An encoder or a belt slipped: look at that joint's encoder coupling, set-screws and belt teeth, and home it again.",
    lookalikes: &[Lookalikes::Moments],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct ZeroSlip {
    joint: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let joint = context.joint()?;
    context.event()?;
    let (typical, bound) = (context.joint_size(joint, 0.4), context.joint_size(joint, 180.0));
    let offset = amplitude("offset", context.joint_unit(joint), typical, bound, "how far the zero slipped");
    Ok(Placement::new(vec![offset], ZeroSlip { joint }))
}

impl Physics for ZeroSlip {
    fn deform<D: Scalar>(&self, theta: &[D], _x: &Drivers<'_>, change: &mut Deformation<D>) {
        change.joint(self.joint, theta[0]);
    }
}
