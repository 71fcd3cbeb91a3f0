//! Springs in the layout of the paper's arm: the motor of the joint after stands on the base and turns the
//! forearm through a belt around this joint's axis, so the belt holds the forearm's *absolute* angle.
//!
//! In the angles (q2, q2 + q3) gravity does the work `(t2 - t3) dq2 + t3 d(q2 + q3)`: this joint's spring sees
//! the difference of the two torques, the belt sees the second one.

use super::*;

/// `kind = "belt_compliance"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeltCompliance {
    /// The joint whose axis the belt passes; the next one is driven by it.
    pub joint: usize,
    /// Stiffness of this joint's drive [N m/rad].
    pub stiffness_nm_rad: f64,
    /// Stiffness of the belt, as the forearm feels it [N m/rad]. Absent: it does not give.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub belt_stiffness_nm_rad: Option<f64>,
}

impl BeltCompliance {
    fn deflections_rad(&self, now: &RigState<'_>) -> [f64; 2] {
        let [upper_nm, fore_nm] = [now.gravity_nm[self.joint - 1], now.gravity_nm[self.joint]];
        let upper = (upper_nm - fore_nm) / self.stiffness_nm_rad;
        let fore = self.belt_stiffness_nm_rad.map_or(0.0, |stiffness| fore_nm / stiffness);
        // The next joint's own angle is the forearm's absolute one less this joint's.
        [upper, fore - upper]
    }
}

impl Mechanism for BeltCompliance {
    fn motor_to_link(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        let deflections = self.deflections_rad(now);
        joint_rad[self.joint - 1..].iter_mut().zip(deflections).for_each(|(q, x)| *q += x);
    }

    fn link_to_motor(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        let deflections = self.deflections_rad(now);
        joint_rad[self.joint - 1..].iter_mut().zip(deflections).for_each(|(q, x)| *q -= x);
    }
}

impl Hidden for BeltCompliance {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.joint("joint", self.joint + 1)?;
        keys.stiff("stiffness_nm_rad", self.stiffness_nm_rad)?;
        keys.stiff("belt_stiffness_nm_rad", self.belt_stiffness_nm_rad.unwrap_or(1.0))
    }
}
