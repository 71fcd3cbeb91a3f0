//! A clamp that lets a link twist about its own length as another joint swings the arm round.

use super::*;
use crate::screw::Line;

/// `kind = "twist"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Twist {
    /// The link that twists.
    pub link: usize,
    /// The joint that makes it.
    pub by: usize,
    /// Twist where that joint is at 45 deg, growing with the square of its angle [deg].
    pub deg_at_45: f64,
}

impl Mechanism for Twist {
    fn reshape_arm(&self, now: &RigState<'_>, arm: &mut AxisArm) {
        let link = self.link - 1;
        let share = now.link_rad[self.by - 1] / std::f64::consts::FRAC_PI_4;
        if let Some(direction) = arm.link_m(link).try_normalize(1e-9) {
            let line = Line { point_m: arm.axes[link].point_m, direction };
            arm.turn_beyond(link, &line, self.deg_at_45.to_radians() * share * share);
        }
    }
}

impl Hidden for Twist {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("link", self.link)?;
        keys.joint("by", self.by)?;
        keys.within("deg_at_45", self.deg_at_45, [-10.0, 10.0])
    }
}
