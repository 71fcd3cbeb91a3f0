//! `loads = [...]` of a recording: what hangs on the arm, and where.

use super::{Pipeline, RecordingEntry};
use crate::error::Error;
use armcal_core::{FeatureId, Load};
use serde::Deserialize;

/// A load, as written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadEntry {
    /// The tip or marker that it hangs at.
    pub at: String,
    /// Its mass [kg].
    pub kg: f64,
}

impl Pipeline {
    /// Where a load can hang, in the order of the model's features: the tip of each arm, then the markers.
    fn hooks(&self) -> Vec<String> {
        let tips = match &self.two_arms {
            None => vec!["tip".to_owned()],
            Some(two) => two.arms.iter().map(|arm| format!("{}.tip", arm.name)).collect(),
        };
        tips.into_iter().chain(self.markers.keys().cloned()).collect()
    }

    /// The load at the (first) tip in a recording [kg], and those at other points.
    pub fn loads_of(&self, entry: &RecordingEntry) -> (f64, Vec<Load>) {
        let hooks = self.hooks();
        let load = |load: &LoadEntry| {
            let at = hooks.iter().position(|hook| *hook == load.at)?;
            Some(Load { at: FeatureId(at), kg: load.kg })
        };
        let (first, more): (Vec<Load>, Vec<Load>) =
            entry.loads.iter().filter_map(load).partition(|load| load.at.is_tip());
        (first.first().map_or(entry.load_kg, |load| load.kg), more)
    }
}

/// Loads of recording `i` that are none, or that nothing holds; `fail` makes an error of a key and what is wrong with it.
pub(super) fn check(
    pipeline: &Pipeline,
    i: usize,
    entry: &RecordingEntry,
    fail: &dyn Fn(&str, String) -> Result<(), Error>,
) -> Result<(), Error> {
    let is_mass = |kg: f64| kg.is_finite() && kg >= 0.0;
    let key = |key: &str| format!("recordings[{i}].{key}");
    if !is_mass(entry.load_kg) {
        return fail(&key("load_kg"), format!("is {}, and a load weighs 0 kg or more", entry.load_kg));
    }
    let hooks = pipeline.hooks();
    for (nth, load) in entry.loads.iter().enumerate() {
        let at = &load.at;
        if !hooks.contains(at) {
            let known = hooks.join(", ");
            return fail(
                &key("loads"),
                format!("hangs one at `{at}`, which the arm does not have; it has {known}"),
            );
        }
        if !is_mass(load.kg) {
            return fail(
                &key("loads"),
                format!("has {} kg at `{at}`, and a load weighs 0 kg or more", load.kg),
            );
        }
        let twice = entry.loads[..nth].iter().any(|other| other.at == *at);
        if twice || (*at == hooks[0] && entry.load_kg != 0.0) {
            let problem = format!("gives `{at}` two loads (load_kg is that of `{}`); add them up", hooks[0]);
            return fail(&key("loads"), problem);
        }
    }
    Ok(())
}
