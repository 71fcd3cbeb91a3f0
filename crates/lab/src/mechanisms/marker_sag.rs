//! The markers of the tip stand on a stalk, which their weight bends: nothing that the cavities hold knows of it.

use super::*;

/// `kind = "marker_sag"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerSag {
    /// How far the markers hang with the stalk held out level [mm].
    pub sag_mm: f64,
    /// The direction of the stalk in the frame of the tip. Default along its y, which is that of the forearm of the paper's arm.
    #[serde(default = "along_y")]
    pub stalk: [f64; 3],
}

fn along_y() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

impl Mechanism for MarkerSag {
    fn distort_camera(&self, _now: &RigState<'_>, body: Body, world_from_body: &mut Pose) {
        let Some(stalk) = Vector3::from(self.stalk).try_normalize(1e-9).filter(|_| body == Body::Tip) else {
            return;
        };
        // Two springs of one stiffness across the stalk, each with its part of the weight.
        let stalk = world_from_body.rotation * stalk;
        let first = stalk
            .cross(&Vector3::x())
            .try_normalize(0.1)
            .unwrap_or_else(|| stalk.cross(&Vector3::y()).normalize());
        for spring in [first, stalk.cross(&first)] {
            let weight = -spring.z;
            world_from_body.translation.vector += spring * (weight * self.sag_mm * 1e-3);
        }
    }
}

impl Hidden for MarkerSag {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        self.stalk.iter().try_for_each(|v| keys.finite("stalk", *v))?;
        keys.within("sag_mm", self.sag_mm, [-100.0, 100.0])
    }
}
