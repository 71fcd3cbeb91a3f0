//! What an effect does to a prediction: a small change of joints, parameters, frames or measured points.

use super::drivers::Drivers;
use crate::rigid::Scalar;
use crate::tree::SegmentId;
use nalgebra::Vector3;
use num_dual::Dual64;
use std::fmt::Debug;
use std::ops::Range;

/// A place on the tree where a small twist can act.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Slot {
    /// Right before a segment: what hangs beside it stays where it is.
    Before(SegmentId),
    /// At its end: all that hangs on it moves.
    Behind(SegmentId),
}

impl Slot {
    /// The world's side of the base: the whole arm moves; of several the first one, against the others.
    pub const WORLD: Slot = Slot::Before(0);
}

/// The sum of what the effects change, in sparse lists.
#[derive(Debug, Clone)]
pub struct Deformation<D: Scalar> {
    /// Added to the reading of a joint [rad] (prismatic: [m]).
    pub joints: Vec<(usize, D)>,
    /// Added to a parameter of the path, by its index in the parameter vector.
    pub parameters: Vec<(usize, D)>,
    /// Inserted at a slot: translation [m], then rotation vector [rad].
    pub twists: Vec<(Slot, [D; 6])>,
    /// Added to the seated point, in the frame of the board [m].
    pub seat_m: Vector3<D>,
}

impl<D: Scalar> Deformation<D> {
    /// No change.
    pub fn none() -> Deformation<D> {
        Deformation {
            joints: Vec::new(),
            parameters: Vec::new(),
            twists: Vec::new(),
            seat_m: Vector3::repeat(D::from(0.0)),
        }
    }

    /// Forgets every change, keeping the memory.
    pub fn clear(&mut self) {
        self.joints.clear();
        self.parameters.clear();
        self.twists.clear();
        self.seat_m = Vector3::repeat(D::from(0.0));
    }

    /// The link is further in +q than the encoder says, by this much.
    pub fn joint(&mut self, joint: usize, change: D) {
        self.joints.push((joint, change));
    }

    /// A parameter of the path is larger by this much.
    pub fn parameter(&mut self, index: usize, change: D) {
        self.parameters.push((index, change));
    }

    /// What comes after the slot is moved and turned, in the frame of the slot.
    pub fn twist(&mut self, slot: Slot, translation_m: [D; 3], rotation_rad: [D; 3]) {
        let ([x, y, z], [rx, ry, rz]) = (translation_m, rotation_rad);
        self.twists.push((slot, [x, y, z, rx, ry, rz]));
    }
}

/// The physics of an effect that has been put in its place, written once for every scalar.
///
/// `theta` holds its amplitudes in the order they were declared, then its shapes.
pub trait Physics: Debug + Send + Sync + 'static {
    /// Adds what the effect does to this observation. Zero amplitudes must add exact zeros.
    fn deform<D: Scalar>(&self, theta: &[D], x: &Drivers<'_>, change: &mut Deformation<D>);

    /// How far the sensor sees a point from where it is [m], in the world; only asked of effects that say they
    /// distort what is seen. Tip, board and base are all seen by the sensor.
    fn seen<D: Scalar>(&self, _theta: &[D], _point_m: &Vector3<D>) -> Vector3<D> {
        Vector3::repeat(D::from(0.0))
    }

    /// A joint with a gap in its drive, and the width of the gap [rad] (prismatic: [m]).
    fn gap(&self, _theta: &[f64]) -> Option<(usize, f64)> {
        None
    }

    /// Of an effect that turns one joint in proportion to its many amplitudes: the joint, and by how much [rad] (prismatic:
    /// [m]) for a unit of each of the `count`. [`Physics::deform`] is the sum of these, and one pass gives all derivatives.
    fn per_amplitude(&self, _x: &Drivers<'_>, _count: usize) -> Option<(usize, Vec<f64>)> {
        None
    }

    /// The entries of `theta` that can matter to this observation.
    fn touched(&self, _x: &Drivers<'_>, count: usize) -> Range<usize> {
        0..count
    }
}

/// [`Physics`] for the two scalars in use, so that effects of every kind can stand in one list.
pub trait AnyPhysics: Debug + Send + Sync {
    /// [`Physics::deform`], predicting.
    fn predict(&self, theta: &[f64], x: &Drivers<'_>, change: &mut Deformation<f64>);
    /// [`Physics::deform`], differentiating.
    fn differentiate(&self, theta: &[Dual64], x: &Drivers<'_>, change: &mut Deformation<Dual64>);
    /// [`Physics::seen`], predicting.
    fn predict_seen(&self, theta: &[f64], point_m: &Vector3<f64>) -> Vector3<f64>;
    /// [`Physics::seen`], differentiating.
    fn differentiate_seen(&self, theta: &[Dual64], point_m: &Vector3<Dual64>) -> Vector3<Dual64>;
    /// [`Physics::gap`].
    fn gap_of(&self, theta: &[f64]) -> Option<(usize, f64)>;
    /// A joint that may rest anywhere in its gap, while a cavity holds the tip (`seated`) or not, and the variance of where
    /// it does [rad^2] (prismatic: [m^2]): what no prediction can know.
    fn slack(&self, _theta: &[f64], _seated: bool) -> Option<(usize, f64)> {
        None
    }
    /// [`Physics::per_amplitude`].
    fn in_proportion(&self, _x: &Drivers<'_>, _count: usize) -> Option<(usize, Vec<f64>)> {
        None
    }
    /// [`Physics::touched`].
    fn touched_entries(&self, x: &Drivers<'_>, count: usize) -> Range<usize>;
}

impl<P: Physics> AnyPhysics for P {
    fn predict(&self, theta: &[f64], x: &Drivers<'_>, change: &mut Deformation<f64>) {
        self.deform(theta, x, change);
    }

    fn differentiate(&self, theta: &[Dual64], x: &Drivers<'_>, change: &mut Deformation<Dual64>) {
        self.deform(theta, x, change);
    }

    fn predict_seen(&self, theta: &[f64], point_m: &Vector3<f64>) -> Vector3<f64> {
        self.seen(theta, point_m)
    }

    fn differentiate_seen(&self, theta: &[Dual64], point_m: &Vector3<Dual64>) -> Vector3<Dual64> {
        self.seen(theta, point_m)
    }

    fn gap_of(&self, theta: &[f64]) -> Option<(usize, f64)> {
        self.gap(theta)
    }

    fn in_proportion(&self, x: &Drivers<'_>, count: usize) -> Option<(usize, Vec<f64>)> {
        self.per_amplitude(x, count)
    }

    fn touched_entries(&self, x: &Drivers<'_>, count: usize) -> Range<usize> {
        self.touched(x, count)
    }
}
