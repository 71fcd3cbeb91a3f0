//! A gear with play: the link's tooth lies between two flanks of the motor's.
//!
//! Whoever drives, the other side stays where friction holds it until a flank comes to push it. Where
//! gravity is stronger than friction it presses the tooth against the flank it points to, and the gap is
//! closed from then on. Under the guiding hand the motors carry the arm's weight: gravity presses the same
//! flank, but it is the link that leads.

use super::*;

/// `kind = "gap"`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gap {
    /// The joint.
    pub joint: usize,
    /// Width from flank to flank, everywhere [deg].
    pub width_deg: f64,
    /// Friction that gravity must overcome to close the gap [N m]; absent: it never does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_nm: Option<f64>,
    /// A joint whose axis the belt passes on its way from a motor on the base: the play is then in the sum of both
    /// angles. Absent: no such belt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub belt_over: Option<usize>,
    /// Width that wear adds where the gear is used most [deg]. Default 0.
    #[serde(default)]
    pub worn_deg: f64,
    /// Where that is [deg]. Default 0.
    #[serde(default)]
    pub worn_centre_deg: f64,
    /// Distance from there at which the wear has fallen to `1 / e` [deg]. Default 10.
    #[serde(default = "ten")]
    pub worn_span_deg: f64,
    /// Motor and link of the moment before [rad].
    #[serde(skip)]
    pub(crate) before: Option<[f64; 2]>,
}

fn ten() -> f64 {
    10.0
}

impl Gap {
    fn half_rad(&self, at_rad: f64) -> f64 {
        let from_centre = (at_rad.to_degrees() - self.worn_centre_deg) / self.worn_span_deg;
        (self.width_deg + self.worn_deg * (-from_centre * from_centre).exp()).to_radians() / 2.0
    }

    /// The flank that gravity presses: `+1` where the link hangs ahead of the motor.
    fn pressed(&self, now: &RigState<'_>) -> Option<f64> {
        let torque = now.gravity_nm[self.joint - 1];
        self.friction_nm.filter(|friction| torque.abs() > *friction).map(|_| torque.signum())
    }
}

impl Gap {
    /// What the belt adds to the joint's own angle [rad].
    fn carried_rad(&self, joint_rad: &[f64]) -> f64 {
        self.belt_over.map_or(0.0, |other| joint_rad[other - 1])
    }
}

impl Mechanism for Gap {
    fn motor_to_link(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        let motor = joint_rad[self.joint - 1] + self.carried_rad(joint_rad);
        let half = self.half_rad(motor);
        let link = match (self.pressed(now), self.before) {
            (Some(flank), _) => motor + flank * half,
            (None, Some([_, link])) => link.clamp(motor - half, motor + half),
            (None, None) => motor,
        };
        self.before = Some([motor, link]);
        joint_rad[self.joint - 1] += link - motor;
    }

    fn link_to_motor(&mut self, now: &RigState<'_>, joint_rad: &mut [f64]) {
        let link = joint_rad[self.joint - 1] + self.carried_rad(joint_rad);
        let half = self.half_rad(link);
        let motor = match self.pressed(now) {
            Some(flank) => link - flank * half,
            None => motor_of_play(now, self.before, link, half),
        };
        self.before = Some([motor, link]);
        joint_rad[self.joint - 1] += motor - link;
    }
}

impl Hidden for Gap {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        self.belt_over.map_or(Ok(()), |other| keys.joint("belt_over", other))?;
        keys.within("width_deg", self.width_deg, [0.0, 20.0])?;
        keys.within("worn_deg", self.worn_deg, [0.0, 20.0])?;
        keys.finite("worn_centre_deg", self.worn_centre_deg)?;
        keys.within("worn_span_deg", self.worn_span_deg, [0.1, 360.0])?;
        keys.not_negative("friction_nm", self.friction_nm.unwrap_or(0.0))
    }
}
