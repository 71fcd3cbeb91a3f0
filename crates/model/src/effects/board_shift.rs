//! The board moved against what its pose was measured by.
//!
//! # What moves
//! The cavities alone: the board slipped on its stand after it was measured, or under its markers, or its mechanism gave.
//! Where the tip was tracked nothing changes.
//!
//! # Equation
//! `c' = Exp(w) (c - m) + m + t`, c the seated point and m the middle of those of the recording, in the frame of the board,
//! in the recording, or from the dwell on, that the spec names.
//!
//! # Parameters and units
//! `x`, `y`, `z` t [m]; `rx`, `ry`, `rz` w [rad], in the frame of the board.
//!
//! # Signature in the data
//! A step between recordings or at a dwell that is the same for every cavity, or turns all of them together, and that
//! tracked dwells do not share.
//!
//! # Not to be confused with
//! `frame_shift`, which tracked dwells share: without any of them the two are the same, and `frame_shift` is the name of
//! both. `board_scale`, which no event begins.
//!
//! # Source
//! Rigid motion (eq. 7-10 of Li et al. 2016, for the board); notes of the project.

use super::frame_shift::{pivot_translation_m, rigid_motion};
use super::prelude::*;
use super::spec::Since;
use std::collections::BTreeMap;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["slipped markers of the board"],
    summary: "the board moved under what measures it, between recordings or at a dwell",
    family: Family::Event,
    toggle: Toggle::Recording,
    target: Target::Whole,
    offered: Offered::Events,
    confused_with: &["frame_shift", "tool_shift", "tip_marker_shift"],
    place: effect_placement,
    look_at: "The board slipped on its stand or under its markers: look at its clamps, and measure it again before and after.",
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct BoardShift {
    middles_m: BTreeMap<usize, Vector3<f64>>,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    context.event()?;
    if !context.session.seated_and_tracked() {
        return Err(
            "it needs dwells in cavities and tracked ones; with one kind alone, use frame_shift".to_owned()
        );
    }
    if let Some(Since::Recording(recording)) = context.spec.since
        && context.nominal.board_is_estimated(recording)
    {
        return Err(format!("the board's pose in recording {recording} is estimated already"));
    }
    let physics = BoardShift { middles_m: context.session.board_centres_m.clone() };
    Ok(Placement::new(rigid_motion(" the board's"), physics))
}

impl Physics for BoardShift {
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>) {
        let Some(in_board_m) = x.observation.in_board_m() else { return };
        let recording = x.observation.dwell.recording;
        let middle_m = self.middles_m.get(&recording).copied().unwrap_or_else(Vector3::zeros);
        let arm_m = (in_board_m - middle_m).map(D::from);
        let back_m = pivot_translation_m(&arm_m, [theta[3], theta[4], theta[5]]);
        for axis in 0..3 {
            change.seat_m[axis] += theta[axis] - back_m[axis];
        }
    }
}
