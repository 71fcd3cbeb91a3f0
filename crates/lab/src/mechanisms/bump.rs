//! Something is knocked, once, and stays where it came to rest until it is put back, if it is: a rigid motion of
//! everything after that moment.

use super::*;
use crate::screw::rotate_vector;
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion};

/// `kind = "bump"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bump {
    /// What is knocked.
    pub body: BumpedBody,
    /// With `body = "marker"`: which of `[[vicon.markers]]`, from 1. Default that of the tip.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub marker: Option<usize>,
    /// Shift in its own frame [mm]. Default none.
    #[serde(default)]
    pub shift_mm: [f64; 3],
    /// Rotation vector in its own frame [deg]. Default none.
    #[serde(default)]
    pub turn_deg: [f64; 3],
    /// Index of the recording, from 0.
    pub recording: usize,
    /// When in it [s]. Default 0: before it begins.
    #[serde(default)]
    pub at_s: f64,
    /// When in that recording it is put back [s]. Default never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_s: Option<f64>,
}

/// What can be knocked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BumpedBody {
    /// The tool is bent; its markers are on it.
    Tool,
    /// The markers of the tip only, or one of `[[vicon.markers]]`.
    Marker,
    /// The robot's base, its markers with it.
    Base,
    /// The board, its markers with it.
    Board,
    /// The markers of the board only.
    BoardMarkers,
    /// The cameras: what they report moves in the axes of the world, about its origin.
    Cameras,
}

impl Bump {
    fn motion(&self) -> Pose {
        let turn_rad = Vector3::from(self.turn_deg.map(f64::to_radians));
        let shift = Translation3::from(Vector3::from(self.shift_mm) * 1e-3);
        Isometry3::from_parts(shift, UnitQuaternion::from_scaled_axis(turn_rad))
    }

    /// Whether it has happened to `body`; a bump of no size never does.
    fn hit(&self, now: &RigState<'_>, body: BumpedBody) -> bool {
        let moved = self.shift_mm.iter().chain(&self.turn_deg).any(|v| *v != 0.0);
        moved && self.body == body && event_holds(now, self.recording, self.at_s, self.until_s)
    }
}

impl Mechanism for Bump {
    fn reshape_arm(&self, now: &RigState<'_>, arm: &mut AxisArm) {
        if !self.hit(now, BumpedBody::Tool) {
            return;
        }
        let shift = Matrix3::from_columns(&arm.tip_axes) * Vector3::from(self.shift_mm) * 1e-3;
        arm.tip_m += shift;
        let by = Matrix3::from_columns(&arm.tip_axes) * Vector3::from(self.turn_deg.map(f64::to_radians));
        if let Some(axis) = by.try_normalize(0.0) {
            arm.tip_axes = arm.tip_axes.map(|direction| rotate_vector(&axis, &direction, by.norm()));
        }
    }

    fn move_base(&self, now: &RigState<'_>, world_from_base: &mut Pose) {
        if self.hit(now, BumpedBody::Base) {
            *world_from_base *= self.motion();
        }
    }

    fn move_board(&self, now: &RigState<'_>, world_from_board: &mut Pose) {
        if self.hit(now, BumpedBody::Board) {
            *world_from_board *= self.motion();
        }
    }

    fn distort_camera(&self, now: &RigState<'_>, body: Body, world_from_body: &mut Pose) {
        let loose = match body {
            Body::Tip => self.marker.is_none().then_some(BumpedBody::Marker),
            Body::Marker(marker) => (self.marker == Some(marker + 1)).then_some(BumpedBody::Marker),
            Body::Table => Some(BumpedBody::BoardMarkers),
            Body::Base => None,
        };
        if loose.is_some_and(|loose| self.hit(now, loose)) {
            *world_from_body *= self.motion();
        }
        if self.hit(now, BumpedBody::Cameras) {
            *world_from_body = self.motion() * *world_from_body;
        }
    }
}

impl Hidden for Bump {
    fn check(&self, keys: &Keys) -> Result<(), LabError> {
        if let Some(marker) = self.marker {
            keys.marker(marker, self.body == BumpedBody::Marker)?;
        }
        self.shift_mm.iter().try_for_each(|v| keys.within("shift_mm", *v, [-100.0, 100.0]))?;
        self.turn_deg.iter().try_for_each(|v| keys.within("turn_deg", *v, [-30.0, 30.0]))?;
        keys.event(self.recording, self.at_s, self.until_s)
    }
}
