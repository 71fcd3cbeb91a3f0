//! Slow and steady: a zero that wanders, a stand that creeps.

use super::*;
use nalgebra::Translation3;

/// `kind = "zero_drift"`: a potentiometer whose zero wanders.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZeroDrift {
    /// The joint.
    pub joint: usize,
    /// How fast the link gets ahead of the reading [deg/h].
    pub deg_per_hour: f64,
}

/// `kind = "frame_drift"`: what something stands on creeps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameDrift {
    /// What creeps.
    pub body: DriftingBody,
    /// How fast, in the world [mm/h]; for the cameras, how fast what they report does.
    pub mm_per_hour: [f64; 3],
}

/// What can creep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DriftingBody {
    /// The robot's base.
    Base,
    /// The board.
    Board,
    /// The tripods of the cameras.
    Cameras,
}

impl Mechanism for ZeroDrift {
    fn distort_encoder(&self, now: &RigState<'_>, reading_rad: &mut [f64]) {
        reading_rad[self.joint - 1] -= self.deg_per_hour.to_radians() * now.session_s / 3600.0;
    }
}

impl FrameDrift {
    fn shift(&self, now: &RigState<'_>, body: DriftingBody, pose: &mut Pose) {
        if self.body == body {
            let way_m = Vector3::from(self.mm_per_hour) * (1e-3 * now.session_s / 3600.0);
            *pose = Translation3::from(way_m) * *pose;
        }
    }
}

impl Mechanism for FrameDrift {
    fn move_base(&self, now: &RigState<'_>, world_from_base: &mut Pose) {
        self.shift(now, DriftingBody::Base, world_from_base);
    }

    fn move_board(&self, now: &RigState<'_>, world_from_board: &mut Pose) {
        self.shift(now, DriftingBody::Board, world_from_board);
    }

    fn distort_camera(&self, now: &RigState<'_>, _body: Body, world_from_body: &mut Pose) {
        self.shift(now, DriftingBody::Cameras, world_from_body);
    }
}

impl Hidden for ZeroDrift {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        keys.joint("joint", self.joint)?;
        keys.within("deg_per_hour", self.deg_per_hour, [-100.0, 100.0])
    }
}

impl Hidden for FrameDrift {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        self.mm_per_hour.iter().try_for_each(|v| keys.within("mm_per_hour", *v, [-1e3, 1e3]))
    }
}
