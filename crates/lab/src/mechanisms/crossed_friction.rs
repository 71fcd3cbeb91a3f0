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

impl Mechanism for CrossedFriction {
    /// The rubbing part follows the moving joint until its spring is stronger than the friction.
    fn ahead(&mut self, _now: &RigState<'_>, joint_rad: &[f64]) -> Option<(usize, f64)> {
        let by_rad = joint_rad[self.by - 1];
        let limit = self.friction_nm / self.stiffness_nm_rad;
        let [was, wound] = self.before.unwrap_or([by_rad, 0.0]);
        let wound = (wound + by_rad - was).clamp(-limit, limit);
        self.before = Some([by_rad, wound]);
        Some((self.joint, wound))
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
