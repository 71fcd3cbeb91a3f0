//! The views in which paths are compared: space, and the planes of the base frame.

use nalgebra::Vector3;
use serde::Serialize;

/// A view of an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Plane {
    /// All three coordinates.
    Space,
    /// Seen from above.
    Xy,
    /// Seen along x.
    Yz,
    /// Seen along y.
    Xz,
}

impl Plane {
    /// All views, in the order they are declared and shown.
    pub const ALL: [Plane; 4] = [Plane::Space, Plane::Xy, Plane::Yz, Plane::Xz];

    /// As tables and files spell it.
    pub fn word(self) -> &'static str {
        match self {
            Plane::Space => "space",
            Plane::Xy => "xy",
            Plane::Yz => "yz",
            Plane::Xz => "xz",
        }
    }

    /// What of a vector is seen in it.
    pub fn seen(self, v: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Plane::Space => *v,
            Plane::Xy => Vector3::new(v.x, v.y, 0.0),
            Plane::Yz => Vector3::new(0.0, v.y, v.z),
            Plane::Xz => Vector3::new(v.x, 0.0, v.z),
        }
    }
}
