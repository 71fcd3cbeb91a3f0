//! A model at one parameter vector: what it predicts of as many observations as are asked for.

use super::Model;
use super::measured::{measured_m, seated_m};
use super::measurement::Sides;
use crate::residual::ModelResidual;
use crate::rigid::Rigid;
use crate::tree::TreeAt;
use armcal_core::{FeatureId, Observation};
use std::collections::BTreeMap;

/// What is alike for all observations is worked out once.
pub(super) struct Predicting<'a> {
    model: &'a Model,
    p: &'a [f64],
    tree: TreeAt<'a>,
    /// The boards that something is seated in, by recording.
    boards: BTreeMap<usize, Rigid<f64>>,
}

impl<'a> Predicting<'a> {
    /// For these observations, of a model as their recording knows it.
    pub fn of(model: &'a Model, p: &'a [f64], observations: &[&Observation]) -> Predicting<'a> {
        let tree = match &model.effects {
            None => TreeAt::predicting(&model.tree, p),
            Some(effects) => effects.predicting(p),
        };
        let mut boards = BTreeMap::new();
        for o in observations {
            if let Some(board) = model.board_under(o) {
                boards.entry(o.dwell.recording).or_insert_with(|| board.transform(p, &[]));
            }
        }
        Predicting { model, p, tree, boards }
    }

    /// What one of them compares.
    pub fn sides(&self, o: &Observation) -> Sides {
        let (model, p) = (self.model, self.p);
        let effects = model.effects.as_ref().map(|effects| (effects, model.drivers(&effects.session, o)));
        let at = |feature: FeatureId| match &effects {
            Some((effects, drivers)) => {
                let at = effects.evaluate(&self.tree, p, feature, drivers);
                (at.tip, at.in_board_m)
            }
            None => (self.tree.follow(model.route(feature), p, &o.joint_rad), seated_m(o)),
        };
        let (predicted, in_board_m) = at(o.feature);
        match model.other(p, o, &|feature| at(feature).0) {
            Some(other) => Sides { other, predicted, number: model.number_of(p, o) },
            None => {
                let board = model.board_under(o).and_then(|_| self.boards.get(&o.dwell.recording));
                Sides::with_point(measured_m(o, board, &in_board_m), predicted)
            }
        }
    }

    /// The residual of one of them; rotations only where `turns` are asked for.
    pub fn residual(&self, o: &Observation, turns: bool) -> ModelResidual {
        self.sides(o).residual(o, turns)
    }
}
