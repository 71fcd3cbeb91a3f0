//! What truly happened in a recording, at every step of the integration.

use crate::mechanism::Body;
use armcal_core::Pose;
use nalgebra::{Isometry3, Translation3};

/// Step of the integration [s].
pub const STEP_S: f64 = 0.002;

/// One column a quantity, one row a step.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// Time since the start of the recording [s]: [`STEP_S`] apart, or further on the quick path.
    pub time_s: Vec<f64>,
    /// Link-side joint angles [rad].
    pub link_rad: Vec<Vec<f64>>,
    /// Motor-side joint angles [rad].
    pub motor_rad: Vec<Vec<f64>>,
    /// What the encoders make of them, before noise and counting [rad].
    pub reading_rad: Vec<Vec<f64>>,
    /// What the controller asks for; the reading itself while the hand guides [rad].
    pub set_point_rad: Vec<Vec<f64>>,
    /// The true tip in the world.
    pub world_from_tip: Vec<Pose>,
    /// The true base in the world.
    pub world_from_base: Vec<Pose>,
    /// The true board in the world.
    pub world_from_board: Vec<Pose>,
    /// What the cameras make of the tip, before noise.
    pub seen_tip: Vec<Pose>,
    /// What the cameras make of the table, before noise.
    pub seen_table: Vec<Pose>,
    /// What the cameras make of the base, before noise.
    pub seen_base: Vec<Pose>,
    /// What the cameras make of each marker on the arm, before noise.
    pub seen_markers: Vec<Vec<Pose>>,
    /// The arm's temperature [degC].
    pub temperature_c: Vec<f64>,
}

/// What the arm was doing while it rested.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RestKind {
    /// The tip was in a cavity.
    Seated,
    /// The tip was held above a cavity.
    Hover,
    /// The tip was anywhere else.
    Free,
}

/// A rest the engine made on purpose.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// What it was.
    pub kind: RestKind,
    /// The cavity it is about.
    pub cavity: Option<usize>,
    /// The pass it belongs to.
    pub pass: Option<usize>,
    /// Where in the clearance of the cavity the tip sat, board frame [m].
    pub seat_m: Option<nalgebra::Vector3<f64>>,
    /// First step, settling included.
    pub first: usize,
    /// Last step.
    pub last: usize,
}

impl Trace {
    /// Number of steps.
    pub fn len(&self) -> usize {
        self.world_from_tip.len()
    }

    /// Whether nothing happened yet.
    pub fn is_empty(&self) -> bool {
        self.world_from_tip.is_empty()
    }

    /// Duration [s].
    pub fn duration_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0)
    }

    /// Adds what the cameras make of the markers in a step.
    pub fn push_markers(&mut self, seen: Vec<Pose>) {
        self.seen_markers.resize(seen.len(), Vec::new());
        self.seen_markers.iter_mut().zip(seen).for_each(|(marker, pose)| marker.push(pose));
    }

    /// The poses of a body as the cameras see it.
    pub fn seen(&self, body: Body) -> &[Pose] {
        match body {
            Body::Tip => &self.seen_tip,
            Body::Table => &self.seen_table,
            Body::Base => &self.seen_base,
            Body::Marker(marker) => &self.seen_markers[marker],
        }
    }
}

/// The two steps around `time_s` and the share of the later one; the ends hold beyond the ends.
pub fn bracketing_steps(time_s: f64, steps: usize) -> (usize, usize, f64) {
    let at = (time_s / STEP_S).clamp(0.0, steps.saturating_sub(1) as f64);
    let below = at.floor() as usize;
    (below, (below + 1).min(steps.saturating_sub(1)), at - below as f64)
}

/// A column of joint rows at `time_s`, linearly interpolated.
pub fn row_at(rows: &[Vec<f64>], time_s: f64) -> Vec<f64> {
    let (below, above, share) = bracketing_steps(time_s, rows.len());
    rows[below].iter().zip(&rows[above]).map(|(a, b)| a + (b - a) * share).collect()
}

/// A column of poses at `time_s`, interpolated.
pub fn pose_at(poses: &[Pose], time_s: f64) -> Pose {
    let (below, above, share) = bracketing_steps(time_s, poses.len());
    let (a, b) = (&poses[below], &poses[above]);
    Isometry3::from_parts(
        Translation3::from(a.translation.vector.lerp(&b.translation.vector, share)),
        a.rotation.nlerp(&b.rotation, share),
    )
}
