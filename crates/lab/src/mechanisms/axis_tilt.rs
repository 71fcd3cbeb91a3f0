//! An axis that is not parallel to the one before it, askew in the plane of the link and that axis.

use super::*;
use crate::screw::Line;

/// `kind = "axis_tilt"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisTilt {
    /// The joint whose axis is askew: 2 or later.
    pub joint: usize,
    /// How far [deg].
    pub tilt_deg: f64,
}

impl Mechanism for AxisTilt {
    fn reshape_arm(&self, _now: &RigState<'_>, arm: &mut AxisArm) {
        let before = self.joint - 2;
        let across = arm.axes[before].direction.cross(&arm.link_m(before));
        if let Some(direction) = across.try_normalize(1e-9) {
            let line = Line { point_m: arm.axes[before + 1].point_m, direction };
            arm.turn_beyond(before, &line, self.tilt_deg.to_radians());
        }
    }
}

impl Hidden for AxisTilt {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        if self.joint < 2 {
            return Err(keys.wrong("joint", "must be 2 or later: there is no axis before the first".into()));
        }
        keys.within("tilt_deg", self.tilt_deg, [-20.0, 20.0])
    }
}
