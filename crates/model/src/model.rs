//! Chain and frames together: predicted tip, residual, exact Jacobian.

mod features;
mod linearisation;

use crate::effects::{Declared, EffectSpec, Effects, NominalPose, PlacedEffect, Session};
use crate::error::nearest;
use crate::residual::{ModelResidual, add_to_column, rotation_error_rad, rotation_error_rate};
use crate::rigid::Rigid;
use crate::segment::{Geometry, Segment};
use crate::tree::{SegmentId, Tree};
use crate::{Chain, Frames, ModelError};
use armcal_core::{FeatureId, Observation, Parameter, Pose, Reference, Unit};
use features::Feature;
use linearisation::Linearisation;
use nalgebra::{DMatrix, Matrix3xX, UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A robot in its surroundings.
///
/// The parameter vector `p` has one entry for each of [`Model::parameters`], in that order: the chain's,
/// then base, tip and boards, then those of the effects; every method that takes it expects that length. Joint vectors are in the
/// order of [`Chain::joint_names`], [rad] (prismatic: [m]). What an observation lacks (a joint reading, a
/// board) makes its numbers NaN; [`Model::check`] turns that into an error beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    chain: Chain,
    parameters: Vec<Parameter>,
    /// Base, the segments of the chain, tip.
    tree: Tree,
    /// What can be measured of the arm: the tip first, then the markers.
    features: Vec<Feature>,
    /// World to board, by recording.
    boards: BTreeMap<usize, Segment>,
    /// What makes the arm differ from the path; nothing, where it is rigid.
    effects: Option<Effects>,
    /// What is known of the parameters of effects, of those that are not in the model too.
    pub(crate) declared: Arc<[Declared]>,
}

/// The segment that ends at the base: the root of the tree.
const BASE: SegmentId = 0;

/// What is measured and what is predicted of one observation.
struct Sides {
    measured_m: Vector3<f64>,
    predicted: Rigid<f64>,
}

impl Model {
    /// Puts a chain between its frames.
    ///
    /// Errors when two parameters share a name, a marker is on a link that the chain does not have, or a frame's pose or standard
    /// error is not a number.
    pub fn new(chain: Chain, frames: Frames) -> Result<Model, ModelError> {
        let mut parameters = chain.parameters.clone();
        let mut place = |frame: &crate::Frame| -> Result<Segment, ModelError> {
            let (segment, own) = frame.segment(parameters.len())?;
            parameters.extend(own);
            Ok(segment)
        };
        let base = place(&frames.base)?;
        let mut hung = vec![(frames.tip.name.clone(), None, chain.end(), place(&frames.tip)?)];
        for marker in &frames.markers {
            let (name, link) = (marker.frame.name.clone(), Some(marker.link.clone()));
            hung.push((name, link, chain.end_of(&marker.link)?, place(&marker.frame)?));
        }
        let boards =
            frames.boards.iter().map(place).collect::<Result<Vec<_>, _>>()?.into_iter().enumerate().collect();
        check_names(&parameters)?;
        let mut tree = chain.on(base);
        let mut features = Vec::with_capacity(hung.len());
        for (name, link, end, segment) in hung {
            tree.0.push(Segment { parent: Some(end), ..segment });
            features.push(Feature { name, link, route: tree.route(tree.0.len() - 1) });
        }
        Ok(Model { chain, parameters, tree, features, boards, effects: None, declared: Arc::default() })
    }

    /// The arm.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Every parameter, in the order of the parameter vector.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The parameter vector before calibration.
    pub fn nominal(&self) -> Vec<f64> {
        self.parameters.iter().map(|parameter| parameter.nominal).collect()
    }

    /// Index of a parameter by its exact name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|parameter| parameter.name == name)
    }

    /// Length of the joint vector.
    pub fn joint_count(&self) -> usize {
        self.chain.joint_names.len()
    }

    /// Overrides parameters by exact name or by glob (`joint*.alpha`, `board.*`); returns how many matched.
    ///
    /// `edit` may change value, bounds, prior and freedom. Errors when nothing matches (naming the nearest
    /// parameter) or when an edited parameter could not be fitted; the model is unchanged then.
    pub fn set_parameter(
        &mut self,
        name: &str,
        mut edit: impl FnMut(&mut Parameter),
    ) -> Result<usize, ModelError> {
        let matching = self.matching(name)?;
        let mut edited = self.parameters.clone();
        for &index in &matching {
            edit(&mut edited[index]);
            edited[index].name.clone_from(&self.parameters[index].name);
            check_parameter(&edited[index])?;
        }
        self.parameters = edited;
        Ok(matching.len())
    }

    /// Moves the start of a recording's board frame (nominal value and centre of the prior) to another
    /// world_from_board, such as the one the association found. Returns whether the recording has a board.
    pub fn set_board_start(&mut self, recording: usize, board_in_world: Pose) -> bool {
        let Some(board) = self.boards.get_mut(&recording) else { return false };
        restart(board, &mut self.parameters, board_in_world);
        true
    }

    /// Moves the start of the base frame (nominal value and centre of the prior) to another world_from_base, such as the
    /// one that brings the tips of two arms together. Effects that are placed already keep the old one.
    pub fn set_base_start(&mut self, base_in_world: Pose) {
        restart(&mut self.tree.0[BASE], &mut self.parameters, base_in_world);
    }

    /// The same model for the observations of one recording, without the boards of the others; and the index that each
    /// of its parameters has in this model. With many boards it is evaluated in the time that one takes.
    pub fn in_recording(&self, recording: usize) -> (Model, Vec<usize>) {
        let first = self.tree.0.iter().map(|segment| segment.parameters.end).max().unwrap_or(0);
        let own = self.boards.get(&recording).map_or(first..first, |board| board.parameters.clone());
        let behind = first + self.boards.values().map(|board| board.parameters.len()).sum::<usize>();
        let index: Vec<usize> = (0..first).chain(own.clone()).chain(behind..self.parameters.len()).collect();
        let end = first + own.len();
        let board = |board: &Segment| Segment { parameters: first..end, ..board.clone() };
        let model = Model {
            chain: self.chain.clone(),
            parameters: index.iter().map(|&i| self.parameters[i].clone()).collect(),
            tree: self.tree.clone(),
            features: self.features.clone(),
            boards: self.boards.get(&recording).map(|own| (recording, board(own))).into_iter().collect(),
            effects: self.effects.as_ref().map(|e| e.moved(behind - end, self, index.len())),
            declared: self.declared.clone(),
        };
        (model, index)
    }

    /// Indices of the parameters of a recording's board; none where it has no board.
    pub fn board_parameters(&self, recording: usize) -> std::ops::Range<usize> {
        self.boards.get(&recording).map_or(0..0, |board| board.parameters.clone())
    }

    /// Checks that every observation has a reading for each joint, is of a feature of the arm, and has a board where it needs one.
    pub fn check(&self, observations: &[Observation]) -> Result<(), ModelError> {
        for o in observations {
            let (actual, expected) = (o.joint_rad.len(), self.joint_count());
            if actual != expected {
                return Err(ModelError::JointCount { dwell: o.dwell, actual, expected });
            }
            if o.feature.0 >= self.features.len() {
                let (feature, features) = (o.feature.0, self.features.len());
                return Err(ModelError::NoFeature { dwell: o.dwell, feature, features });
            }
            if o.cavity().is_some() && !self.boards.contains_key(&o.dwell.recording) {
                return Err(ModelError::NoBoard { dwell: o.dwell });
            }
        }
        Ok(())
    }

    /// The tip in the base frame.
    pub fn tip_in_base(&self, p: &[f64], joint_rad: &[f64]) -> Pose {
        self.feature_in_base(p, FeatureId::TIP, joint_rad)
    }

    /// Every frame of the arm in the base frame, for drawing: base, the end of each segment (a DH row, or
    /// a link of the URDF, fixed ones included), tip.
    pub fn link_frames_in_base(&self, p: &[f64], joint_rad: &[f64]) -> Vec<(String, Pose)> {
        let mut ends: Vec<Rigid<f64>> = Vec::with_capacity(self.tree.0.len());
        let mut frames = Vec::with_capacity(self.tree.0.len());
        for segment in &self.tree.0 {
            // In the base frame the base is where it is.
            let end = match segment.parent {
                None => Rigid::identity(),
                Some(parent) => ends[parent].then(&segment.transform(p, joint_rad)),
            };
            frames.extend(segment.frame.iter().map(|name| (name.clone(), Pose::from(&end))));
            ends.push(end);
        }
        frames
    }

    /// world_from_base.
    pub fn base_in_world(&self, p: &[f64]) -> Pose {
        Pose::from(&self.tree.0[BASE].transform(p, &[]))
    }

    /// last link_from_tip.
    pub fn tip_in_last_link(&self, p: &[f64]) -> Pose {
        self.feature_in_link(p, FeatureId::TIP)
    }

    /// Whether the pose of a recording's board is found by the fit, with nothing else known of it.
    pub(crate) fn board_is_estimated(&self, recording: usize) -> bool {
        let own = &self.parameters[self.board_parameters(recording)];
        own.iter().any(|p| p.free && p.prior_sigma.is_none())
    }

    /// world_from_board of a recording, if it has a board.
    pub fn board_in_world(&self, p: &[f64], recording: usize) -> Option<Pose> {
        self.boards.get(&recording).map(|board| Pose::from(&board.transform(p, &[])))
    }

    /// Where the tip was, in the world: as the sensor saw it, or the cavity of the board [m].
    pub fn measured_tip_in_world(&self, p: &[f64], o: &Observation) -> Vector3<f64> {
        // Where the arm comes into it only through what effects do to the seat, it need not be followed.
        match (&o.reference, &self.effects) {
            (Reference::Tracked { position_m, .. }, _) => *position_m,
            (Reference::Seated { .. }, None) => {
                let board = self.board_under(o).map(|board| board.transform(p, &[]));
                measured_m(o, board.as_ref(), &seated_m(o))
            }
            (Reference::Seated { .. }, Some(_)) => self.sides(p, o).measured_m,
        }
    }

    /// Where the model puts what the observation is of, its tip or a marker, in the world [m], effects included.
    pub fn predicted_tip_in_world(&self, p: &[f64], o: &Observation) -> Vector3<f64> {
        self.sides(p, o).predicted.translation_m
    }

    /// `measured - predicted`: 3 rows of position [m], and 3 of rotation [rad] if the observation has an orientation.
    pub fn residual(&self, p: &[f64], o: &Observation) -> ModelResidual {
        self.sides(p, o).residual(o)
    }

    /// The residual and d residual / d p: 3 or 6 rows, one column for every parameter, free or not. Exact.
    pub fn residual_with_jacobian(&self, p: &[f64], o: &Observation) -> (ModelResidual, DMatrix<f64>) {
        Linearisation::of(self, p, &[o]).residual_with_jacobian(o)
    }

    /// [`Model::residual_with_jacobian`] of many observations at the same parameters, in their order: what is alike for
    /// all of them is worked out once.
    pub fn residuals_with_jacobians(
        &self,
        p: &[f64],
        observations: &[&Observation],
    ) -> Vec<(ModelResidual, DMatrix<f64>)> {
        let at = Linearisation::of(self, p, observations);
        observations.iter().map(|o| at.residual_with_jacobian(o)).collect()
    }

    /// d predicted tip / d joint reading [m/rad] (prismatic: [m/m]), one column a joint, in the world: carries the
    /// encoders' noise to the tip.
    pub fn joint_jacobian(&self, p: &[f64], o: &Observation) -> Matrix3xX<f64> {
        let mut jacobian = Matrix3xX::zeros(self.joint_count());
        for (column, twist) in self.joint_twists(p, o.feature, o) {
            // A reading that moves two joints on the way has two parts.
            let mut own = jacobian.column_mut(column);
            own += twist.translation_m;
        }
        jacobian
    }

    /// The residual and d residual / d joint reading: 3 or 6 rows, one column a joint. Inverse kinematics iterates on
    /// it. What drives the effects is held, so that their own slope over the joint angle, a few per cent, is left out.
    pub fn residual_with_joint_jacobian(&self, p: &[f64], o: &Observation) -> (ModelResidual, DMatrix<f64>) {
        let residual = self.residual(p, o);
        let mut jacobian = DMatrix::zeros(residual.len(), self.joint_count());
        let rate = residual.rotation_rad.as_ref().map(rotation_error_rate);
        for (column, twist) in self.joint_twists(p, o.feature, o) {
            add_to_column(&mut jacobian, 0, column, &-twist.translation_m);
            if let Some(rate) = &rate {
                add_to_column(&mut jacobian, 3, column, &(rate * twist.rotation_rad));
            }
        }
        (residual, jacobian)
    }

    /// Joints that may rest anywhere in the gaps of their drives, and the variance of where they do [rad^2]
    /// (prismatic: [m^2]): noise that no reading shows.
    pub fn slack(&self, p: &[f64], o: &Observation) -> Vec<(usize, f64)> {
        let seated = o.cavity().is_some();
        self.effects.as_ref().map_or_else(Vec::new, |effects| effects.slack(p, o.dwell, seated))
    }

    /// Effects that are a gap in the drive of a joint: which, the joint, and how wide it is at these parameters [rad]
    /// (prismatic: [m]).
    pub fn gaps(&self, p: &[f64]) -> Vec<(EffectSpec, usize, f64)> {
        let all = self.effects.iter().flat_map(|effects| effects.gaps(p));
        all.map(|(spec, joint, width)| (spec.clone(), joint, width)).collect()
    }

    /// Whether [`Model::slack`] depends on what is estimated.
    pub fn has_gaps(&self) -> bool {
        self.effects.as_ref().is_some_and(|effects| effects.has_gaps(&self.nominal()))
    }

    /// Every length of the chain and of the tip that is not zero: index in the parameter vector, nominal [m].
    pub fn lengths_m(&self) -> Vec<(usize, f64)> {
        let chain = 0..self.chain.parameters().len();
        let all = chain.chain(self.tip_segment().parameters.clone());
        all.map(|index| (index, &self.parameters[index]))
            .filter(|(_, p)| p.unit == Unit::Metre && p.nominal != 0.0)
            .map(|(index, p)| (index, p.nominal))
            .collect()
    }

    pub(crate) fn tip_segment(&self) -> &Segment {
        &self.tree.0[self.tip_end()]
    }

    /// The tree of the arm.
    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The segment that ends at the tip.
    pub(crate) fn tip_end(&self) -> SegmentId {
        self.route(FeatureId::TIP).last().copied().unwrap_or(BASE)
    }

    /// The segment that another hangs on.
    pub(crate) fn segment_before(&self, segment: SegmentId) -> Option<&Segment> {
        Some(&self.tree.0[self.tree.0.get(segment)?.parent?])
    }

    /// The effects, if there are any.
    pub(crate) fn placed_effects(&self) -> Option<&Effects> {
        self.effects.as_ref()
    }

    /// The parameters of the tree (chain, base, tip), which effects may act on.
    pub(crate) fn is_on_path(&self, index: usize) -> bool {
        self.tree.0.iter().any(|segment| segment.parameters.contains(&index))
    }

    /// The nominal arm in a pose.
    pub(crate) fn nominal_pose(&self, nominal: &[f64], joint_rad: &[f64]) -> NominalPose {
        NominalPose::of(&self.tree, self.tip_end(), nominal, joint_rad)
    }

    /// The nominal arm with all joints at zero.
    pub(crate) fn zero_pose(&self) -> NominalPose {
        self.nominal_pose(&self.nominal(), &vec![0.0; self.joint_count()])
    }

    /// Whether the file of the arm tells what every link weighs; else effects take 2.5 kg a metre.
    pub fn has_link_masses(&self) -> bool {
        self.zero_pose().declared
    }

    /// The same model with these effects; `parameters` are all of its parameters.
    pub(crate) fn with_placed(
        &self,
        placed: Vec<PlacedEffect>,
        session: Session,
        parameters: Vec<Parameter>,
    ) -> Result<Model, ModelError> {
        check_names(&parameters)?;
        let effects = Some(Effects::new(placed, session.into(), self, parameters.len()));
        Ok(Model { parameters, effects, ..self.clone() })
    }

    fn sides(&self, p: &[f64], o: &Observation) -> Sides {
        let (predicted, in_board_m) = match &self.effects {
            None => (self.tree.follow(self.route(o.feature), p, &o.joint_rad), seated_m(o)),
            Some(effects) => {
                let at = effects.evaluate(p, o.feature, &effects.drivers(self, o));
                (at.tip, at.in_board_m)
            }
        };
        let board = self.board_under(o).map(|board| board.transform(p, &[]));
        Sides { measured_m: measured_m(o, board.as_ref(), &in_board_m), predicted }
    }

    /// The board that the tip is seated in.
    fn board_under(&self, o: &Observation) -> Option<&Segment> {
        self.boards.get(&o.dwell.recording).filter(|_| o.cavity().is_some())
    }

    /// Indices of the parameters that an exact name or a glob means (`joint*.alpha`); never none.
    ///
    /// Errors when nothing matches, naming the nearest parameter.
    pub fn matching(&self, name: &str) -> Result<Vec<usize>, ModelError> {
        if let Some(index) = self.index(name) {
            return Ok(vec![index]);
        }
        let pattern = glob::Pattern::new(name)
            .map_err(|cause| ModelError::BadPattern { pattern: name.to_owned(), cause })?;
        let names = || self.parameters.iter().map(|parameter| parameter.name.as_str());
        let matching: Vec<usize> =
            names().enumerate().filter(|(_, n)| pattern.matches(n)).map(|(index, _)| index).collect();
        if matching.is_empty() {
            return Err(ModelError::UnknownParameter {
                name: name.to_owned(),
                nearest: nearest(name, names()),
            });
        }
        Ok(matching)
    }
}

impl Sides {
    fn residual(&self, o: &Observation) -> ModelResidual {
        let position_m = self.measured_m - self.predicted.translation_m;
        let rotation_rad = match &o.reference {
            Reference::Tracked { orientation: Some(measured), .. } => {
                let predicted: UnitQuaternion<f64> = Pose::from(&self.predicted).rotation;
                Some(rotation_error_rad(measured, &predicted))
            }
            _ => None,
        };
        ModelResidual { position_m, rotation_rad }
    }
}

/// Where the tip was, in the world [m]; NaN in a cavity of a board that the model does not have.
fn measured_m(o: &Observation, board: Option<&Rigid<f64>>, in_board_m: &Vector3<f64>) -> Vector3<f64> {
    match &o.reference {
        Reference::Tracked { position_m, .. } => *position_m,
        Reference::Seated { .. } => board.map_or(Vector3::repeat(f64::NAN), |board| board.point(in_board_m)),
    }
}

/// The seated point as the board's file gives it [m]; zero for a tracked tip.
fn seated_m(o: &Observation) -> Vector3<f64> {
    match &o.reference {
        Reference::Seated { in_board_m, .. } => *in_board_m,
        Reference::Tracked { .. } => Vector3::zeros(),
    }
}

/// Lets a frame with six parameters start at another pose.
fn restart(frame: &mut Segment, parameters: &mut [Parameter], pose: Pose) {
    if let Geometry::Origin { nominal, .. } = &mut frame.geometry {
        *nominal = Rigid::from(&pose);
    }
    let at = pose.translation.vector;
    // Position, then the rotation vector, which is zero at nominal.
    let start = [at.x, at.y, at.z, 0.0, 0.0, 0.0];
    for (parameter, value) in parameters[frame.parameters.clone()].iter_mut().zip(start) {
        parameter.nominal = value;
    }
}

fn check_names(parameters: &[Parameter]) -> Result<(), ModelError> {
    let mut seen = BTreeSet::new();
    match parameters.iter().find(|parameter| !seen.insert(&parameter.name)) {
        Some(twice) => Err(ModelError::DuplicateParameter { name: twice.name.clone() }),
        None => Ok(()),
    }
}

fn check_parameter(parameter: &Parameter) -> Result<(), ModelError> {
    let bad = |problem| Err(ModelError::BadParameter { name: parameter.name.clone(), problem });
    if !parameter.nominal.is_finite() {
        return bad("its nominal value is not a finite number");
    }
    if !(parameter.lower <= parameter.nominal && parameter.nominal <= parameter.upper) {
        return bad("its nominal value must lie between its bounds");
    }
    if parameter.prior_sigma.is_some_and(|sigma| !(sigma > 0.0 && sigma.is_finite())) {
        return bad(
            "its prior standard deviation must be a positive number; fix the parameter instead of zero",
        );
    }
    Ok(())
}
