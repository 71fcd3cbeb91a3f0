//! Coulomb friction at the end of a springy shaft: the shaft winds up until the friction gives way.
//!
//! The end stays where it is while the torque in the shaft is below the friction, and slips at that torque
//! beyond. Friction in the bearing grows with the load it carries: `friction_nm + load_share |gravity|`.

use super::*;

/// `kind = "friction_windup"`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionWindup {
    /// The joint.
    pub joint: usize,
    /// Stiffness of the shaft [N m/rad].
    pub stiffness_nm_rad: f64,
    /// Friction without load [N m].
    pub friction_nm: f64,
    /// Friction for each N m of gravity's torque. Default 0.
    #[serde(default)]
    pub load_share: f64,
    /// Whether a balancing spring carries the weight, so that the shaft is wound by friction only. Default true.
    #[serde(default = "yes")]
    pub balanced: bool,
    /// Winding of the shaft: link ahead of the motor, gravity's part aside [rad].
    #[serde(skip)]
    pub(crate) before: Option<[f64; 2]>,
}

fn yes() -> bool {
    true
}

impl FrictionWindup {
    fn limit_rad(&self, now: &RigState<'_>) -> f64 {
        let load_nm = now.gravity_nm[self.joint - 1].abs();
        (self.friction_nm + self.load_share * load_nm) / self.stiffness_nm_rad
    }

    fn sag_rad(&self, now: &RigState<'_>) -> f64 {
        if self.balanced { 0.0 } else { now.gravity_nm[self.joint - 1] / self.stiffness_nm_rad }
    }
}

impl Mechanism for FrictionWindup {
    fn motor_to_link(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        let (motor, limit) = (joint_rad[self.joint - 1] + self.sag_rad(now), self.limit_rad(now));
        let stuck = self.before.map_or(motor, |[_, link]| link);
        let link = stuck.clamp(motor - limit, motor + limit);
        self.before = Some([motor, link]);
        joint_rad[self.joint - 1] = link;
    }

    fn link_to_motor(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        let (link, limit) = (joint_rad[self.joint - 1], self.limit_rad(now));
        let motor = motor_of_play(now, self.before, link, limit);
        self.before = Some([motor, link]);
        joint_rad[self.joint - 1] = motor - self.sag_rad(now);
    }
}

impl Hidden for FrictionWindup {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.stiff("stiffness_nm_rad", self.stiffness_nm_rad)?;
        keys.not_negative("friction_nm", self.friction_nm)?;
        keys.within("load_share", self.load_share, [0.0, 100.0])
    }
}
