//! A model at one parameter vector: residual and exact Jacobian of as many observations as are asked for.

use super::Model;
use super::prediction::{Sides, measured_m, seated_m};
use crate::effects::Effects;
use crate::residual::{ModelResidual, add_to_column, rotation_error_rate};
use crate::rigid::Rigid;
use crate::segment::{LinearisedSegment, Segment};
use crate::tree::TreeAt;
use crate::twist::Twist;
use armcal_core::{FeatureId, Observation, Reference};
use nalgebra::{DMatrix, Vector3};
use std::collections::BTreeMap;

/// What is alike for all observations is worked out once.
pub(crate) struct Linearisation<'a> {
    model: &'a Model,
    p: &'a [f64],
    arm: Arm<'a>,
    /// The boards that something is seated in, by recording.
    boards: BTreeMap<usize, LinearisedSegment>,
}

enum Arm<'a> {
    Rigid(TreeAt<'a>),
    /// With every pose other parameters.
    Deformed(&'a Effects, TreeAt<'a>),
}

impl<'a> Linearisation<'a> {
    /// For these observations.
    pub fn of(model: &'a Model, p: &'a [f64], observations: &[&Observation]) -> Linearisation<'a> {
        let arm = match &model.effects {
            None => Arm::Rigid(TreeAt::of(&model.tree, p)),
            Some(effects) => Arm::Deformed(effects, effects.tree_at(p)),
        };
        let seated = observations.iter().filter_map(|o| Some((o.dwell.recording, model.board_under(o)?)));
        let boards: BTreeMap<usize, &Segment> = seated.collect();
        let boards = boards.into_iter().map(|(recording, board)| (recording, board.linearised(p, &[])));
        Linearisation { model, p, arm, boards: boards.collect() }
    }

    /// The residual of one of them and d residual / d p.
    pub fn residual_with_jacobian(&self, o: &Observation) -> (ModelResidual, DMatrix<f64>) {
        let drivers = match &self.arm {
            Arm::Rigid(_) => None,
            Arm::Deformed(effects, _) => Some(effects.drivers(self.model, o)),
        };
        let at = |feature: FeatureId| match (&self.arm, &drivers) {
            (Arm::Deformed(effects, tree), Some(drivers)) => {
                let arm = effects.linearise(tree, self.p, feature, drivers);
                (arm.at.tip, arm.at.in_board_m, arm.parameters, arm.seats)
            }
            (Arm::Rigid(tree) | Arm::Deformed(_, tree), _) => {
                let tip = tree.linearised(self.model.route(feature), &o.joint_rad);
                (tip.at, seated_m(o), tip.parameters, Vec::new())
            }
        };
        let (predicted, in_board_m, columns, seats) = at(o.feature);
        if let Reference::Joined { to, .. } = o.reference {
            let (other, _, of_other, _) = at(to);
            return self.joined(o, predicted, &columns, (other.translation_m, &of_other));
        }
        let board = self.model.board_under(o).zip(self.boards.get(&o.dwell.recording));
        let measured_m = measured_m(o, board.map(|(_, at)| &at.transform), &in_board_m);
        let residual = Sides { measured_m, predicted, apart_m: None }.residual(o);
        let mut jacobian = DMatrix::zeros(residual.len(), self.model.parameters.len());
        for (column, twist) in &columns {
            add_to_column(&mut jacobian, 0, *column, &-twist.translation_m);
        }
        if let Some(error_rad) = &residual.rotation_rad {
            let rate = rotation_error_rate(error_rad);
            for (column, twist) in &columns {
                add_to_column(&mut jacobian, 3, *column, &(rate * twist.rotation_rad));
            }
        }
        if let Some((board, at)) = board {
            let mut seated = at.motions;
            seated.shift(&(at.transform.rotation * in_board_m));
            for (k, column) in board.parameters.clone().enumerate() {
                add_to_column(&mut jacobian, 0, column, &seated.by(k).translation_m);
            }
            for (column, change_m) in &seats {
                add_to_column(&mut jacobian, 0, *column, &(at.transform.rotation * change_m));
            }
        }
        (residual, jacobian)
    }

    /// Of a point whose reference is another point of the arms, where that is and how it moves.
    fn joined(
        &self,
        o: &Observation,
        predicted: Rigid<f64>,
        columns: &[(usize, Twist)],
        (other_m, of_other): (Vector3<f64>, &[(usize, Twist)]),
    ) -> (ModelResidual, DMatrix<f64>) {
        let link = self.model.link_of(o);
        let sides = Sides { measured_m: other_m, predicted, apart_m: link.map(|link| self.p[link]) };
        let residual = sides.residual(o);
        let mut gap = DMatrix::zeros(3, self.model.parameters.len());
        for (column, twist) in columns {
            add_to_column(&mut gap, 0, *column, &-twist.translation_m);
        }
        for (column, twist) in of_other {
            add_to_column(&mut gap, 0, *column, &twist.translation_m);
        }
        let Some((along, link)) = residual.along.zip(link) else { return (residual, gap) };
        let mut row = DMatrix::from_fn(1, gap.ncols(), |_, column| along.dot(&gap.column(column)));
        row[(0, link)] = -1.0;
        (residual, row)
    }
}
