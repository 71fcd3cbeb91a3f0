//! What an observation is measured against.

use crate::FeatureId;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;

/// How the true position of the tip is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "StoredReference", into = "StoredReference")]
pub enum Reference {
    /// The tip is seated in a cavity of the board; the board's pose is a frame of the model.
    Seated {
        /// Name of the cavity on the board.
        cavity: String,
        /// Centre of the seated tip in the frame of the (tilted) board [m].
        in_board_m: Vector3<f64>,
    },
    /// A sensor saw the tip, in the sensor's frame.
    Tracked {
        /// Position of the tracked body [m].
        position_m: Vector3<f64>,
        /// Orientation of the tracked body, where it is used.
        orientation: Option<UnitQuaternion<f64>>,
        /// Standard error of the orientation per axis [rad]; infinite, in JSON `null`, where there is none.
        orientation_sigma_rad: f64,
    },
    /// It is in one point with another place of the model.
    Joined {
        /// The other place.
        to: Against,
    },
    /// One number was measured between it and another place: how far it is from it, how high above it.
    Number {
        /// What: the name of a kind of measurement.
        kind: Cow<'static, str>,
        /// The other place.
        to: Against,
        /// Which of the model's lengths it counts from, by its place among them.
        length: Option<usize>,
        /// What an instrument shows beyond that length [m]; zero without one.
        reading_m: f64,
    },
}

/// A place that something can be measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Against {
    /// A point of the arms.
    Feature(FeatureId),
    /// A point or a plane that is fixed in the world, by its place among the model's.
    Fixed(usize),
}

impl Reference {
    /// A position the sensor saw [m], its frame; no orientation.
    pub fn position(position_m: Vector3<f64>) -> Reference {
        Reference::Tracked { position_m, orientation: None, orientation_sigma_rad: 0.0 }
    }

    /// A distance from another place, `p[length] + reading`: of a rigid link, or of a ballbar.
    pub fn distance(to: Against, length: usize, reading_m: f64) -> Reference {
        Reference::Number { kind: DISTANCE.into(), to, length: Some(length), reading_m }
    }

    /// A height above a plane, along the plane's z axis: zero where it touches, else what a gauge shows.
    pub fn height(plane: usize, reading_m: f64) -> Reference {
        Reference::Number { kind: PLANE.into(), to: Against::Fixed(plane), length: None, reading_m }
    }
}

/// Kinds of measurement that have a form of their own in files.
pub const DISTANCE: &str = "distance";
/// See [`DISTANCE`].
pub const PLANE: &str = "plane";

/// A reference in files. Distances and heights are written as version 0.1 did.
#[derive(Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum StoredReference {
    Seated {
        cavity: String,
        in_board_m: Vector3<f64>,
    },
    Tracked {
        position_m: Vector3<f64>,
        orientation: Option<UnitQuaternion<f64>>,
        #[serde(serialize_with = "finite", deserialize_with = "finite_or_infinity")]
        orientation_sigma_rad: f64,
    },
    Joined {
        to: Against,
    },
    Apart {
        from: Against,
        length: usize,
        reading_m: f64,
    },
    Above {
        plane: usize,
        reading_m: f64,
    },
    Number {
        measurement: String,
        to: Against,
        length: Option<usize>,
        reading_m: f64,
    },
}

impl From<Reference> for StoredReference {
    fn from(reference: Reference) -> StoredReference {
        match reference {
            Reference::Seated { cavity, in_board_m } => StoredReference::Seated { cavity, in_board_m },
            Reference::Tracked { position_m, orientation, orientation_sigma_rad } => {
                StoredReference::Tracked { position_m, orientation, orientation_sigma_rad }
            }
            Reference::Joined { to } => StoredReference::Joined { to },
            Reference::Number { kind, to, length, reading_m } => match (&*kind, to, length) {
                (DISTANCE, from, Some(length)) => StoredReference::Apart { from, length, reading_m },
                (PLANE, Against::Fixed(plane), None) => StoredReference::Above { plane, reading_m },
                _ => StoredReference::Number { measurement: kind.into_owned(), to, length, reading_m },
            },
        }
    }
}

impl From<StoredReference> for Reference {
    fn from(stored: StoredReference) -> Reference {
        match stored {
            StoredReference::Seated { cavity, in_board_m } => Reference::Seated { cavity, in_board_m },
            StoredReference::Tracked { position_m, orientation, orientation_sigma_rad } => {
                Reference::Tracked { position_m, orientation, orientation_sigma_rad }
            }
            StoredReference::Joined { to } => Reference::Joined { to },
            StoredReference::Apart { from, length, reading_m } => {
                Reference::distance(from, length, reading_m)
            }
            StoredReference::Above { plane, reading_m } => Reference::height(plane, reading_m),
            StoredReference::Number { measurement, to, length, reading_m } => {
                Reference::Number { kind: measurement.into(), to, length, reading_m }
            }
        }
    }
}

/// A number, or nothing for infinity, which JSON does not have.
fn finite<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    value.is_finite().then_some(*value).serialize(serializer)
}

fn finite_or_infinity<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
}
