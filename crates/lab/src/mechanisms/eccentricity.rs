//! A toothed wheel, or an encoder's disc, whose centre is not on the axis.
//!
//! The teeth (or lines) pass a fixed point; the centre goes round on a circle of radius `offset`. Seen from the
//! centre, the fixed point is not where it would be seen from the axis, and by that angle the count is off. The
//! angle is not a pure sine: the same offset gives a small second harmonic.

use super::gear::Lead;
use super::*;

/// `kind = "eccentricity"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Eccentricity {
    /// The joint.
    pub joint: usize,
    /// Distance of the centre from the axis [mm].
    pub offset_mm: f64,
    /// Distance of the fixed point (mesh or reading head) from the axis [mm].
    pub radius_mm: f64,
    /// Direction from the axis to the centre at joint zero, seen from the direction to the fixed point [deg].
    #[serde(default)]
    pub phase_deg: f64,
    /// What is off its centre. Default `gear`.
    #[serde(default)]
    pub on: MountedOn,
}

/// What is mounted off its centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MountedOn {
    /// The joint's wheel.
    #[default]
    Gear,
    /// The disc of an encoder that turns with the joint.
    Encoder,
}

impl Lead for Eccentricity {
    fn joint(&self) -> usize {
        self.joint
    }

    fn of_reading(&self) -> bool {
        self.on == MountedOn::Encoder
    }

    fn lead_rad(&self, link_rad: f64) -> f64 {
        let (sin, cos) = (link_rad + self.phase_deg.to_radians()).sin_cos();
        let (ahead, across) = (self.radius_mm - self.offset_mm * cos, self.offset_mm * sin);
        across.atan2(ahead)
    }
}

impl Hidden for Eccentricity {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.within("radius_mm", self.radius_mm, [0.1, 1e4])?;
        keys.within("offset_mm", self.offset_mm, [0.0, 0.3 * self.radius_mm])?;
        keys.finite("phase_deg", self.phase_deg)
    }
}
