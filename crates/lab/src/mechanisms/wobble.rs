//! A worn bearing: the axis of a joint nods as the joint turns, round a small circle in the frame it is held in.

use super::*;
use crate::screw::{Line, rotate_vector};

/// `kind = "axis_wobble"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisWobble {
    /// The joint.
    pub joint: usize,
    /// How far the axis leans over [deg].
    pub tilt_deg: f64,
    /// Times it goes round in a turn of the joint.
    pub per_turn: f64,
    /// Phase [deg].
    #[serde(default)]
    pub phase_deg: f64,
}

impl Mechanism for AxisWobble {
    fn reshape_arm(&self, now: &RigState<'_>, arm: &mut AxisArm) {
        let joint = self.joint - 1;
        let axis = arm.axes[joint];
        let q = now.link_rad[joint];
        let seed = if axis.direction.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let across = axis.direction.cross(&seed).normalize();
        let lean = rotate_vector(&axis.direction, &across, self.per_turn * q + self.phase_deg.to_radians());
        // The lean is held by the link before; the link itself has turned by q under it.
        let direction = rotate_vector(&axis.direction, &lean, -q);
        arm.turn_beyond(joint, &Line { point_m: axis.point_m, direction }, self.tilt_deg.to_radians());
    }
}

impl Hidden for AxisWobble {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.within("tilt_deg", self.tilt_deg, [0.0, 10.0])?;
        keys.within("per_turn", self.per_turn, [0.0, 1e3])?;
        keys.finite("phase_deg", self.phase_deg)
    }
}
