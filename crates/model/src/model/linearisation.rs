//! A model at one parameter vector: residual and exact Jacobian of as many observations as are asked for.

use super::Model;
use super::measured::{measured_m, seated_m};
use super::measurement::Sides;
use crate::effects::Effects;
use crate::residual::{ModelResidual, add_to_column, rotation_error_rate};
use crate::segment::{LinearisedSegment, Segment};
use crate::tree::{Asked, TreeAt};
use armcal_core::{Against, FeatureId, Observation};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// What is alike for all observations is worked out once.
pub(crate) struct Linearisation<'a> {
    model: &'a Model,
    p: &'a [f64],
    arm: Arm<'a>,
    /// The boards that something is seated in, by recording.
    boards: BTreeMap<usize, LinearisedSegment>,
    /// Whether rows of orientation are asked for.
    turns: bool,
}

enum Arm<'a> {
    Rigid(TreeAt<'a>),
    /// With every pose other parameters.
    Deformed(&'a Effects, TreeAt<'a>),
}

impl<'a> Linearisation<'a> {
    /// For these observations and the parameters `asked` for: columns of others may be zero. Rows of orientation are there
    /// where they are seen and `turns` are asked for.
    pub fn of(
        model: &'a Model,
        p: &'a [f64],
        observations: &[&Observation],
        asked: &Asked<'_>,
        turns: bool,
    ) -> Linearisation<'a> {
        let arm = match &model.effects {
            None => Arm::Rigid(TreeAt::of(&model.tree, p, Some(asked))),
            Some(effects) => Arm::Deformed(effects, effects.tree_at(p)),
        };
        let seated = observations.iter().filter_map(|o| Some((o.dwell.recording, model.board_under(o)?)));
        let boards: BTreeMap<usize, &Segment> = seated.collect();
        let boards = boards.into_iter().map(|(recording, board)| (recording, board.linearised(p, &[])));
        Linearisation { model, p, arm, boards: boards.collect(), turns }
    }

    /// The residual of one of them and d residual / d p.
    pub fn residual_with_jacobian(&self, o: &Observation) -> (ModelResidual, DMatrix<f64>) {
        let drivers = match &self.arm {
            Arm::Rigid(_) => None,
            Arm::Deformed(effects, _) => Some(self.model.drivers(&effects.session, o)),
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
        if let Some(against) = o.against() {
            let (other, of_other) = match against {
                Against::Feature(to) => {
                    let (other, _, of_other, _) = at(to);
                    (other, of_other)
                }
                Against::Fixed(place) => self.model.linearised_place(self.p, place),
            };
            let sides = Sides { other, predicted, number: self.model.number_of(self.p, o) };
            return sides.linearised(o, &columns, &of_other, self.model.parameters.len());
        }
        let board = self.model.board_under(o).zip(self.boards.get(&o.dwell.recording));
        let measured_m = measured_m(o, board.map(|(_, at)| &at.transform), &in_board_m);
        let residual = Sides::with_point(measured_m, predicted).residual(o, self.turns);
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
}
