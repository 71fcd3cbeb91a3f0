//! How far a point is from another: a ballbar, a draw-wire, a rigid link between two tips.

use super::{Measurement, MeasurementKind};
use crate::rigid::Scalar;
use armcal_core::reference;
use nalgebra::Vector3;

/// How far a point is from another.
pub static KIND: MeasurementKind = MeasurementKind {
    name: reference::DISTANCE,
    preposition: "from",
    is_against_plane: false,
    has_length: true,
    number: &Distance,
};

#[derive(Debug)]
struct Distance;

impl Measurement for Distance {
    fn number<D: Scalar>(&self, point_m: &Vector3<D>) -> D {
        (point_m.x * point_m.x + point_m.y * point_m.y + point_m.z * point_m.z).sqrt()
    }
}
