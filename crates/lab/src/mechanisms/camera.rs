//! A motion capture system that was calibrated badly: every body it reports is displaced.

use super::*;

/// `kind = "camera_scale"`: the wand had the wrong length, or axes differ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraScale {
    /// By how much each axis of the world is too long [%].
    pub percent: [f64; 3],
    /// The point that is reported rightly, in the world [m]. Default the origin.
    #[serde(default)]
    pub centre_m: [f64; 3],
}

/// `kind = "camera_distortion"`: positions away from the middle of the volume are pushed outwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraDistortion {
    /// How far at one metre from the centre, growing with the cube of the distance [mm].
    pub mm_at_1m: f64,
    /// Middle of the volume in the world [m]. Default the origin.
    #[serde(default)]
    pub centre_m: [f64; 3],
}

impl Mechanism for CameraScale {
    fn distort_camera(&self, _now: &RigState<'_>, _body: Body, world_from_body: &mut Pose) {
        let position = &mut world_from_body.translation.vector;
        let off = *position - Vector3::from(self.centre_m);
        *position += off.component_mul(&Vector3::from(self.percent)) / 100.0;
    }
}

impl Mechanism for CameraDistortion {
    fn distort_camera(&self, _now: &RigState<'_>, _body: Body, world_from_body: &mut Pose) {
        let position = &mut world_from_body.translation.vector;
        let off = *position - Vector3::from(self.centre_m);
        *position += off * (self.mm_at_1m * 1e-3 * off.norm_squared());
    }
}

impl Hidden for CameraScale {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        self.centre_m.iter().try_for_each(|v| keys.finite("centre_m", *v))?;
        self.percent.iter().try_for_each(|v| keys.within("percent", *v, [-10.0, 10.0]))
    }
}

impl Hidden for CameraDistortion {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        self.centre_m.iter().try_for_each(|v| keys.finite("centre_m", *v))?;
        keys.within("mm_at_1m", self.mm_at_1m, [-100.0, 100.0])
    }
}
