//! Names that are there once.

use armcal_model::Skeleton;
use std::collections::BTreeSet;

/// The names of one document.
#[derive(Default)]
pub(crate) struct Names(BTreeSet<String>);

impl Names {
    /// The name, with something behind it where another one has it already.
    pub fn fresh(&mut self, name: &str, behind: &str) -> String {
        let mut name = name.to_owned();
        while !self.0.insert(name.clone()) {
            name += behind;
        }
        name
    }
}

/// The skeleton with names that are there once: links among each other and, where `shared`, joints among them too. Joints keep
/// theirs.
pub(crate) fn with_unique_names(skeleton: &Skeleton, shared: bool) -> Skeleton {
    let (mut skeleton, mut names) = (skeleton.clone(), Names::default());
    // What simulators call the world.
    names.fresh("world", "_");
    if shared {
        skeleton.joints.iter().for_each(|bone| drop(names.fresh(&bone.name, "_")));
    }
    skeleton.root = names.fresh(&skeleton.root, "_link");
    skeleton.joints.iter_mut().for_each(|bone| bone.link = names.fresh(&bone.link, "_link"));
    skeleton.places.iter_mut().for_each(|place| place.name = names.fresh(&place.name, "_calibrated"));
    skeleton
}

/// The name of the link that a joint carries, or of the root.
pub(crate) fn link_name(skeleton: &Skeleton, on: Option<usize>) -> &str {
    on.map_or(&skeleton.root, |at| &skeleton.joints[at].link)
}
