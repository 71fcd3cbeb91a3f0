//! Chain and frames together: predicted tip, residual, exact Jacobian.

mod calibrated_urdf;
mod carried;
mod declared;
mod effects;
mod features;
mod linearisation;
mod measured;
mod measurement;
mod predicting;
mod prediction;
mod scopes;

use crate::effects::{Declared, EffectSpec, Effects, NominalArm};
use crate::error::most_similar;
use crate::fixed::{FixedPlace, Length, Standing};
use crate::measurements::find_measurement;
use crate::rigid::Rigid;
use crate::segment::{Geometry, Segment};
use crate::tree::{Feature, Tree};
use crate::{ArmFrames, Chain, Frame, Frames, Marker, Masses, ModelError};
use armcal_core::{Against, FeatureId, Observation, Parameter, Pose, Reference};
pub use calibrated_urdf::CalibratedOrigins;
pub use carried::{CarriedMotions, CarriedPoint};
pub use effects::least_dwells;
pub use features::LinkFrame;
pub use scopes::RecordingStart;
use scopes::{OwnAsked, Scopes};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A robot in its surroundings.
///
/// The parameter vector `p` has one entry for each of [`Model::parameters`], in that order: the chain's,
/// then bases, tips, markers and boards, fixed places and lengths, then those of the effects; every method that takes it expects
/// that length. Joint vectors are in the order of [`Chain::joint_names`], [rad] (prismatic: [m]). What an observation lacks (a joint reading, a
/// board) makes its numbers NaN; [`Model::check`] turns that into an error beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    chain: Chain,
    parameters: Vec<Parameter>,
    /// The bases, one an arm; the segments of the chain; tips and markers.
    tree: Tree,
    /// What can be measured: the tip of each arm first, then the markers.
    features: Vec<Feature>,
    /// Points and planes that stand in the world and are measured against.
    fixed: Vec<Standing>,
    /// Indices of the lengths that distances count from.
    lengths: Vec<usize>,
    /// World to board, by recording.
    boards: BTreeMap<usize, Segment>,
    /// What makes the arm differ from the path; nothing, where it is rigid.
    effects: Option<Effects>,
    /// What is known of the parameters of effects, of those that are not in the model too.
    declared: Arc<[Declared]>,
    /// What single recordings have for themselves beside their boards; nothing, where all of them know all.
    scopes: Option<Arc<Scopes>>,
    /// The same, as long as effects are still to be placed.
    own_asked: Option<Arc<OwnAsked>>,
}

impl Model {
    /// Puts a chain between its frames.
    ///
    /// Errors when two parameters share a name, a marker is on a link that the chain does not have, or a frame's pose or standard
    /// error is not a number.
    pub fn new(chain: Chain, frames: Frames) -> Result<Model, ModelError> {
        let Frames { base, tip, markers, boards } = frames;
        Model::between(chain, vec![ArmFrames { base, tip }], markers, boards)
    }

    /// Puts joined chains ([`Chain::joined`]), each between its own frames, into one world.
    ///
    /// # Errors
    /// As for one arm; a number of frames that is not that of the arms, bases that are all free.
    pub fn of_arms(chain: Chain, arms: Vec<ArmFrames>) -> Result<Model, ModelError> {
        Model::between(chain, arms, Vec::new(), Vec::new())
    }

    /// The same with fixed places to measure against, and lengths that distances count from. Before any effect.
    ///
    /// # Errors
    /// Two of one name; a pose or a length that is none.
    pub fn against(mut self, places: &[FixedPlace], lengths: &[Length]) -> Result<Model, ModelError> {
        for place in places {
            let (standing, own) = place.standing(self.parameters.len())?;
            self.fixed.push(standing);
            self.parameters.extend(own);
        }
        for length in lengths {
            self.lengths.push(self.parameters.len());
            self.parameters.push(length.parameter()?);
        }
        check_names(&self.parameters)?;
        Ok(self)
    }

    fn between(
        chain: Chain,
        arms: Vec<ArmFrames>,
        markers: Vec<Marker>,
        boards: Vec<Frame>,
    ) -> Result<Model, ModelError> {
        if arms.len() != chain.bases() {
            let problem = format!("{} arms have frames, there are {}", arms.len(), chain.bases());
            return Err(ModelError::BadArms { problem });
        }
        let mut parameters = chain.parameters.clone();
        let mut place = |frame: &Frame| -> Result<Segment, ModelError> {
            let (segment, own) = frame.segment(parameters.len())?;
            parameters.extend(own);
            Ok(segment)
        };
        let bases = arms.iter().map(|arm| place(&arm.base)).collect::<Result<Vec<_>, _>>()?;
        let mut hung = Vec::with_capacity(arms.len() + markers.len());
        for (ArmFrames { tip, .. }, end) in arms.iter().zip(chain.ends()) {
            hung.push((tip.name.clone(), None, end, place(tip)?));
        }
        for marker in &markers {
            let (name, link) = (marker.frame.name.clone(), Some(marker.link.clone()));
            hung.push((name, link, chain.end_of(&marker.link)?, place(&marker.frame)?));
        }
        let boards =
            boards.iter().map(place).collect::<Result<Vec<_>, _>>()?.into_iter().enumerate().collect();
        check_bases(&bases, &parameters)?;
        check_names(&parameters)?;
        let mut tree = chain.on(bases);
        let mut features = Vec::with_capacity(hung.len());
        for (name, link, end, segment) in hung {
            tree.0.push(Segment { parent: Some(end), ..segment });
            features.push(Feature { name, link, route: tree.route(tree.0.len() - 1) });
        }
        Ok(Model {
            chain,
            parameters,
            tree,
            features,
            fixed: Vec::new(),
            lengths: Vec::new(),
            boards,
            effects: None,
            declared: Arc::default(),
            scopes: None,
            own_asked: None,
        })
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
        self.refresh();
        Ok(matching.len())
    }

    /// Moves the start of a recording's board frame (nominal value and centre of the prior) to another
    /// world_from_board, such as the one the association found. Returns whether the recording has a board.
    pub fn set_board_start(&mut self, recording: usize, board_in_world: Pose) -> bool {
        let Some(board) = self.boards.get_mut(&recording) else { return false };
        set_start_pose(board, &mut self.parameters, board_in_world);
        self.refresh();
        true
    }

    /// Moves the start of the base frame of an arm (nominal value and centre of the prior) to another world_from_base, such as
    /// the one that brings the tips of two arms together. Effects that are placed already keep the old one.
    pub fn set_base_start(&mut self, arm: usize, base_in_world: Pose) {
        set_start_pose(&mut self.tree.0[arm], &mut self.parameters, base_in_world);
        self.refresh();
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
            let other = match o.against() {
                Some(Against::Feature(to)) => to,
                _ => o.feature,
            };
            let features = self.features.len();
            if let Some(unknown) = [o.feature, other].into_iter().find(|feature| feature.0 >= features) {
                return Err(ModelError::NoFeature { dwell: o.dwell, feature: unknown.0, features });
            }
            self.check_against(o)?;
            if let Some(load) = o.more_loads.iter().find(|load| load.at.0 >= features) {
                return Err(ModelError::NoFeature { dwell: o.dwell, feature: load.at.0, features });
            }
            if let Some(recordings) = self.recordings().filter(|recordings| o.dwell.recording >= *recordings)
            {
                return Err(ModelError::NoRecording { dwell: o.dwell, recordings });
            }
            if o.cavity().is_some() && !self.boards.contains_key(&o.dwell.recording) {
                return Err(ModelError::NoBoard { dwell: o.dwell });
            }
        }
        Ok(())
    }

    /// That there is what an observation was measured against.
    fn check_against(&self, o: &Observation) -> Result<(), ModelError> {
        let unknown = |what, index, known| Err(ModelError::NoPlace { dwell: o.dwell, what, index, known });
        if let Reference::Number { kind, .. } = &o.reference
            && find_measurement(kind).is_none()
        {
            return Err(ModelError::UnknownMeasurement { dwell: o.dwell, kind: kind.to_string() });
        }
        match (o.against(), o.length()) {
            (Some(Against::Fixed(place)), _) if place >= self.fixed.len() => {
                unknown("place", place, self.fixed.len())
            }
            (_, Some(length)) if length >= self.lengths.len() => {
                unknown("length", length, self.lengths.len())
            }
            _ => Ok(()),
        }
    }

    /// The tip in the base frame.
    pub fn tip_in_base(&self, p: &[f64], joint_rad: &[f64]) -> Pose {
        self.feature_in_base(p, FeatureId::TIP, joint_rad)
    }

    /// world_from_base; of several arms the first one's.
    pub fn base_in_world(&self, p: &[f64]) -> Pose {
        self.arm_base_in_world(p, 0)
    }

    /// world_from_base of one of several arms.
    pub fn arm_base_in_world(&self, p: &[f64], arm: usize) -> Pose {
        Pose::from(&self.tree.0[arm].transform(p, &[]))
    }

    /// Indices of the parameters of an arm's base.
    pub fn base_parameters(&self, arm: usize) -> std::ops::Range<usize> {
        self.tree.0[arm].parameters.clone()
    }

    /// last link_from_tip.
    pub fn tip_in_last_link(&self, p: &[f64]) -> Pose {
        self.feature_in_link(p, FeatureId::TIP)
    }

    /// Number of boards: one a recording, or none.
    pub fn boards(&self) -> usize {
        self.boards.len()
    }

    /// world_from_board of a recording, if it has a board.
    pub fn board_in_world(&self, p: &[f64], recording: usize) -> Option<Pose> {
        self.boards.get(&recording).map(|board| Pose::from(&board.transform(p, &[])))
    }

    /// Joints that may rest anywhere in the gaps of their drives, and the variance of where they do [rad^2]
    /// (prismatic: [m^2]): noise that no reading shows.
    pub fn slack(&self, p: &[f64], o: &Observation) -> Vec<(usize, f64)> {
        if let Some((model, p)) = self.seen(p, o) {
            return model.slack(&p, o);
        }
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

    /// Every length of the chain and of the tips that is not zero: index in the parameter vector, nominal [m].
    pub fn lengths_m(&self) -> Vec<(usize, f64)> {
        self.nominal_arm().lengths_m()
    }

    /// What effects are placed on.
    pub(crate) fn nominal_arm(&self) -> NominalArm<'_> {
        let Model { chain, parameters, tree, features, boards, .. } = self;
        NominalArm { chain, parameters, tree, features, boards }
    }

    /// The tree of the arm.
    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Where the masses of all links come from; none where some weigh as in the file and others as much as they are long.
    pub fn masses(&self) -> Option<Masses> {
        let declared = self.nominal_arm().zero_pose().declared;
        match (declared.contains(&true), declared.contains(&false)) {
            (true, true) => None,
            (true, false) => Some(Masses::Urdf),
            (false, _) => Some(Masses::Uniform),
        }
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
                nearest: most_similar(name, names()),
            });
        }
        Ok(matching)
    }
}

/// Lets a frame with six parameters start at another pose.
fn set_start_pose(frame: &mut Segment, parameters: &mut [Parameter], pose: Pose) {
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

/// Refuses arms that nothing holds in the world; `parameters` are those of the frames too.
fn check_bases(bases: &[Segment], parameters: &[Parameter]) -> Result<(), ModelError> {
    let is_free = |base: &&Segment| parameters[base.parameters.clone()].iter().any(|p| p.free);
    let name = |base: &Segment| base.frame.clone().unwrap_or_default().trim_end_matches(".base").to_owned();
    let free: Vec<String> = bases.iter().filter(is_free).map(name).collect();
    if bases.len() < 2 || free.len() < bases.len() {
        return Ok(());
    }
    let problem = format!(
        "the bases of {} are both free, so that nothing holds the pair in place; make one of them pose = \"given\"",
        free.join(" and ")
    );
    Err(ModelError::BadArms { problem })
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
