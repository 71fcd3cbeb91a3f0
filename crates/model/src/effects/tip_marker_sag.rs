//! The markers at the tip sag on their stalk.
//!
//! # What moves
//! What the sensor sees of the tip: its markers stand on an extension of the last link, which bends under their weight. The tip
//! that sits in the cavities carries none of it.
//!
//! # Equation
//! `d tip = sag (g - (g . a) a)` where the tip was tracked, nothing where a cavity held it; `g` the direction of gravity, `a`
//! that from the last joint to the tip at the nominal arm.
//!
//! # Parameters and units
//! `sag` [m] of a stalk that is held out level.
//!
//! # Signature in the data
//! Tracked dwells hang the more, the more level the last link is; dwells in cavities do not.
//!
//! # Not to be confused with
//! `compliance` of the last joints, which acts on both kinds of dwell: with one kind alone, use that.
//!
//! # Source
//! The small deflection of a cantilever under its own weight, `w l^4 / (8 E I)` across its axis.

use super::prelude::*;
use super::tip_marker_shift::{TrackedTip, needs_both_kinds};
use std::ops::Range;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the markers at the tip sag on their stalk, and the tip does not",
    family: Family::Sensor,
    target: Target::Whole,
    // Free poses and cavities lie apart: any smooth error of the arm does the same to a session.
    offered: Offered::Never,
    shapes: &[ARM],
    never_negative: &["sag"],
    confused_with: &["compliance", "tip_marker_offset"],
    place: effect_placement,
    look_at: "The markers at the tip hang on something soft: shorten or stiffen their stalk.",
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct TipMarkerSag(TrackedTip);

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    needs_both_kinds(context, "compliance")?;
    let arm = context.arm()?;
    if context.zero.towards_tip(arm).is_none() {
        return Err(
            "the tip is on the axis of the last joint, so that the direction of a stalk is open".to_owned()
        );
    }
    let sag = amplitude("sag", Unit::Metre, 1e-3, 0.03, "sag of a stalk that is held out level");
    Ok(Placement::twisting(Slot::WORLD, vec![sag], TipMarkerSag(TrackedTip { arm })))
}

impl Physics for TipMarkerSag {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let towards = x.pose().towards_tip(self.0.arm).filter(|_| self.0.is_seen(x));
        let down = x.gravity_mps2().try_normalize(0.0);
        if let Some((a, down)) = towards.zip(down) {
            let across = down - a * down.dot(&a);
            let none = D::from(0.0);
            change.twist(Slot::WORLD, [0, 1, 2].map(|axis| theta[0] * across[axis]), [none; 3]);
        }
    }

    fn touched(&self, x: &Drivers<'_>, count: usize) -> Range<usize> {
        self.0.touched(x, count)
    }
}
