//! One piece of the tree from the world to what is measured: a few parameters, at most one joint, one small transform.
//!
//! This is the only place where kinematic formulas stand. They are generic over the scalar, so the
//! derivative of a segment with respect to each of its parameters comes from the same lines that predict.

use crate::rigid::{Rigid, Scalar, matrix_product, rotation_of_vector};
use crate::twist::Twists;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Most parameters one segment has (x, y, z, rx, ry, rz of an origin).
pub(crate) const MAX_PARAMETERS: usize = 6;

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
    pub fn at(&self, reading: f64) -> f64 {
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

/// What is constant of a segment, before and behind the motion of its joint.
pub(crate) struct Parts<D: Scalar> {
    /// None where the joint moves its start.
    pub before: Option<Rigid<D>>,
    /// From where the joint moves to the end.
    pub behind: Rigid<D>,
}

impl<D: Scalar> Parts<D> {
    /// Both together.
    pub fn whole(self) -> Rigid<D> {
        self.before.map_or(self.behind, |before| before.then(&self.behind))
    }
}

impl Segment {
    /// Its axis, if it is that of a URDF's joint and reads it itself.
    pub fn axis_of(&self, joint: usize) -> Option<&Vector3<f64>> {
        let own = self.joint.is_some_and(|j| j.index == joint && j.mimic.is_none());
        match &self.geometry {
            Geometry::Axis(axis) if own => Some(axis),
            _ => None,
        }
    }

    /// What is constant before and behind the motion of its joint: `transform = before * motion * behind`.
    pub fn parted(&self, p: &[f64]) -> (Rigid<f64>, Rigid<f64>) {
        let parts = self.parts(&p[self.parameters.clone()]);
        match self.joint {
            Some(_) => (parts.before.unwrap_or_else(Rigid::identity), parts.behind),
            None => (parts.whole(), Rigid::identity()),
        }
    }

    /// The axis that its joint turns about or slides along; of length one.
    pub fn axis(&self) -> Vector3<f64> {
        match &self.geometry {
            Geometry::Axis(axis) => *axis,
            _ => Vector3::z(),
        }
    }

    /// Its formula, at these values of its parameters.
    pub fn parts<D: Scalar>(&self, own: &[D]) -> Parts<D> {
        let o = D::from(0.0);
        match &self.geometry {
            Geometry::StandardDh { hayati } => {
                let behind = with_beta(standard_dh(own[0], own[1], own[2], own[3]), own, *hayati);
                Parts { before: None, behind }
            }
            Geometry::ModifiedDh { hayati } => {
                let behind = with_beta(modified_dh(own[0], own[1], o, o), own, *hayati);
                Parts { before: Some(modified_dh(o, o, own[2], own[3])), behind }
            }
            Geometry::Origin { nominal, freedom } => {
                Parts { before: None, behind: origin_transform(nominal, *freedom, own) }
            }
            Geometry::Axis(_) => Parts { before: None, behind: Rigid::identity() },
        }
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
fn origin_transform<D: Scalar>(nominal: &Rigid<f64>, freedom: Freedom, own: &[D]) -> Rigid<D> {
    let rotation = nominal.rotation.map(D::from);
    let turned = |rx, ry, rz| matrix_product(&rotation, &rotation_of_vector(&Vector3::new(rx, ry, rz)));
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

/// About or along an axis of length one: Rodrigues' formula.
pub(crate) fn joint_transform(axis: &Vector3<f64>, q: f64, motion: Motion) -> Rigid<f64> {
    match motion {
        Motion::Prismatic => Rigid { translation_m: axis * q, ..Rigid::identity() },
        Motion::Revolute => {
            let (sine, cosine) = q.sin_cos();
            // Rows of DH turn about z, and there are as many of these as poses: what the formula gives, without its products.
            if *axis == Vector3::z() {
                #[rustfmt::skip]
                let rotation = Matrix3::new(
                    cosine, -sine,   0.0,
                    sine,    cosine, 0.0,
                    0.0,     0.0,    cosine + (1.0 - cosine),
                );
                return Rigid { rotation, ..Rigid::identity() };
            }
            let across = axis.cross_matrix() * sine + axis * axis.transpose() * (1.0 - cosine);
            Rigid { rotation: Matrix3::identity() * cosine + across, ..Rigid::identity() }
        }
    }
}
