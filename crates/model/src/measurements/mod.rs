//! Kinds of measurement that give one number of a point of the arms and another place. One file, one line of the list below.
//!
//! A kind says how far the point is from something of the place: the place itself, its plane. The instrument shows that number, or
//! what it is beyond a length. The model makes one row of it, `(length + reading) - number`, whose derivative comes from dual
//! numbers through the kind's formula and the motions of both sides. A program that embeds armcal adds kinds with
//! [`register_measurements`].
//!
//! What is in one point with its place, and what a sensor saw, has three rows and is no number: `model::measurement`.

mod distance;
mod plane;

pub use distance::KIND as DISTANCE;

use crate::rigid::Scalar;
use crate::{ModelError, registry};
use nalgebra::Vector3;
use num_dual::Dual64;
use std::fmt::Debug;
use std::sync::OnceLock;

/// One kind of measurement.
#[derive(Debug, Clone, Copy)]
pub struct MeasurementKind {
    /// Its name in files.
    pub name: &'static str,
    /// How what it measures is called, between the names of point and place: `tip from post`.
    pub preposition: &'static str,
    /// Whether it is against a plane of `[planes]`, whose z axis is the normal; otherwise against a point.
    pub is_against_plane: bool,
    /// Whether its instrument may show what is beyond a length.
    pub has_length: bool,
    /// The number.
    pub number: &'static dyn AnyMeasurement,
}

impl PartialEq for MeasurementKind {
    fn eq(&self, other: &MeasurementKind) -> bool {
        self.name == other.name
    }
}

/// The formula of a kind, written once for every scalar.
pub trait Measurement: Debug + Sync {
    /// The number [m], of the point in the frame of the place: how far it is from something, so that its gradient has length one.
    fn number<D: Scalar>(&self, point_m: &Vector3<D>) -> D;
}

/// [`Measurement`] as the model asks it.
pub trait AnyMeasurement: Debug + Sync {
    /// The number [m] and its gradient.
    fn number_with_gradient(&self, point_m: &Vector3<f64>) -> (f64, Vector3<f64>);
}

impl<M: Measurement> AnyMeasurement for M {
    fn number_with_gradient(&self, point_m: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let along = |axis: usize| {
            let seed = |k: usize| Dual64::new(point_m[k], if k == axis { 1.0 } else { 0.0 });
            self.number(&Vector3::from_fn(|k, _| seed(k)))
        };
        let by_axis = [0, 1, 2].map(along);
        (by_axis[0].re, Vector3::from_fn(|axis, _| by_axis[axis].eps))
    }
}

/// Every kind of ours.
static KINDS: &[&MeasurementKind] = &[&distance::KIND, &plane::KIND];

/// The kinds of this process: ours, then what was registered before they were first asked for.
static ALL: OnceLock<Vec<&'static MeasurementKind>> = OnceLock::new();

/// Every kind.
pub fn measurement_kinds() -> &'static [&'static MeasurementKind] {
    ALL.get_or_init(|| KINDS.to_vec())
}

/// A kind by its name.
pub fn find_measurement(kind: &str) -> Option<&'static MeasurementKind> {
    measurement_kinds().iter().copied().find(|own| own.name == kind)
}

/// Adds kinds to ours: once, before a model or a pipeline is read.
///
/// # Errors
/// The kinds are in use already; a name that is no key of a file, or that there is already.
pub fn register_measurements(kinds: &[&'static MeasurementKind]) -> Result<(), ModelError> {
    registry::register(&ALL, KINDS, kinds, |kind| kind.name)
}
