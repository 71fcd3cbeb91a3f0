//! The sensor sees the tip elsewhere than the cavities hold it.
//!
//! # What moves
//! Nothing: the point that the sensor reports for the tip is not the one that sits in the cavities, by the same amount all the
//! time. Its body was defined about another point, or cavities hold the tip higher or lower than drawn.
//!
//! # Equation
//! `d tip = (x, y, z)` in the last link where the tip was tracked, nothing where a cavity held it.
//!
//! # Parameters and units
//! `x`, `y`, `z` [m] along the axes of the last link.
//!
//! # Signature in the data
//! Dwells in cavities and tracked ones disagree by a vector that turns with the last link.
//!
//! # Not to be confused with
//! `board_shift` and `frame_shift`, whose vector stays in the world while the link turns; `tip_marker_shift`, which an event
//! begins.
//!
//! # Source
//! Notes of the project.

use super::prelude::*;
use super::tip_marker_shift::tracked_tip;

pub(super) const KIND: EffectKind = EffectKind {
    summary: "the point that the sensor reports for the tip is not the one in the cavities",
    family: Family::Sensor,
    target: Target::Whole,
    // Free poses and cavities lie apart: any smooth error of the arm does the same to a session.
    offered: Offered::Never,
    shapes: &[ARM],
    confused_with: &["board_shift", "frame_shift", "tip_marker_shift"],
    place: |context| tracked_tip(context, "the tip that is tracked from the one in cavities along"),
    look_at: "Measure where the tip is in the sensor's body: touch one cavity in several postures.",
    ..EffectKind::PLAIN
};
