//! What is predicted of an observation and what was measured: residual and exact derivative.

use super::Model;
use super::linearisation::Linearisation;
use super::measured::{measured_m, seated_m};
use super::measurement::Sides;
use super::predicting::Predicting;
use crate::residual::{ModelResidual, add_to_column, rotation_error_rate};
use crate::segment::Segment;
use crate::tree::Asked;
use armcal_core::{Against, Observation, Pose};
use nalgebra::{DMatrix, Matrix3xX, Vector3};

impl Model {
    /// Where the tip was, in the world: as the sensor saw it, the cavity of the board, or where what it was
    /// measured against has it [m].
    pub fn measured_tip_in_world(&self, p: &[f64], o: &Observation) -> Vector3<f64> {
        if let Some((model, p)) = self.seen(p, o) {
            return model.measured_tip_in_world(&p, o);
        }
        // Where the arm comes into it only through what effects do to the seat, it need not be followed.
        match (o.seen_m(), o.cavity(), &self.effects) {
            (Some(seen_m), ..) => *seen_m,
            (None, Some(_), None) => {
                let board = self.board_under(o).map(|board| board.transform(p, &[]));
                measured_m(o, board.as_ref(), &seated_m(o))
            }
            _ => self.sides(p, o).measured_m(o),
        }
    }

    /// Where the model puts what the observation is of, a tip or a marker, in the world [m], effects included.
    pub fn predicted_tip_in_world(&self, p: &[f64], o: &Observation) -> Vector3<f64> {
        self.sides(p, o).predicted.translation_m
    }

    /// The same with its orientation.
    pub fn predicted_pose_in_world(&self, p: &[f64], o: &Observation) -> Pose {
        Pose::from(&self.sides(p, o).predicted)
    }

    /// `measured - predicted`: 3 rows of position [m], and 3 of rotation [rad] if the observation has an orientation; of a
    /// distance or a height one.
    pub fn residual(&self, p: &[f64], o: &Observation) -> ModelResidual {
        self.sides(p, o).residual(o, true)
    }

    /// Calls `each` with the [`Model::residual`] of every one of many observations at the same parameters, in their order: what
    /// is alike for all of them that follow each other in a recording is worked out once. Rows of orientation are missing where
    /// no `turns` are asked for.
    pub fn residuals(
        &self,
        p: &[f64],
        observations: &[&Observation],
        turns: bool,
        each: &mut dyn FnMut(&Observation, ModelResidual),
    ) {
        for alike in self.alike(observations) {
            let (model, p) = self.in_recording(alike[0].dwell.recording, p);
            let at = Predicting::of(model, &p, alike);
            alike.iter().for_each(|o| each(o, at.residual(o, turns)));
        }
    }

    /// The residual and d residual / d p: its rows, one column for every parameter, free or not. Exact.
    pub fn residual_with_jacobian(&self, p: &[f64], o: &Observation) -> (ModelResidual, DMatrix<f64>) {
        if let Some((model, own)) = self.seen(p, o) {
            let (residual, jacobian) = model.residual_with_jacobian(&own, o);
            return (residual, self.by_all(&jacobian, o));
        }
        Linearisation::of(self, p, &[o], &|_| true, true).residual_with_jacobian(o)
    }

    /// Calls `each` with the [`Model::residual_with_jacobian`] of every one of many observations at the same parameters, in
    /// their order: what is alike for all of them that follow each other in a recording is worked out once. Columns of
    /// parameters that are not `asked` for may be zero, and rows of orientation are missing where no `turns` are.
    pub fn residuals_with_jacobians(
        &self,
        p: &[f64],
        observations: &[&Observation],
        (asked, turns): (&Asked<'_>, bool),
        each: &mut dyn FnMut(&Observation, ModelResidual, DMatrix<f64>),
    ) {
        for alike in self.alike(observations) {
            let recording = alike[0].dwell.recording;
            let ((model, p), known) = (self.in_recording(recording, p), self.known_in(recording));
            let asked = |own: usize| asked(known.map_or(own, |known| known[own]));
            let at = Linearisation::of(model, &p, alike, &asked, turns);
            for o in alike {
                let (residual, jacobian) = at.residual_with_jacobian(o);
                each(o, residual, if known.is_some() { self.by_all(&jacobian, o) } else { jacobian });
            }
        }
    }

    /// d (predicted - measured) / d joint reading [m/rad] (prismatic: [m/m]), one column a joint, in the world: carries the
    /// encoders' noise to the tip.
    pub fn joint_jacobian(&self, p: &[f64], o: &Observation) -> Matrix3xX<f64> {
        let mut jacobian = Matrix3xX::zeros(self.joint_count());
        // A reading that moves two joints on the way has two parts.
        let mut add = |column: usize, part: Vector3<f64>| {
            let mut own = jacobian.column_mut(column);
            own += part;
        };
        for (column, twist) in self.joint_twists(p, o.feature, o) {
            add(column, twist.translation_m);
        }
        if let Some(Against::Feature(to)) = o.against() {
            for (column, twist) in self.joint_twists(p, to, o) {
                add(column, -twist.translation_m);
            }
        }
        jacobian
    }

    /// The residual and d residual / d joint reading: its rows, one column a joint. Inverse kinematics iterates on
    /// it. What drives the effects is held, so that their own slope over the joint angle, a few per cent, is left out.
    pub fn residual_with_joint_jacobian(&self, p: &[f64], o: &Observation) -> (ModelResidual, DMatrix<f64>) {
        let residual = self.residual(p, o);
        let moved = self.joint_jacobian(p, o);
        let mut jacobian = DMatrix::zeros(residual.len(), self.joint_count());
        match residual.along {
            Some(along) => jacobian.row_mut(0).copy_from(&-(along.transpose() * moved)),
            None => jacobian.rows_mut(0, 3).copy_from(&-moved),
        }
        if let Some(rate) = residual.rotation_rad.as_ref().map(rotation_error_rate) {
            for (column, twist) in self.joint_twists(p, o.feature, o) {
                add_to_column(&mut jacobian, 3, column, &(rate * twist.rotation_rad));
            }
        }
        (residual, jacobian)
    }

    fn sides(&self, p: &[f64], o: &Observation) -> Sides {
        match self.seen(p, o) {
            Some((model, p)) => model.sides(&p, o),
            None => Predicting::of(self, p, &[o]).sides(o),
        }
    }

    /// The board that the tip is seated in.
    pub(super) fn board_under(&self, o: &Observation) -> Option<&Segment> {
        self.boards.get(&o.dwell.recording).filter(|_| o.cavity().is_some())
    }
}
