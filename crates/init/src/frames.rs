//! Bodies that hang on different frames of one tree of transforms, and the frame that they are all compared in.

use super::files::Opened;
use super::topics::BodyTopic;
use crate::error::InitError;
use armcal_recording::{LengthUnit, Transforms};
use armcal_stages::RunError;
use std::collections::{BTreeMap, BTreeSet};

/// Gives bodies the root of their tree as frame, where tracked ones hang on different frames; what no transforms join to it is
/// left out and told. Transforms on `.._static` topics join others and are nothing that is tracked.
pub fn assign_root_frames(
    bodies: &mut Vec<BodyTopic>,
    opened: &[Opened],
    left: &mut Vec<(String, String)>,
) -> Result<(), InitError> {
    let Some(first) = opened.first() else { return Ok(()) };
    let named: BTreeSet<String> =
        bodies.iter().filter(|b| b.position.is_none()).map(|b| b.topic.clone()).collect();
    let topics: Vec<&str> = named.iter().map(String::as_str).collect();
    let read = first.recording.transforms(&topics, LengthUnit::M);
    let read = read.map_err(|source| RunError::Recording { recording: first.entry.name(), source })?;
    let trees: BTreeMap<&str, Transforms> = topics.into_iter().zip(read).collect();
    let hung = |b: &BodyTopic| -> Option<(String, &Transforms)> {
        let tree = trees.get(b.topic.as_str()).filter(|_| b.position.is_none())?;
        Some((b.body.clone().or_else(|| tree.only_child(&b.topic))?, tree))
    };
    let tracked = bodies.iter().filter(|b| !b.topic.ends_with("_static")).filter_map(&hung);
    let parents: BTreeSet<&str> = tracked.flat_map(|(body, tree)| tree.parents(&body)).collect();
    if parents.len() < 2 {
        return Ok(());
    }
    bodies.retain_mut(|body| {
        let Some((name, tree)) = hung(body) else { return true };
        let roots = tree.roots().into_iter().filter(|root| tree.joins(root, &name)).collect::<Vec<_>>();
        let [root] = roots.as_slice() else { return true };
        if tree.parents(&name) == BTreeSet::from([*root]) {
            return true;
        }
        match tree.chain(root, &name) {
            Ok(Some(_)) => (body.body, body.frame) = (Some(name), Some((*root).to_owned())),
            Ok(None) => {}
            Err(why) => left.push((body.shown(), format!("{} {why}", body.topic))),
        }
        body.frame.is_some()
    });
    Ok(())
}
