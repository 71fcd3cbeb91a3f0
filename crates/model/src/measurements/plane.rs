//! How high a point is above a plane: a touch, which is zero, or a gauge along the normal.

use super::{Measurement, MeasurementKind};
use crate::rigid::Scalar;
use armcal_core::reference;
use nalgebra::Vector3;

pub(super) static KIND: MeasurementKind = MeasurementKind {
    name: reference::PLANE,
    preposition: "above",
    is_against_plane: true,
    has_length: false,
    number: &Height,
};

#[derive(Debug)]
struct Height;

impl Measurement for Height {
    fn number<D: Scalar>(&self, point_m: &Vector3<D>) -> D {
        point_m.z
    }
}
