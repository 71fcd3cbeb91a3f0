//! Names of the frames of a model, and which of them observations say something about.

use armcal_core::{Against, Observation, Parameter, Role};
use armcal_model::Model;
use std::collections::BTreeSet;

/// Whether a parameter places a frame that is fitted.
pub(crate) fn is_free(p: &Parameter) -> bool {
    p.free && p.role == Role::EstimatedFrame
}

/// Names of the frames the observations say something about: the base, the tip, the markers that were measured, and the
/// boards with seated dwells, the places measured against and the lengths that distances count from; then what the observed
/// recordings have copies of.
pub(crate) fn touched_frames(model: &Model, observations: &[&Observation]) -> Vec<String> {
    let (names, tips) = (frame_names(model), tips_at(model));
    let of = |o: &&Observation| match o.against() {
        Some(Against::Feature(to)) => [o.feature, to],
        _ => [o.feature; 2],
    };
    let measured: BTreeSet<usize> = observations.iter().flat_map(of).map(|k| tips + k.0).collect();
    let known = |k: &usize| *k < 2 * tips || measured.contains(k);
    let features = tips + model.features().count();
    let arm = names.iter().enumerate().take(features).filter(|(k, _)| known(k));
    let mut touched: Vec<String> = arm.map(|(_, name)| name.clone()).collect();
    let seated: BTreeSet<usize> =
        observations.iter().filter(|o| o.cavity().is_some()).map(|o| o.dwell.recording).collect();
    let boards = names.iter().skip(features).take(model.boards()).enumerate();
    touched.extend(boards.filter(|(recording, _)| seated.contains(recording)).map(|(_, name)| name.clone()));
    let against: BTreeSet<Against> = observations.iter().filter_map(|o| o.against()).collect();
    let is_used = |place: &usize| against.contains(&Against::Fixed(*place));
    touched.extend(model.places().filter(|(k, ..)| is_used(k)).map(|(_, name, _)| name.to_owned()));
    let counted = |length: &usize| observations.iter().any(|o| o.length() == Some(*length));
    let lengths = model.lengths().enumerate().filter(|(k, _)| counted(k));
    touched.extend(lengths.map(|(_, (name, _))| name.to_owned()));
    let observed: BTreeSet<usize> = observations.iter().map(|o| o.dwell.recording).collect();
    for index in observed.into_iter().flat_map(|recording| model.own_parameters(recording)) {
        let part = frame_of(&model.parameters()[index]);
        if model.copies().contains(&index) && touched.last().is_none_or(|last| last != part) {
            touched.push(part.to_owned());
        }
    }
    touched
}

/// Where among [`frame_names`] those of the tips begin, one an arm as the bases before them; those of the markers are behind
/// them.
pub(crate) fn tips_at(model: &Model) -> usize {
    model.chain().arms().len().max(1)
}

/// The names of the recordings' boards.
pub(crate) fn board_names(model: &Model) -> Vec<String> {
    frame_names(model)
        .into_iter()
        .skip(tips_at(model) + model.features().count())
        .take(model.boards())
        .collect()
}

/// Frames of the model in its documented order: bases, tips, markers, then one board a recording, and a link.
pub(crate) fn frame_names(model: &Model) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let shared = |index: &usize| !model.copies().contains(index);
    let all = (0..model.parameters().len()).filter(shared).map(|index| &model.parameters()[index]);
    for p in all.filter(|p| matches!(p.role, Role::EstimatedFrame | Role::KnownFrame)) {
        let name = frame_of(p);
        if names.last().is_none_or(|last| last != name) {
            names.push(name.to_string());
        }
    }
    names
}

/// The part of the rig a parameter belongs to, such as the frame it places.
pub(crate) fn frame_of(parameter: &Parameter) -> &str {
    parameter.name.rsplit_once('.').map_or(parameter.name.as_str(), |(frame, _)| frame)
}
