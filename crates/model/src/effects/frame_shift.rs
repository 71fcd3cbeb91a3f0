//! Robot, board or camera frame moved against each other.
//!
//! # What moves
//! The whole arm as the sensor (or the board) sees it: a foot slid, a table was pushed, the camera was knocked.
//!
//! # Equation
//! `p' = Exp(w) (p - c) + c + t`, `c` the middle of the working volume, in the recording, or from the dwell on, that
//! the spec names.
//!
//! # Parameters and units
//! `x`, `y`, `z` t [m]; `rx`, `ry`, `rz` w [rad], in the world.
//!
//! # Signature in the data
//! A step between recordings or at a dwell that is the same for every pose, or turns all of them together.
//!
//! # Not to be confused with
//! `zero_slip` of a vertical first joint, the same as a turn about it; `tool_shift`. A fixed reference marker on
//! the base separates them. A board whose tilt is not what was declared is the same to the data. `board_shift`, of which
//! tracked dwells know nothing.
//!
//! # Source
//! Vicon Tracker help, "Prepare the capture environment" (camera creep); notes of the project.

use super::prelude::*;
use crate::rigid::rotation_of_vector;
use armcal_core::Parameter;

pub(super) const KIND: EffectKind = EffectKind {
    aliases: &["wrongly declared tilt of the board"],
    summary: "robot, board or camera moved, between recordings or at a dwell",
    family: Family::Event,
    toggle: Toggle::Recording,
    target: Target::Whole,
    offered: Offered::Events,
    confused_with: &["zero_slip", "tool_shift", "board_shift", "frame_drift"],
    place: effect_placement,
    look_at: "The robot's foot, the table or the cameras moved, or a tilt is not what was declared: look at their clamps and marker plates.",
    lookalikes: &[Lookalikes::Moments],
    ..EffectKind::PLAIN
};

#[derive(Debug)]
struct FrameShift {
    centre_m: Vector3<f64>,
}

fn effect_placement(context: &EffectContext<'_>) -> Result<Placement, String> {
    context.event()?;
    let amplitudes = rigid_motion("");
    let physics = FrameShift { centre_m: context.volume_centre_m() };
    Ok(Placement::twisting(Slot::WORLD, amplitudes, physics))
}

impl Physics for FrameShift {
    fn deform<D: Scalar>(&self, theta: &[D], _x: &Drivers<'_>, change: &mut Deformation<D>) {
        let turn = [theta[3], theta[4], theta[5]];
        let move_m = pivot_translation_m(&self.centre_m.map(D::from), turn);
        change.twist(Slot::WORLD, [theta[0] + move_m[0], theta[1] + move_m[1], theta[2] + move_m[2]], turn);
    }
}

/// A shift along the axes of a frame and a turn about them, of the size of a knock; `of` says whose axes.
pub(super) fn rigid_motion(of: &str) -> Vec<Parameter> {
    [shift_xyz(&format!("shift along{of}")), turn_xyz(&format!("turn about{of}"))].concat()
}

/// The translation that makes a turn about the frame's origin one about `pivot`: `c - Exp(w) c`.
pub(super) fn pivot_translation_m<D: Scalar>(pivot_m: &Vector3<D>, turn_rad: [D; 3]) -> [D; 3] {
    let rotation = rotation_of_vector(&Vector3::from(turn_rad));
    let moved = rotation * pivot_m;
    [0, 1, 2].map(|axis| pivot_m[axis] - moved[axis])
}
