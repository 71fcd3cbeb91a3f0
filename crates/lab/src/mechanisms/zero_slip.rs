//! A pulley slips on its shaft, once.

use super::*;

/// `kind = "zero_slip"`: from the event on the link is further than the motor says, to the end of the session
/// or until it is put back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZeroSlip {
    /// The joint.
    pub joint: usize,
    /// How far the link is ahead from then on [deg].
    pub slip_deg: f64,
    /// Index of the recording, from 0.
    pub recording: usize,
    /// When in it [s]. Default 0: before it begins.
    #[serde(default)]
    pub at_s: f64,
    /// When in that recording it is put back [s]. Default never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<f64>,
}

impl Mechanism for ZeroSlip {
    fn ahead(&mut self, now: &RigState<'_>, _joint_rad: &[f64]) -> Option<(usize, f64)> {
        let slipped = event_holds(now, self.recording, self.at_s, self.until_s);
        slipped.then(|| (self.joint, self.slip_deg.to_radians()))
    }
}

impl Hidden for ZeroSlip {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.within("slip_deg", self.slip_deg, [-30.0, 30.0])?;
        keys.event(self.recording, self.at_s, self.until_s)
    }
}
