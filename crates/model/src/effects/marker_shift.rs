//! A marker on a link of the arm came loose.
//!
//! # What moves
//! One marker: it was knocked, slipped on its mount, or was put on again elsewhere.
//!
//! # Equation
//! `d marker = (x, y, z)` in the link that carries it, in the recording, or from the dwell on, that the spec names.
//!
//! # Parameters and units
//! `x`, `y`, `z` [m] along the axes of that link.
//!
//! # Signature in the data
//! A step between recordings or at a dwell that turns with the link, of this marker and of nothing else in the same poses.
//!
//! # Not to be confused with
//! `tool_shift`, of which the tip knows; `zero_slip` of a joint before the link, where no other marker is seen that the joint
//! moves too.
//!
//! # Source
//! Notes of the project.

use super::prelude::*;
use super::tool_shift::Moved;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "a marker on a link came loose, between recordings or at a dwell",
    family: Family::Event,
    toggle: Toggle::Recording,
    target: Target::Marker,
    offered: Offered::Events,
    confused_with: &["tool_shift", "zero_slip"],
    place: effect_placement,
    look_at: "That marker came loose, was knocked or put on again: look at its mount, and at the recording around that time.",
    ..EffectKind::PLAIN
};

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    let (name, first) = context.marker()?;
    context.event()?;
    let meaning = format!("shift of marker {name} on its link along");
    Ok(Placement::new(shift_xyz(&meaning), Moved { first }))
}
