//! The markers at the tip moved, the tip did not.
//!
//! # What moves
//! What the sensor sees of the tip: its markers were knocked, slipped or were put on again elsewhere, or the sensor was taught
//! the body anew. The tip that sits in the cavities is where it was.
//!
//! # Equation
//! `d tip = (x, y, z)` in the last link where the tip was tracked, nothing where a cavity held it, in the recording, or from the
//! dwell on, that the spec names.
//!
//! # Parameters and units
//! `x`, `y`, `z` [m] along the axes of the last link.
//!
//! # Signature in the data
//! A step between recordings or at a dwell that turns with the last link, and of which dwells in cavities know nothing.
//!
//! # Not to be confused with
//! `tool_shift`, of which both kinds of dwell know: with one kind alone the two are the same, and `tool_shift` is the name of
//! both. `board_shift`, the other way round: it does not turn with the arm.
//!
//! # Source
//! Notes of the project.

use super::prelude::*;
use super::tool_shift::Moved;
use std::ops::Range;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["markers knocked or taught anew"],
    summary: "the markers at the tip moved and the tip did not, between recordings or at a dwell",
    family: Family::Event,
    toggle: Toggle::Recording,
    target: Target::Whole,
    offered: Offered::Events,
    shapes: &[ARM],
    confused_with: &["tool_shift", "board_shift"],
    place: effect_placement,
    look_at: "The markers at the tip were knocked, put on again or taught anew: look at their mount, and at the sensor's body.",
    where_tracked: true,
    lookalikes: &[Lookalikes::Moments],
    ..EffectKind::PLAIN
};

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    context.event()?;
    tracked_tip(context, "shift of the tip's markers along")
}

/// Three lengths along the axes of the last link, by which the tip is elsewhere for the sensor than for the cavities.
pub(super) fn tracked_tip(context: &EffectContext<'_>, meaning: &str) -> Result<Placement, String> {
    needs_both_kinds(context, "tool_shift")?;
    let tip = TrackedTip { arm: context.arm()? };
    let moved = Moved { first: context.nominal.feature_segment(tip.arm).parameters.start };
    Ok(Placement::new(shift_xyz(meaning), MovedWhereTracked { tip, moved }))
}

/// Checks that the tip was tracked in some dwells and held by cavities in others; `otherwise` is what is the same without.
pub(super) fn needs_both_kinds(context: &EffectContext<'_>, otherwise: &str) -> Result<(), String> {
    match context.session.seated_and_tracked() {
        true => Ok(()),
        false => {
            Err(format!("it needs dwells in cavities and tracked ones; with one kind alone, use {otherwise}"))
        }
    }
}

/// The tip of an arm where the sensor sees it.
#[derive(Debug)]
pub(super) struct TrackedTip {
    /// The arm, which is the place of its tip among the features.
    pub arm: usize,
}

impl TrackedTip {
    /// Whether this observation is one of it.
    pub fn is_seen(&self, x: &Drivers<'_>) -> bool {
        x.observation.feature.0 == self.arm && x.observation.seen_m().is_some()
    }

    /// Of so many entries of what acts on it those that can matter to this observation.
    pub fn touched(&self, x: &Drivers<'_>, count: usize) -> Range<usize> {
        if self.is_seen(x) { 0..count } else { 0..0 }
    }
}

#[derive(Debug)]
struct MovedWhereTracked {
    tip: TrackedTip,
    moved: Moved,
}

impl Physics for MovedWhereTracked {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        if self.tip.is_seen(x) {
            self.moved.deform(theta, x, change);
        }
    }

    fn touched(&self, x: &Drivers<'_>, count: usize) -> Range<usize> {
        self.tip.touched(x, count)
    }
}
