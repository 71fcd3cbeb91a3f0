//! A cable from the base to a link: slack while one joint is near the anchor, taut beyond, and then it pulls at
//! another joint against the spring of that joint's gear.

use super::*;

/// `kind = "cable_drag"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CableDrag {
    /// The joint that is pulled.
    pub joint: usize,
    /// The joint whose turning tightens the cable.
    pub by: usize,
    /// Torque for each radian beyond the slack [N m/rad].
    pub cable_nm_rad: f64,
    /// How far that joint can turn from the anchor before the cable is taut [deg].
    pub slack_deg: f64,
    /// Where the cable is anchored [deg]. Default 0.
    #[serde(default)]
    pub anchor_deg: f64,
    /// Stiffness of the gear that is pulled at [N m/rad].
    pub gear_nm_rad: f64,
}

impl Mechanism for CableDrag {
    fn ahead(&mut self, _now: &RigState<'_>, joint_rad: &[f64]) -> Option<(usize, f64)> {
        let from_anchor_deg = joint_rad[self.by - 1].to_degrees() - self.anchor_deg;
        let taut = (from_anchor_deg.abs() - self.slack_deg).max(0.0);
        Some((self.joint, -taut.to_radians() * self.cable_nm_rad / self.gear_nm_rad))
    }
}

impl Hidden for CableDrag {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.joint("by", self.by)?;
        keys.not_negative("cable_nm_rad", self.cable_nm_rad)?;
        keys.not_negative("slack_deg", self.slack_deg)?;
        keys.finite("anchor_deg", self.anchor_deg)?;
        keys.stiff("gear_nm_rad", self.gear_nm_rad)
    }
}
