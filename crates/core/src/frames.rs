//! Rigid frames. A [`Pose`] named `a_from_b` maps coordinates in frame `b` to coordinates in frame `a`.
//!
//! Frame names follow REP-105 where it has one: `base` (robot base), `tip` (the calibrated point),
//! `world` (the frame in which positions are measured: Vicon, laser tracker, or the base itself when
//! there is no camera), `board` (the calibration board).

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A rigid transformation: rotation, then translation [m].
pub type Pose = Isometry3<f64>;

/// A pose in the form people write: position and fixed-axis roll, pitch, yaw about x, y, z (REP-103).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RollPitchYaw {
    /// Position [m].
    pub xyz_m: [f64; 3],
    /// Roll, pitch, yaw [deg]: the configuration edge; everything inside is radians.
    pub rpy_deg: [f64; 3],
}

impl From<RollPitchYaw> for Pose {
    fn from(p: RollPitchYaw) -> Pose {
        let [roll, pitch, yaw] = p.rpy_deg.map(f64::to_radians);
        Pose::from_parts(
            Translation3::from(Vector3::from(p.xyz_m)),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }
}

impl From<&Pose> for RollPitchYaw {
    fn from(pose: &Pose) -> RollPitchYaw {
        let (roll, pitch, yaw) = pose.rotation.euler_angles();
        RollPitchYaw {
            xyz_m: pose.translation.vector.into(),
            rpy_deg: [roll, pitch, yaw].map(f64::to_degrees),
        }
    }
}
