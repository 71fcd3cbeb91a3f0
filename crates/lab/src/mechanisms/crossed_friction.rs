//! One joint's drive rubs on another's: as the one moves it drags the other along against its spring, and
//! leaves it wound up in the direction of its last motion.

use super::*;

/// `kind = "crossed_friction"`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CrossedFriction {
    /// The joint that is dragged.
    pub joint: usize,
    /// The joint whose motion drags.
    pub by: usize,
    /// Friction between them [N m].
    pub friction_nm: f64,
    /// Stiffness of the gear of the dragged joint [N m/rad].
    pub stiffness_nm_rad: f64,
    /// Where the other joint was, and how far this one is wound up [rad].
    #[serde(skip)]
    pub(crate) before: Option<[f64; 2]>,
}

impl CrossedFriction {
    /// The rubbing part follows the moving joint until its spring is stronger than the friction.
    fn wound_rad(&mut self, by_rad: f64) -> f64 {
        let limit = self.friction_nm / self.stiffness_nm_rad;
        let [was, wound] = self.before.unwrap_or([by_rad, 0.0]);
        let wound = (wound + by_rad - was).clamp(-limit, limit);
        self.before = Some([by_rad, wound]);
        wound
    }
}

impl Mechanism for CrossedFriction {
    fn name(&self) -> &str {
        "crossed_friction"
    }

    fn motor_to_link(&mut self, _now: &Moment<'_>, joint_rad: &mut [f64]) {
        joint_rad[self.joint - 1] += self.wound_rad(joint_rad[self.by - 1]);
    }

    fn link_to_motor(&mut self, _now: &Moment<'_>, joint_rad: &mut [f64]) {
        joint_rad[self.joint - 1] -= self.wound_rad(joint_rad[self.by - 1]);
    }
}

impl Hidden for CrossedFriction {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.joint("by", self.by)?;
        keys.not_negative("friction_nm", self.friction_nm)?;
        keys.stiff("stiffness_nm_rad", self.stiffness_nm_rad)
    }
}
