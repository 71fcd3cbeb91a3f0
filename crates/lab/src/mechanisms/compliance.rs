//! A torsion spring between motor and link, loaded by gravity.
//!
//! The link turns until the spring's torque `K x + H x^3` holds gravity's.

use super::*;

/// `kind = "compliance"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compliance {
    /// The joint.
    pub joint: usize,
    /// Stiffness at small torque [N m/rad].
    pub stiffness_nm_rad: f64,
    /// How much it hardens [N m/rad^3]. Default 0.
    #[serde(default)]
    pub hardening_nm_rad3: f64,
}

impl Compliance {
    /// Where spring and torque are in balance [rad]; Newton from the linear spring, which is beyond the root of
    /// a convex function, so the steps only ever shrink.
    pub(super) fn deflection_rad(&self, torque_nm: f64) -> f64 {
        let mut x = torque_nm / self.stiffness_nm_rad;
        if self.hardening_nm_rad3 == 0.0 || x == 0.0 {
            return x;
        }
        for _ in 0..60 {
            let excess = (self.stiffness_nm_rad + self.hardening_nm_rad3 * x * x) * x - torque_nm;
            let step = excess / (self.stiffness_nm_rad + 3.0 * self.hardening_nm_rad3 * x * x);
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        x
    }
}

impl Mechanism for Compliance {
    fn ahead(&mut self, now: &RigState<'_>, _joint_rad: &[f64]) -> Option<(usize, f64)> {
        Some((self.joint, self.deflection_rad(now.gravity_nm[self.joint - 1])))
    }
}

impl Hidden for Compliance {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.stiff("stiffness_nm_rad", self.stiffness_nm_rad)?;
        keys.not_negative("hardening_nm_rad3", self.hardening_nm_rad3)
    }
}
