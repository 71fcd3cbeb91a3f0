//! The tool moved on the last link.
//!
//! # What moves
//! The tool was remounted, bent or knocked; or the marker on it was, where no cavity ever held the tip.
//!
//! # Equation
//! `d tip = (x, y, z)` in the last link, in the recording, or from the dwell on, that the spec names.
//!
//! # Parameters and units
//! `x`, `y`, `z` [m] along the axes of the last link.
//!
//! # Signature in the data
//! A step between recordings or at a dwell that turns with the last link.
//!
//! # Not to be confused with
//! `zero_slip` of the last joint, to a tip in one plane; `frame_shift`, which does not turn with the arm. A second
//! marker on the tool separates them. `tip_marker_shift`, of which dwells in cavities know nothing: where there are such
//! dwells and tracked ones the two are told apart.
//!
//! # Source
//! Notes of the project.

use super::prelude::*;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["marker shift"],
    summary: "the tool or its marker moved, between recordings or at a dwell",
    family: Family::Event,
    toggle: Toggle::Recording,
    target: Target::Whole,
    offered: Offered::Events,
    shapes: &[ARM],
    confused_with: &["zero_slip", "frame_shift", "tip_marker_shift"],
    place: effect_placement,
    look_at: "The tool or its markers were remounted, bent or knocked: look at the last link.",
    lookalikes: &[Lookalikes::Moments, Lookalikes::Slow],
    ..EffectKind::PLAIN
};

/// A place on a link that moved along its axes.
#[derive(Debug)]
pub(super) struct Moved {
    /// Index of its x.
    pub first: usize,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    context.event()?;
    let amplitudes = shift_xyz("shift on the last link along");
    let first = context.nominal.feature_segment(context.arm()?).parameters.start;
    Ok(Placement::new(amplitudes, Moved { first }))
}

impl Physics for Moved {
    fn deform<D: Scalar>(&self, theta: &[D], _x: &Drivers<'_>, change: &mut Deformation<D>) {
        for (axis, shift) in theta.iter().enumerate() {
            change.parameter(self.first + axis, *shift);
        }
    }
}
