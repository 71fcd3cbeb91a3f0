//! One piece of the tree from the world to what is measured: a few parameters, at most one joint, one small transform.
//!
//! This is the only place where kinematic formulas stand. They are generic over the scalar, so the
//! derivative of a segment with respect to each of its parameters and its joint comes from the same
//! lines that predict.

use crate::rigid::{Rigid, Scalar, product, rotation_of_vector};
use crate::twist::Twists;
use nalgebra::{Matrix3, SVector, Vector3};
use num_dual::DualSVec64;
use std::array;
use std::ops::Range;

/// Most parameters one segment has (x, y, z, rx, ry, rz of an origin).
pub(crate) const MAX_PARAMETERS: usize = 6;

/// A dual number that differentiates by all quantities of a segment at once.
type Lanes = DualSVec64<MAX_PARAMETERS>;

/// How a joint moves its segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// About the joint's axis [rad].
    Revolute,
    /// Along the joint's axis [m].
    Prismatic,
}

/// The joint of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Joint {
    /// Index of its reading in the joint vector.
    pub index: usize,
    /// How it moves.
    pub motion: Motion,
    /// How its angle follows a reading that is another joint's; none where the reading is its own.
    pub mimic: Option<Mimic>,
}

/// A joint without an encoder: `q = ratio * reading + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mimic {
    /// Change of the joint per change of the reading.
    pub ratio: f64,
    /// Where the joint is when the reading is zero [rad] (prismatic: [m]).
    pub offset: f64,
}

impl Joint {
    /// A joint with a reading of its own.
    pub fn read(index: usize, motion: Motion) -> Joint {
        Joint { index, motion, mimic: None }
    }

    /// Where the joint is at a reading.
    pub fn at<D: Scalar>(&self, reading: D) -> D {
        match self.mimic {
            None => reading,
            Some(mimic) => reading * mimic.ratio + mimic.offset,
        }
    }
}

/// Shape of a segment's transform, and the meaning of its parameters in order.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Geometry {
    /// `Rz(theta + q) Tz(d) Tx(a) Rx(alpha)`, optionally `Ry(beta)`: theta, d, a, alpha(, beta).
    StandardDh {
        /// Whether the row ends in Hayati's `Ry(beta)`.
        hayati: bool,
    },
    /// `Rx(alpha) Tx(a) Rz(theta + q) Tz(d)`, optionally `Ry(beta)`: theta, d, a, alpha(, beta).
    ModifiedDh {
        /// Whether the row ends in Hayati's `Ry(beta)`.
        hayati: bool,
    },
    /// `T(x, y, z) R_nominal Exp(rx, ry, rz)`: a frame, or the origin of a URDF joint.
    Origin {
        /// The pose where nothing is free; where something is, only its rotation counts.
        nominal: Rigid<f64>,
        /// Which part of it are parameters.
        freedom: Freedom,
    },
    /// A URDF joint about or along this unit vector.
    Axis(Vector3<f64>),
}

/// Which parts of an origin are parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Freedom {
    /// None: a constant.
    Constant,
    /// x, y, z.
    Position,
    /// z along its own axis from where it is at nominal, then rx, ry.
    Plane,
    /// x, y, z, rx, ry, rz.
    Full,
}

/// What weighs on a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Body {
    /// Mass [kg].
    pub mass_kg: f64,
    /// Its centre [m]; of a segment's own body in the frame at its end.
    pub centre_m: Vector3<f64>,
}

impl Body {
    /// Nothing.
    pub const NONE: Body = Body { mass_kg: 0.0, centre_m: Vector3::new(0.0, 0.0, 0.0) };

    /// Adds another body; both centres in one frame.
    pub fn add(&mut self, other: &Body) {
        let mass_kg = self.mass_kg + other.mass_kg;
        // The first one is taken as it is, to the bit.
        let share = if self.mass_kg == 0.0 { 1.0 } else { other.mass_kg / mass_kg };
        match share == 1.0 {
            true => self.centre_m = other.centre_m,
            false => self.centre_m += (other.centre_m - self.centre_m) * share,
        }
        self.mass_kg = mass_kg;
    }
}

/// One segment of the tree.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Segment {
    /// The segment at whose end it begins; none for one that begins in the world.
    pub parent: Option<usize>,
    /// Name of the frame at its end, for drawing; none where the next segment ends the link.
    pub frame: Option<String>,
    /// Its formula.
    pub geometry: Geometry,
    /// Its joint, if it moves.
    pub joint: Option<Joint>,
    /// Where its parameters are in the parameter vector.
    pub parameters: Range<usize>,
    /// The mass of its link, where the file of the arm tells it.
    pub body: Option<Body>,
}

/// A segment's transform and how its end moves.
pub(crate) struct LinearisedSegment {
    /// The transform.
    pub transform: Rigid<f64>,
    /// Motions of its end, in axes of its start: by each parameter in order, then by the joint value; none where there is
    /// neither.
    pub motions: Twists<MAX_PARAMETERS>,
}

impl Segment {
    /// The transform from the frame before the segment to the one after it, predicted.
    ///
    /// `p` is the whole parameter vector and `joints` the whole joint vector; a joint that is missing is NaN.
    pub fn transform(&self, p: &[f64], joints: &[f64]) -> Rigid<f64> {
        self.local(&p[self.parameters.clone()], self.reading(joints))
    }

    /// [`Segment::transform`] and its derivatives, in one pass.
    pub fn linearised(&self, p: &[f64], joints: &[f64]) -> LinearisedSegment {
        let own = &p[self.parameters.clone()];
        let mut lanes = [Lanes::from(0.0); MAX_PARAMETERS];
        for (k, (lane, &value)) in lanes.iter_mut().zip(own).enumerate() {
            *lane = Lanes::from(value).derivative(k);
        }
        // Only a segment with at most five parameters has a joint: there is a lane left for it.
        let q = Lanes::from(self.reading(joints));
        let q = if self.joint.is_some() { q.derivative(own.len()) } else { q };
        LinearisedSegment::from(&self.local(&lanes[..own.len()], q))
    }

    /// What is constant before and behind the motion of its joint: `transform = before * motion * behind`.
    pub fn parted(&self, p: &[f64]) -> (Rigid<f64>, Rigid<f64>) {
        let own = &p[self.parameters.clone()];
        match (&self.geometry, self.joint) {
            (Geometry::ModifiedDh { hayati }, Some(_)) => {
                let behind = with_beta(modified_dh(own[0], own[1], 0.0, 0.0), own, *hayati);
                (modified_dh(0.0, 0.0, own[2], own[3]), behind)
            }
            (Geometry::StandardDh { .. }, Some(_)) => (Rigid::identity(), self.local(own, 0.0)),
            (Geometry::Axis(_), _) => (Rigid::identity(), Rigid::identity()),
            _ => (self.local(own, 0.0), Rigid::identity()),
        }
    }

    /// The axis that its joint turns about or slides along.
    pub fn axis(&self) -> Vector3<f64> {
        match &self.geometry {
            Geometry::Axis(axis) => *axis,
            _ => Vector3::z(),
        }
    }

    fn reading(&self, joints: &[f64]) -> f64 {
        match self.joint {
            Some(joint) => joints.get(joint.index).copied().unwrap_or(f64::NAN),
            None => 0.0,
        }
    }

    fn local<D: Scalar>(&self, own: &[D], reading: D) -> Rigid<D> {
        let motion = self.joint.map(|joint| joint.motion);
        let q = self.joint.map_or(reading, |joint| joint.at(reading));
        match &self.geometry {
            Geometry::StandardDh { hayati } => {
                let (theta, d) = joined(own, q, motion);
                with_beta(standard_dh(theta, d, own[2], own[3]), own, *hayati)
            }
            Geometry::ModifiedDh { hayati } => {
                let (theta, d) = joined(own, q, motion);
                with_beta(modified_dh(theta, d, own[2], own[3]), own, *hayati)
            }
            Geometry::Origin { nominal, freedom } => origin(nominal, *freedom, own),
            Geometry::Axis(axis) => moved(&axis.map(D::from), q, motion),
        }
    }
}

impl From<&Rigid<Lanes>> for LinearisedSegment {
    fn from(dual: &Rigid<Lanes>) -> LinearisedSegment {
        let transform = Rigid {
            rotation: dual.rotation.map(|entry| entry.re),
            translation_m: dual.translation_m.map(|entry| entry.re),
        };
        // Of dR R' = [w]x, the entry below the diagonal for each axis.
        let rate = |i: usize, j: usize| {
            let term = |k: usize| lanes(&dual.rotation[(i, k)]) * transform.rotation[(j, k)];
            term(0) + term(1) + term(2)
        };
        let rotation_rad = [rate(2, 1), rate(0, 2), rate(1, 0)];
        let translation_m = array::from_fn(|axis| lanes(&dual.translation_m[axis]));
        LinearisedSegment { transform, motions: Twists { translation_m, rotation_rad } }
    }
}

/// The derivatives of an entry; one that depends on nothing has none.
fn lanes(entry: &Lanes) -> SVector<f64, MAX_PARAMETERS> {
    entry.eps.0.unwrap_or_default()
}

/// `theta` and `d` of a DH row with the joint value added to the one that moves.
fn joined<D: Scalar>(own: &[D], q: D, motion: Option<Motion>) -> (D, D) {
    match motion {
        Some(Motion::Revolute) => (own[0] + q, own[1]),
        Some(Motion::Prismatic) => (own[0], own[1] + q),
        None => (own[0], own[1]),
    }
}

/// `Rz(theta) Tz(d) Tx(a) Rx(alpha)`: Denavit and Hartenberg 1955; eq. 9-10 of Li et al. 2016.
fn standard_dh<D: Scalar>(theta: D, d: D, a: D, alpha: D) -> Rigid<D> {
    let ((st, ct), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
    let o = D::from(0.0);
    #[rustfmt::skip]
    let rotation = Matrix3::new(
        ct, -st * ca,  st * sa,
        st,  ct * ca, -ct * sa,
        o,   sa,       ca,
    );
    Rigid { rotation, translation_m: Vector3::new(a * ct, a * st, d) }
}

/// `Rx(alpha) Tx(a) Rz(theta) Tz(d)`: Craig, Introduction to Robotics, 3rd ed., eq. 3.6.
fn modified_dh<D: Scalar>(theta: D, d: D, a: D, alpha: D) -> Rigid<D> {
    let ((st, ct), (sa, ca)) = (theta.sin_cos(), alpha.sin_cos());
    let o = D::from(0.0);
    #[rustfmt::skip]
    let rotation = Matrix3::new(
        ct,      -st,       o,
        st * ca,  ct * ca, -sa,
        st * sa,  ct * sa,  ca,
    );
    Rigid { rotation, translation_m: Vector3::new(a, -d * sa, d * ca) }
}

/// Hayati's extra `Ry(beta)` at the end of a row: it tilts the next axis about this row's y, the one
/// direction that a DH row between parallel axes cannot describe (Hayati and Mirmirani 1985).
fn with_beta<D: Scalar>(row: Rigid<D>, own: &[D], hayati: bool) -> Rigid<D> {
    if !hayati {
        return row;
    }
    let (s, c) = own[4].sin_cos();
    let (x, y, z) = (row.rotation.column(0), row.rotation.column(1), row.rotation.column(2));
    let rotation = Matrix3::from_columns(&[x * c - z * s, y.into_owned(), x * s + z * c]);
    Rigid { rotation, ..row }
}

/// `T(x, y, z) R_nominal Exp(rx, ry, rz)`, as far as these are parameters; of a plane `T_nominal Tz(z) Exp(rx, ry, 0)`.
fn origin<D: Scalar>(nominal: &Rigid<f64>, freedom: Freedom, own: &[D]) -> Rigid<D> {
    let rotation = nominal.rotation.map(D::from);
    let turned = |rx, ry, rz| product(&rotation, &rotation_of_vector(&Vector3::new(rx, ry, rz)));
    match (own, freedom) {
        (&[x, y, z, rx, ry, rz], _) => {
            Rigid { rotation: turned(rx, ry, rz), translation_m: Vector3::new(x, y, z) }
        }
        (&[z, rx, ry], Freedom::Plane) => {
            let along = rotation.column(2) * z;
            let translation_m = nominal.translation_m.map(D::from) + along;
            Rigid { rotation: turned(rx, ry, D::from(0.0)), translation_m }
        }
        (&[x, y, z], _) => Rigid { rotation, translation_m: Vector3::new(x, y, z) },
        _ => Rigid { rotation, translation_m: nominal.translation_m.map(D::from) },
    }
}

/// About or along an axis.
pub(crate) fn moved<D: Scalar>(axis: &Vector3<D>, q: D, motion: Option<Motion>) -> Rigid<D> {
    match motion {
        Some(Motion::Prismatic) => Rigid { translation_m: axis * q, ..Rigid::identity() },
        Some(Motion::Revolute) => Rigid { rotation: rotation_of_vector(&(axis * q)), ..Rigid::identity() },
        None => Rigid::identity(),
    }
}
