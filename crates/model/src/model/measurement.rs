//! What is measured against what, in rows: the only place that knows one kind of measurement from another.
//!
//! | kind | rows | residual |
//! |---|--:|---|
//! | in a point: tracked, seated, joined | 3 | `other - at` |
//! | a tracked pose | 6 | the same, `Log(R_measured R_at')` |
//! | a number: a distance, a height, .. | 1 | `(length + reading) - number(at, other)` |
//!
//! With `d` the motion of `at`, `D` and `W` those of `other` and `along` the gradient of the number, one row changes by
//! `along . (D - d) + (W x along) . (other - at)`. A point does not turn.

use super::Model;
use crate::measurements::{DISTANCE, MeasurementKind, find_measurement};
use crate::residual::{ModelResidual, add_to_column, rotation_error_rad};
use crate::rigid::Rigid;
use crate::segment::LinearisedSegment;
use crate::twist::Twist;
use armcal_core::{Against, FeatureId, Observation, Pose, Reference};
use nalgebra::{DMatrix, Matrix3, UnitQuaternion, Vector3};

/// What is measured and what is predicted of one observation.
pub(super) struct Sides {
    /// What the tip is measured against, in the world; only its position counts, but of a plane.
    pub other: Rigid<f64>,
    pub predicted: Rigid<f64>,
    /// What a number is, where one was measured.
    pub number: Option<Number>,
}

/// A number that was measured.
#[derive(Clone, Copy)]
pub(super) struct Number {
    kind: &'static MeasurementKind,
    /// What it should be [m]: length and reading.
    expected_m: f64,
    /// The length that it counts from, among the parameters.
    length: Option<usize>,
}

impl Sides {
    /// Of a position that is compared with a point.
    pub fn with_point(measured_m: Vector3<f64>, predicted: Rigid<f64>) -> Sides {
        let other = Rigid { translation_m: measured_m, ..Rigid::identity() };
        Sides { other, predicted, number: None }
    }

    /// From the predicted point to the other [m].
    fn gap_m(&self) -> Vector3<f64> {
        self.other.translation_m - self.predicted.translation_m
    }

    /// What a number is off [m], and its gradient in the world: along it, the point would have to move by that.
    fn error_of(&self, number: &Number) -> (f64, Vector3<f64>) {
        let point_m = -self.gap_m();
        let in_world = if number.kind.is_against_plane { self.other.rotation } else { Matrix3::identity() };
        let (predicted_m, gradient) = number.kind.number.number_with_gradient(&in_world.tr_mul(&point_m));
        // Where it has no slope, as a distance of nothing, any axis is as good.
        let along = if gradient.iter().all(|g| g.is_finite()) { in_world * gradient } else { Vector3::x() };
        (number.expected_m - predicted_m, along)
    }

    /// Where the tip should be [m]. Of a distance between two arms that is where the other tip is.
    pub fn measured_m(&self, o: &Observation) -> Vector3<f64> {
        match o.is_scalar() && !o.is_joined() {
            true => self.predicted.translation_m + self.residual(o, false).position_m,
            false => self.other.translation_m,
        }
    }

    /// The residual; a rotation only where `turns` are asked for.
    pub fn residual(&self, o: &Observation, turns: bool) -> ModelResidual {
        if let Some(number) = &self.number {
            let (error_m, along) = self.error_of(number);
            return ModelResidual { position_m: along * error_m, rotation_rad: None, along: Some(along) };
        }
        let gap_m = self.gap_m();
        match &o.reference {
            Reference::Tracked { orientation: Some(measured), .. } if turns => {
                let predicted: UnitQuaternion<f64> = Pose::from(&self.predicted).rotation;
                let rotation_rad = Some(rotation_error_rad(measured, &predicted));
                ModelResidual { position_m: gap_m, rotation_rad, along: None }
            }
            _ => ModelResidual { position_m: gap_m, rotation_rad: None, along: None },
        }
    }

    /// The residual and its derivative, where both sides move with parameters: `of_tip`, `of_other` by their columns.
    pub fn linearised(
        &self,
        o: &Observation,
        of_tip: &[(usize, Twist)],
        of_other: &[(usize, Twist)],
        parameters: usize,
    ) -> (ModelResidual, DMatrix<f64>) {
        let residual = self.residual(o, true);
        let mut gap = DMatrix::zeros(3, parameters);
        of_tip.iter().for_each(|(k, twist)| add_to_column(&mut gap, 0, *k, &-twist.translation_m));
        of_other.iter().for_each(|(k, twist)| add_to_column(&mut gap, 0, *k, &twist.translation_m));
        let Some((number, along)) = self.number.zip(residual.along) else { return (residual, gap) };
        let mut row = DMatrix::from_fn(1, parameters, |_, column| along.dot(&gap.column(column)));
        if number.kind.is_against_plane {
            let gap_m = self.gap_m();
            for (k, twist) in of_other {
                row[(0, *k)] += twist.rotation_rad.cross(&along).dot(&gap_m);
            }
        }
        number.length.into_iter().for_each(|length| row[(0, length)] = 1.0);
        (residual, row)
    }
}

impl Model {
    /// The number that an observation is, if it is one; NaN of a kind or a length that there is not ([`Model::check`]).
    pub(super) fn number_of(&self, p: &[f64], o: &Observation) -> Option<Number> {
        let Reference::Number { kind, length, reading_m, .. } = &o.reference else { return None };
        let (known, index) = (find_measurement(kind), length.and_then(|length| self.lengths.get(length)));
        let length_m = match (known, length, index) {
            (Some(_), None, _) => 0.0,
            (Some(_), Some(_), Some(index)) => p[*index],
            _ => f64::NAN,
        };
        let kind = known.unwrap_or(&DISTANCE);
        Some(Number { kind, expected_m: length_m + reading_m, length: index.copied() })
    }

    /// The other place of an observation: a point of the arms, or where a fixed place is.
    pub(super) fn other(
        &self,
        p: &[f64],
        o: &Observation,
        at: &dyn Fn(FeatureId) -> Rigid<f64>,
    ) -> Option<Rigid<f64>> {
        Some(match o.against()? {
            Against::Feature(to) => at(to),
            Against::Fixed(place) => self.fixed[place].segment.transform(p, &[]),
        })
    }

    /// A fixed place and how it moves with its parameters.
    pub(super) fn linearised_place(&self, p: &[f64], place: usize) -> (Rigid<f64>, Vec<(usize, Twist)>) {
        let segment = &self.fixed[place].segment;
        let LinearisedSegment { transform, motions } = segment.linearised(p, &[]);
        let columns = segment.parameters.clone().enumerate().map(|(k, index)| (index, motions.by(k)));
        (transform, columns.collect())
    }
}
