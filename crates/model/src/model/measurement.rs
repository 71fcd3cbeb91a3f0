//! What is measured against what, in rows: the only place that knows one kind of measurement from another.
//!
//! | kind | rows | residual |
//! |---|--:|---|
//! | in a point: tracked, seated, joined | 3 | `other - at` |
//! | a tracked pose | 6 | the same, `Log(R_measured R_at')` |
//! | a distance | 1 | `abs(other - at) - (length + reading)` |
//! | a height above a plane | 1 | `reading - z . (at - other)` |
//!
//! With `d` the motion of `at`, `D` and `W` those of `other` and their unit vector `along` (from `at` to `other`, or the plane's
//! z), one row of either kind changes by `along . (D - d) + (W x along) . (other - at)`: a distance does not see that it turns.

use super::Model;
use crate::residual::{ModelResidual, add_to_column, rotation_error_rad};
use crate::rigid::Rigid;
use crate::segment::LinearisedSegment;
use crate::twist::Twist;
use armcal_core::{Against, FeatureId, Observation, Pose, Reference};
use nalgebra::{DMatrix, UnitQuaternion, Vector3};

/// What is measured and what is predicted of one observation.
pub(super) struct Sides {
    /// What the tip is measured against, in the world; only its position counts, but of a plane.
    pub other: Rigid<f64>,
    pub predicted: Rigid<f64>,
    /// What a distance or a height should be [m]: length and reading.
    pub expected_m: f64,
}

impl Sides {
    /// Of a position that is compared with a point.
    pub fn with_point(measured_m: Vector3<f64>, predicted: Rigid<f64>) -> Sides {
        let other = Rigid { translation_m: measured_m, ..Rigid::identity() };
        Sides { other, predicted, expected_m: 0.0 }
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
        let gap_m = self.other.translation_m - self.predicted.translation_m;
        let scalar = |along: Vector3<f64>, error_m: f64| ModelResidual {
            position_m: along * error_m,
            rotation_rad: None,
            along: Some(along),
        };
        match &o.reference {
            Reference::Apart { .. } => {
                // Any axis for no gap.
                let along = gap_m.try_normalize(0.0).unwrap_or_else(Vector3::x);
                scalar(along, gap_m.norm() - self.expected_m)
            }
            Reference::Above { .. } => {
                let along: Vector3<f64> = self.other.rotation.column(2).into();
                scalar(along, self.expected_m + along.dot(&gap_m))
            }
            Reference::Tracked { orientation: Some(measured), .. } if turns => {
                let predicted: UnitQuaternion<f64> = Pose::from(&self.predicted).rotation;
                let rotation_rad = Some(rotation_error_rad(measured, &predicted));
                ModelResidual { position_m: gap_m, rotation_rad, along: None }
            }
            Reference::Tracked { .. } | Reference::Seated { .. } | Reference::Joined { .. } => {
                ModelResidual { position_m: gap_m, rotation_rad: None, along: None }
            }
        }
    }

    /// The residual and its derivative, where both sides move with parameters: `of_tip`, `of_other` by their columns.
    pub fn linearised(
        &self,
        o: &Observation,
        of_tip: &[(usize, Twist)],
        of_other: &[(usize, Twist)],
        (parameters, length): (usize, Option<usize>),
    ) -> (ModelResidual, DMatrix<f64>) {
        let residual = self.residual(o, true);
        let mut gap = DMatrix::zeros(3, parameters);
        of_tip.iter().for_each(|(k, twist)| add_to_column(&mut gap, 0, *k, &-twist.translation_m));
        of_other.iter().for_each(|(k, twist)| add_to_column(&mut gap, 0, *k, &twist.translation_m));
        let Some(along) = residual.along else { return (residual, gap) };
        let mut row = DMatrix::from_fn(1, parameters, |_, column| along.dot(&gap.column(column)));
        if let Reference::Above { .. } = o.reference {
            let gap_m = self.other.translation_m - self.predicted.translation_m;
            for (k, twist) in of_other {
                row[(0, *k)] += twist.rotation_rad.cross(&along).dot(&gap_m);
            }
        }
        length.into_iter().for_each(|length| row[(0, length)] = -1.0);
        (residual, row)
    }
}

impl Model {
    /// Index of the length that the distance of an observation counts from.
    pub(super) fn length_of(&self, o: &Observation) -> Option<usize> {
        self.lengths.get(o.length()?).copied()
    }

    /// What a distance or a height should be [m]; zero where the tip should be in a point.
    pub(super) fn expected_m(&self, p: &[f64], o: &Observation) -> f64 {
        match o.reference {
            Reference::Apart { reading_m, .. } => self.length_of(o).map_or(f64::NAN, |k| p[k]) + reading_m,
            Reference::Above { reading_m, .. } => reading_m,
            _ => 0.0,
        }
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
