//! What each recording has for itself: the pose of its board, and copies of parameters that others share.
//!
//! A copy stands behind the parameters of the model it is made in and is named `<recording>.<parameter>`. The original stays
//! where it was and is fixed. Everything that is asked of an observation is answered by the model as its recording knows it:
//! without the boards and copies of the others, and with its own copies in the place of the originals.

use super::{Model, check_names, set_start_pose};
use crate::ModelError;
use crate::segment::Segment;
use armcal_core::{Observation, Parameter, Pose};
use nalgebra::DMatrix;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// A recording that may have parameters of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingStart {
    /// Its name: prefix of its own parameters.
    pub name: String,
    /// Where a base of its own starts (world_from_base); at the model's where nothing is said.
    pub base_in_world: Option<Pose>,
}

/// What [`Model::with_own`] is to be asked.
#[derive(Debug, PartialEq)]
pub(super) struct OwnAsked {
    recordings: Vec<RecordingStart>,
    own: Vec<String>,
}

/// Which parameters are copied, for which recordings.
#[derive(Debug)]
pub(super) struct Scopes {
    bases: Vec<Option<Pose>>,
    /// The originals, rising.
    own: Vec<usize>,
    /// The first copy; the copies of a recording stand behind each other, in the order of the originals.
    first: usize,
    /// The model as each recording knows it, made when it is first asked for.
    views: Vec<OnceLock<View>>,
}

/// The model as one recording knows it.
#[derive(Debug)]
struct View {
    model: Model,
    /// Index of each of its parameters in the vector of all.
    index: Vec<usize>,
}

impl PartialEq for Scopes {
    /// Views follow from the rest.
    fn eq(&self, other: &Scopes) -> bool {
        (&self.bases, &self.own, self.first) == (&other.bases, &other.own, other.first)
    }
}

impl Model {
    /// The same model with parameters that each recording has for itself: copies of those that `own` names, by exact name or
    /// glob (`joint1.theta`, `base.*`), each with start, bounds and prior of the original. The recordings are those of the
    /// boards, in their order. Without any name every recording still knows its own board only, which is what a fit to many
    /// of them needs to be told.
    ///
    /// # Errors
    /// A pattern that matches no parameter, one that is fixed, or a board, which is a recording's own anyway; two recordings
    /// of one name.
    pub fn with_own(&self, recordings: &[RecordingStart], own: &[String]) -> Result<Model, ModelError> {
        let own: Vec<usize> = self.own_indices(own)?.into_iter().collect();
        let mut model = self.clone();
        for recording in recordings {
            let mut start = self.parameters.clone();
            if let Some(base_in_world) = recording.base_in_world {
                set_start_pose(&mut self.tree.0[0].clone(), &mut start, base_in_world);
            }
            model.parameters.extend(own.iter().map(|&index| Parameter {
                name: format!("{}.{}", recording.name, start[index].name),
                meaning: format!("{}, in {}", start[index].meaning, recording.name),
                ..start[index].clone()
            }));
        }
        check_names(&model.parameters)?;
        model.own_asked = None;
        for &index in &own {
            let original = &mut model.parameters[index];
            original.free = false;
            original.meaning += " (each recording has its own)";
        }
        let bases = recordings.iter().map(|r| r.base_in_world).collect();
        model.scopes = Some(Arc::new(Scopes::new(bases, own, self.parameters.len())));
        Ok(model)
    }

    /// Asks for [`Model::with_own`] once the effects are placed ([`Model::with_effects`]), whose parameters may be among them.
    pub fn ask_own(&mut self, recordings: Vec<RecordingStart>, own: Vec<String>) {
        self.own_asked = Some(Arc::new(OwnAsked { recordings, own }));
    }

    /// The model with what was asked for.
    pub(super) fn with_own_asked(self) -> Result<Model, ModelError> {
        match self.own_asked.clone() {
            Some(asked) => self.with_own(&asked.recordings, &asked.own),
            None => Ok(self),
        }
    }

    fn own_indices(&self, patterns: &[String]) -> Result<BTreeSet<usize>, ModelError> {
        let mut own = BTreeSet::new();
        for index in
            patterns.iter().map(|pattern| self.matching(pattern)).collect::<Result<Vec<_>, _>>()?.concat()
        {
            let p = &self.parameters[index];
            let bad = |problem| Err(ModelError::BadParameter { name: p.name.clone(), problem });
            if self.scopes.is_some() {
                return bad("recordings have parameters of their own already: name all of them at once");
            }
            if p.name.starts_with("board.") {
                return bad("a board is its recording's own anyway; take it out of per_recording");
            }
            if !p.free {
                return bad("is fixed, so no recording can have its own; free it under [[parameters]]");
            }
            own.insert(index);
        }
        Ok(own)
    }

    /// The model as one recording knows it, with its parameters out of all, `p`. Without [`Model::with_own`] that is the model
    /// itself.
    pub fn in_recording<'a>(&'a self, recording: usize, p: &'a [f64]) -> (&'a Model, Cow<'a, [f64]>) {
        match self.view(recording) {
            Some(view) => (&view.model, Cow::Owned(view.own(p))),
            None => (self, Cow::Borrowed(p)),
        }
    }

    /// Runs of observations that are all seen by the same model and parameters ([`Model::in_recording`]).
    pub fn alike<'a, 'o>(
        &self,
        observations: &'o [&'a Observation],
    ) -> impl Iterator<Item = &'o [&'a Observation]> + use<'a, 'o> {
        let all = self.scopes.is_none();
        observations.chunk_by(move |a, b| all || a.dwell.recording == b.dwell.recording)
    }

    /// Index in the vector of all that each parameter has which a recording knows ([`Model::in_recording`]); `None` where
    /// every recording knows all.
    pub fn known_in(&self, recording: usize) -> Option<&[usize]> {
        self.view(recording).map(|view| view.index.as_slice())
    }

    /// Indices of the copies that single recordings have; empty without [`Model::with_own`].
    pub fn copies(&self) -> Range<usize> {
        self.scopes.as_ref().map_or(0..0, |s| s.first..s.first + s.own.len() * s.views.len())
    }

    /// Indices of the parameters that a recording has for itself, its board's and its copies, in the order of the model that
    /// it knows.
    pub fn own_parameters(&self, recording: usize) -> Vec<usize> {
        let board = self.board_parameters(recording);
        let own = |index: &&usize| board.contains(*index) || self.copies().contains(*index);
        match self.known_in(recording) {
            Some(known) => known.iter().filter(own).copied().collect(),
            None => board.collect(),
        }
    }

    /// The copy that a recording has of a parameter; where it has none, the parameter itself.
    pub fn in_place_of(&self, index: usize, recording: usize) -> usize {
        let copy = |scopes: &Scopes| scopes.copies(recording).nth(scopes.own.binary_search(&index).ok()?);
        self.scopes.as_deref().and_then(copy).unwrap_or(index)
    }

    /// How many recordings the model was made for, if it knows.
    pub(super) fn recordings(&self) -> Option<usize> {
        self.scopes.as_ref().map(|scopes| scopes.views.len())
    }

    /// The model that predicts an observation, with its parameters out of `p`; `None` where it is this one.
    pub(super) fn seen(&self, p: &[f64], o: &Observation) -> Option<(&Model, Vec<f64>)> {
        self.view(o.dwell.recording).map(|view| (&view.model, view.own(p)))
    }

    /// The model as the recording of an observation knows it; `None` where it is this one.
    pub(super) fn known_by(&self, o: &Observation) -> Option<&Model> {
        self.view(o.dwell.recording).map(|view| &view.model)
    }

    /// A derivative with the columns of all parameters, of one with those that the recording of `o` knows.
    pub(super) fn by_all(&self, own: &DMatrix<f64>, o: &Observation) -> DMatrix<f64> {
        let mut all = DMatrix::zeros(own.nrows(), self.parameters.len());
        let known = self.known_in(o.dwell.recording).unwrap_or_default();
        known
            .iter()
            .zip(own.column_iter())
            .for_each(|(&index, column)| all.column_mut(index).copy_from(&column));
        all
    }

    /// Makes the views anew: parameters or effects changed.
    pub(super) fn refresh(&mut self) {
        if let Some(old) = &self.scopes {
            self.scopes = Some(Arc::new(Scopes::new(old.bases.clone(), old.own.clone(), old.first)));
        }
    }

    fn view(&self, recording: usize) -> Option<&View> {
        let scopes = self.scopes.as_deref()?;
        Some(scopes.views.get(recording)?.get_or_init(|| View::of(self, scopes, recording)))
    }
}

impl Scopes {
    fn new(bases: Vec<Option<Pose>>, own: Vec<usize>, first: usize) -> Scopes {
        let views = bases.iter().map(|_| OnceLock::new()).collect();
        Scopes { bases, own, first, views }
    }

    fn copies(&self, recording: usize) -> Range<usize> {
        let first = self.first + recording.min(self.views.len()) * self.own.len();
        first..if recording < self.views.len() { first + self.own.len() } else { first }
    }
}

impl View {
    fn of(model: &Model, scopes: &Scopes, recording: usize) -> View {
        let own_board = model.board_parameters(recording);
        let in_tree = model.tree.0.iter().map(|segment| segment.parameters.end).max().unwrap_or(0);
        let boards_end = model.boards.values().map(|board| board.parameters.end).max().unwrap_or(in_tree);
        let copies = model.copies();
        // Tree, own board, effects that have copies, effects added since.
        let kept: Vec<usize> = (0..in_tree)
            .chain(own_board.clone())
            .chain(boards_end..copies.start)
            .chain(copies.end..model.parameters.len())
            .collect();
        let mut index = kept.clone();
        for (original, copy) in scopes.own.iter().zip(scopes.copies(recording)) {
            kept.binary_search(original).into_iter().for_each(|at| index[at] = copy);
        }
        let named = |(&of, &original): (&usize, &usize)| Parameter {
            name: model.parameters[original].name.clone(),
            ..model.parameters[of].clone()
        };
        let mut parameters: Vec<Parameter> = index.iter().zip(&kept).map(named).collect();
        let base = model.tree.0[0].parameters.clone();
        let mut tree = model.tree.clone();
        let now = |old: usize| kept.binary_search(&old).unwrap_or(parameters.len());
        let mut fixed = model.fixed.clone();
        for place in &mut fixed {
            let first = now(place.segment.parameters.start);
            place.segment.parameters = first..first + place.segment.parameters.len();
        }
        let lengths = model.lengths.iter().map(|length| now(*length)).collect();
        // A rotation vector counts from where the frame starts: it moves with its parameters, or not at all.
        if let Some(start) = scopes.bases[recording].filter(|_| base.clone().all(|k| index[k] != k)) {
            set_start_pose(&mut tree.0[0], &mut parameters, start);
        }
        let board = |board: &Segment| {
            let parameters = in_tree..in_tree + board.parameters.len();
            (recording, Segment { parameters, ..board.clone() })
        };
        let mut own = Model {
            chain: model.chain.clone(),
            parameters,
            tree,
            features: model.features.clone(),
            fixed,
            lengths,
            boards: model.boards.get(&recording).map(board).into_iter().collect(),
            effects: None,
            declared: model.declared.clone(),
            scopes: None,
            own_asked: None,
        };
        let count = own.parameters.len();
        let place = |old: usize| kept.binary_search(&old).unwrap_or(count);
        own.effects = model.effects.as_ref().map(|effects| effects.moved(&place, own.nominal_arm(), count));
        View { model: own, index }
    }

    /// Its parameters out of all.
    fn own(&self, p: &[f64]) -> Vec<f64> {
        self.index.iter().map(|&index| p[index]).collect()
    }
}
